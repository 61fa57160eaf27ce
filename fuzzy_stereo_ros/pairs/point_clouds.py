# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fill a PointCloud2 with the points of a match: of all pixels, or fewer for a network."""
from array import array

import cv2
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
from fuzzy_stereo_ros.pairs.messages import fill_header
from fuzzy_stereo_ros.pairs.stereo_pair import Projection
import numpy as np

# Parameters of the node that say which points and fields a cloud has.
POINT_SETTINGS = ('use_color', 'avoid_point_cloud_padding', 'points_stride', 'points_max_depth',
                  'points_voxel_size')
FLOAT32 = 7                 # sensor_msgs/PointField.FLOAT32
# By (use_color, avoid_point_cloud_padding): 32-bit words of a point, and the index of its colour.
POINT_LAYOUTS = {(True, False): (8, 4), (False, False): (4, None),
                 (True, True): (4, 3), (False, True): (3, None)}
LAST_VOXEL = 2**20 - 1      # along an axis, from the camera, so that three make a 64-bit number


def fill_points(message, match, pair, point_field, settings):
    """
    Fill a sensor_msgs/PointCloud2 with a point for each pixel, in rows and columns; return it.

    A message of the same layout and size is filled in its own memory.
    match.disparity: float32 (R, C), px, NaN = invalid; invalid and infinitely far points are NaN.
    point_field(**fields): returns a PointField message. settings: {name: value}, which has
    use_color, avoid_point_cloud_padding: the fields and their offsets are those that
    stereo_image_proc's point_cloud_node sends with these parameters; rgb is of the left image;
    points_stride: step of rows and columns;
    points_max_depth: m, points beyond `Calibration.points_limit` are NaN, too;
    points_voxel_size: m; a list of finite points is sent, one of each cube of this size; 0 is all.
    """
    words, colour = POINT_LAYOUTS[settings['use_color'], settings['avoid_point_cloud_padding']]
    stride = settings['points_stride']
    few = np.s_[::stride, ::stride]
    depth = pair.calibration.depth(match.disparity[few])
    farthest = pair.calibration.points_limit(settings['points_max_depth'])
    np.copyto(depth, np.nan, where=depth > farthest)
    (rows, columns), size = depth.shape, 4 * words * depth.size
    indices = [('x', 0), ('y', 1), ('z', 2), *([] if colour is None else [('rgb', colour)])]
    fields = [point_field(name=name, offset=4 * index, datatype=FLOAT32, count=1)
              for name, index in indices]
    data = message.data
    if len(data) != size or message.fields != fields or message.point_step != 4 * words:
        data = array('B', b'\0') * size
    values = np.frombuffer(data, '<f4').reshape(rows, columns, words)
    Projection(*(number / stride for number in pair.calibration.left)).points(depth, values)
    if colour is not None:
        image = in_eight_bits(pair.left[few])
        from_to = [number for byte, channel in enumerate(range(3) if image.ndim == 3 else 3 * [0])
                   for number in (channel, 4 * colour + byte)]  # 0x00RRGGBB, little-endian
        cv2.mixChannels([image], [values.view(np.uint8)], from_to)
    voxel = settings['points_voxel_size']
    if voxel:
        values = one_of_each_voxel(values[np.isfinite(depth)], voxel)
        (rows, columns), data = (1, len(values)), array('B', values.tobytes())
    fill_header(message.header, pair)
    message.height, message.width = rows, columns
    message.fields, message.data = fields, data
    message.point_step, message.row_step = 4 * words, 4 * words * columns
    message.is_bigendian, message.is_dense = False, bool(voxel)
    return message


def one_of_each_voxel(points, size):
    """
    Return the first of the points of each voxel, in their order.

    points: float32 (N, 3 or more), x, y and z first, finite, m. size: of a voxel, m.
    pcl::VoxelGrid sends means instead; a point that was measured keeps its own colour, and none
    comes to lie between two surfaces.
    """
    with np.errstate(over='ignore'):    # what is too far shares the last voxel
        cells = np.floor(points[:, :3] / size)
    cells = np.clip(cells, -LAST_VOXEL, LAST_VOXEL).astype(np.int64)
    across, down, forward = cells.T + LAST_VOXEL
    first = np.unique((across << 42) + (down << 21) + forward, return_index=True)[1]
    return points[np.sort(first)]
