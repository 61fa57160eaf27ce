# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Make the messages of a matched pair, for the node and for bags, without importing ROS.

A message is any object with the fields of its ROS type: one of rclpy, or one written to a bag.
"""
from array import array

import cv2
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.pairs.calibration import millimetres_of
from fuzzy_stereo_ros.pairs.camera_files import rectified_cameras
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
from fuzzy_stereo_ros.pairs.messages import fill_camera, fill_header, fill_pixels
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
DISPARITY, POINTS = 'disparity', 'points2'
DEPTH, DEPTH_CAMERA = 'depth/image_rect', 'depth/camera_info'
# image_transport subscribes to these as transports of the topics they begin with.
DEPTH_COMPRESSED, PREVIEW_COMPRESSED = f'{DEPTH}/compressedDepth', 'preview/compressed'
# Topics and their types, by the word of the parameter `outputs`.
TOPICS = {
    'disparity': ((DISPARITY, 'stereo_msgs/msg/DisparityImage'),),
    'confidence': (('confidence', 'sensor_msgs/msg/Image'),),
    'depth': ((DEPTH, 'sensor_msgs/msg/Image'), (DEPTH_CAMERA, 'sensor_msgs/msg/CameraInfo')),
    'depth_compressed': ((DEPTH_COMPRESSED, 'sensor_msgs/msg/CompressedImage'),
                         (DEPTH_CAMERA, 'sensor_msgs/msg/CameraInfo')),
    'points2': ((POINTS, 'sensor_msgs/msg/PointCloud2'),),
    'preview': (('preview', 'sensor_msgs/msg/Image'),),
    'preview_compressed': ((PREVIEW_COMPRESSED, 'sensor_msgs/msg/CompressedImage'),),
}
METRIC = DEPTH, DEPTH_CAMERA, DEPTH_COMPRESSED, POINTS      # topics that need a baseline
JPEG_QUALITY = 80       # half the bytes of OpenCV's 95
# The header of compressed_depth_image_transport: format 0 and two parameters that it has no use
# for in 16 bits.
DEPTH_HEADER = bytes(12)
DISPARITY_STEP = 1 / 16     # px, to which the matcher rounds sub-pixel disparities
WHOLE_PIXEL = 1.0           # px, step of the disparities of `paper`


def topics_of(words):
    """Return {topic: type} of words of the parameter `outputs`, in the order of TOPICS."""
    return {topic: kind for word, several in TOPICS.items() if word in words
            for topic, kind in several}


class ResultMessages:
    """Makes the messages of the output topics; all point clouds use the same memory."""

    def __init__(self, make, settings):
        """Store make(type name, **fields), and values of depth_encoding and POINT_SETTINGS."""
        self._make, self._settings = make, settings
        self._cloud = None      # allocating one takes longer than filling it

    def of(self, topic, matched):
        """Return the message of a topic for a MatchedPair; None if it lacks the baseline."""
        pair, match, config = matched.pair, matched.match, matched.config
        if topic in METRIC and not pair.calibration.baseline:
            return None
        if topic == DISPARITY:
            return fill_disparity(
                self._make('stereo_msgs/msg/DisparityImage'), match, pair, config)
        if topic == POINTS:
            self._cloud = self._cloud or self._make('sensor_msgs/msg/PointCloud2')
            return fill_points(
                self._cloud, match, pair,
                lambda **fields: self._make('sensor_msgs/msg/PointField', **fields),
                self._settings)
        if topic == DEPTH_CAMERA:
            return fill_camera_info(self._make('sensor_msgs/msg/CameraInfo'), pair)
        if topic in (DEPTH_COMPRESSED, PREVIEW_COMPRESSED):
            fill, image = fill_compressed, self._make('sensor_msgs/msg/CompressedImage')
        else:
            fill, image = fill_image, self._make('sensor_msgs/msg/Image')
        if topic == 'confidence':
            return fill(image, match.confidence, pair, '32FC1')
        if topic in ('preview', PREVIEW_COMPRESSED):
            last = config.min_disparity + config.disparities - 1
            return fill(image, colour_disparity(
                match.disparity, config.min_disparity, last), pair, 'bgr8')
        depth = pair.calibration.depth(match.disparity)
        # Of REP 118: metres, or millimetres.
        encoding = '16UC1' if topic == DEPTH_COMPRESSED else self._settings['depth_encoding']
        return fill(image, millimetres_of(depth) if encoding == '16UC1' else depth, pair, encoding)


def fill_disparity(message, match, pair, config):
    """
    Fill a stereo_msgs/DisparityImage and return it.

    match.disparity: float32 (R, C), px, NaN = invalid. config: the MatcherConfig of the match.
    The message requires disparities without the calibration's offset: it is subtracted. Invalid
    pixels become min_disparity - 1; valid ones lie between min_disparity and max_disparity. The
    valid window is what both cameras see at every disparity, the whole image with config.fill.
    """
    offset, (rows, columns) = pair.calibration.offset, match.disparity.shape
    last = config.min_disparity + config.disparities - 1
    smallest = np.float32(config.min_disparity - offset)
    largest = np.float32(last - offset)
    values = match.disparity - np.float32(offset)
    np.clip(values, smallest, largest, out=values)
    cv2.patchNaNs(values, float(smallest - np.float32(1)))
    fill_header(message.header, pair)
    fill_image(message.image, values, pair, '32FC1')
    message.f = pair.calibration.focal
    message.t = pair.calibration.baseline
    message.min_disparity, message.max_disparity = float(smallest), float(largest)
    message.delta_d = _step(config, max(abs(smallest), abs(largest)))
    window = message.valid_window
    first, behind = (0, columns) if config.fill else (
        min(max(0, last), columns), columns - max(0, -config.min_disparity))
    window.x_offset, window.width = first, max(0, behind - first)
    window.y_offset, window.height, window.do_rectify = 0, rows, False
    return message


def fill_camera_info(message, pair):
    """Fill and return an empty CameraInfo of the left image as matched: no binning, no region."""
    fill_header(message.header, pair)
    return fill_camera(
        message, rectified_cameras(pair.calibration, *pair.left.shape[:2])['left'])


def _step(config, largest):
    """Return the smallest step between two disparities, px; largest: magnitude of any, px."""
    if config.algorithm == 'quality':
        return float(np.spacing(largest))       # disparities of planes are not rounded
    return WHOLE_PIXEL if config.algorithm == 'paper' else DISPARITY_STEP


def fill_image(message, values, pair, encoding):
    """Fill a sensor_msgs/Image with the header of a pair, as `fill_pixels`; return it."""
    fill_header(message.header, pair)
    return fill_pixels(message, values, encoding)


def fill_compressed(message, values, pair, encoding):
    """Fill and return a CompressedImage as image_transport does: a JPEG, or of 16UC1 a PNG."""
    fill_header(message.header, pair)
    if encoding == '16UC1':
        message.format = f'{encoding}; compressedDepth png'
        content = DEPTH_HEADER + cv2.imencode('.png', values)[1].tobytes()
    else:
        message.format = f'{encoding}; jpeg compressed {encoding}'
        content = cv2.imencode('.jpg', values, (
            cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))[1].tobytes()
    message.data = array('B', content)
    return message


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
