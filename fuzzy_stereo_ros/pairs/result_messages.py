# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Results of a pair into messages, live and to a bag, without importing ROS.

A message is anything with the fields of its ROS type: rclpy's and those written to a bag.
"""
from array import array

import cv2
from fuzzy_stereo_ros.pairs.calibration import depth_of, millimetres_of, write_points
from fuzzy_stereo_ros.pairs.image_files import colour_disparity, in_eight_bits
import numpy as np

DISPARITY, POINTS = 'disparity', 'points2'
# By the word of the parameter `outputs`: topics and their types.
TOPICS = {
    'disparity': ((DISPARITY, 'stereo_msgs/msg/DisparityImage'),),
    'confidence': (('confidence', 'sensor_msgs/msg/Image'),),
    'depth': (('depth/image_rect', 'sensor_msgs/msg/Image'),
              ('depth/camera_info', 'sensor_msgs/msg/CameraInfo')),
    'points2': ((POINTS, 'sensor_msgs/msg/PointCloud2'),),
    'preview': (('preview', 'sensor_msgs/msg/Image'),),
}
METRIC = 'depth/image_rect', 'depth/camera_info', POINTS    # topics that need a baseline
DISPARITY_STEP = 1 / 16     # px; what the matcher rounds its sub-pixel disparities to
WHOLE_PIXEL = 1.0           # step of the paper's disparities
FLOAT32 = 7                 # sensor_msgs/PointField's number for it
# By (use_color, avoid_point_cloud_padding): 32-bit words of a point, and which one is the colour.
POINT_LAYOUTS = {(True, False): (8, 4), (False, False): (4, None),
                 (True, True): (4, 3), (False, True): (3, None)}


class ResultMessages:
    """Makes the message of a topic; that of the points uses the same memory again."""

    def __init__(self, make, settings):
        """
        Make nothing yet.

        make(type name, **fields): returns a message, empty but for the fields.
        settings: depth_encoding, use_color and avoid_point_cloud_padding, by name.
        """
        self._make, self._settings = make, settings
        self._cloud = None      # new memory for each would cost more than its points

    def of(self, topic, matched):
        """Return the message of one of the `TOPICS` for a MatchedPair; None without metres."""
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
                use_color=self._settings['use_color'],
                avoid_point_cloud_padding=self._settings['avoid_point_cloud_padding'])
        if topic == 'depth/camera_info':
            return fill_camera_info(self._make('sensor_msgs/msg/CameraInfo'), pair)
        image = self._make('sensor_msgs/msg/Image')
        if topic == 'confidence':
            return fill_image(image, match.confidence, pair, '32FC1')
        if topic == 'preview':
            last = config.min_disparity + config.disparities - 1
            return fill_image(image, colour_disparity(
                match.disparity, config.min_disparity, last), pair, 'bgr8')
        depth, encoding = depth_of(match.disparity, pair.calibration), self._settings[
            'depth_encoding']       # of REP 118: metres, or millimetres
        return fill_image(image, millimetres_of(depth) if encoding == '16UC1' else depth, pair,
                          encoding)


def fill_disparity(message, match, pair, config):
    """
    Fill a stereo_msgs/DisparityImage and return it.

    match.disparity: float32 (R, C), px, NaN = invalid; config: the MatcherConfig it was made
    with.
    Disparities are corrected by the calibration's offset, as the message wants them. What is
    invalid becomes min_disparity - 1; valid values lie in min_disparity to max_disparity. The
    valid window is what both cameras can see at any disparity, the whole image where it is filled.
    """
    offset, (rows, columns) = pair.calibration.offset, match.disparity.shape
    last = config.min_disparity + config.disparities - 1
    smallest = np.float32(config.min_disparity - offset)
    largest = np.float32(last - offset)
    values = match.disparity - np.float32(offset)
    np.clip(values, smallest, largest, out=values)
    cv2.patchNaNs(values, float(smallest - np.float32(1)))
    _fill_header(message.header, pair)
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
    """
    Fill an empty sensor_msgs/CameraInfo of the left image as it is, and return it.

    It has no binning, no region of interest, and nothing to rectify.
    """
    fx, fy, cx, cy = pair.calibration.left
    _fill_header(message.header, pair)
    message.height, message.width = pair.left.shape[:2]
    message.distortion_model = 'plumb_bob'
    message.d, message.r = array('d', 5 * [0.0]), np.eye(3).ravel()
    message.k = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], np.float64)
    message.p = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], np.float64)
    return message


def fill_points(message, match, pair, point_field, *, use_color, avoid_point_cloud_padding):
    """
    Fill a sensor_msgs/PointCloud2, a point for each pixel in rows and columns, and return it.

    A message that was filled before is filled again in the memory that it has.
    match.disparity: float32 (R, C), px, NaN = invalid; invalid and too far points are NaN.
    point_field: the class PointField of the message's kind, called with its fields by name.
    use_color, avoid_point_cloud_padding: the fields and their places are those that
    stereo_image_proc's point_cloud_node sends with these parameters; rgb is of the left image.
    """
    words, colour = POINT_LAYOUTS[use_color, avoid_point_cloud_padding]
    rows, columns = match.disparity.shape
    places = [('x', 0), ('y', 1), ('z', 2), *([] if colour is None else [('rgb', colour)])]
    fields = [point_field(name=name, offset=4 * place, datatype=FLOAT32, count=1)
              for name, place in places]
    # With padding it is 32 bytes a pixel: to get that from the system takes longer than to fill.
    data, size = message.data, 4 * words * columns * rows
    if len(data) != size or message.fields != fields or message.point_step != 4 * words:
        data = array('B', b'\0') * size
    values = np.frombuffer(data, '<f4').reshape(rows, columns, words)
    write_points(depth_of(match.disparity, pair.calibration), pair.calibration.left, values)
    if colour is not None:
        image = in_eight_bits(pair.left)
        moves = [number for byte, channel in enumerate(range(3) if image.ndim == 3 else (0, 0, 0))
                 for number in (channel, 4 * colour + byte)]    # 0x00RRGGBB, least byte first
        cv2.mixChannels([image], [values.view(np.uint8)], moves)
    _fill_header(message.header, pair)
    message.height, message.width = rows, columns
    message.fields, message.data = fields, data
    message.point_step, message.row_step = 4 * words, 4 * words * columns
    message.is_bigendian = message.is_dense = False
    return message


def _step(config, largest):
    """Return the smallest step between disparities as far from 0 as the largest, px."""
    if config.algorithm == 'quality':
        return float(np.spacing(largest))       # of planes, which are not rounded
    return WHOLE_PIXEL if config.algorithm == 'paper' else DISPARITY_STEP


def _fill_header(header, pair):
    header.stamp.sec, header.stamp.nanosec = divmod(pair.stamp, 1_000_000_000)
    header.frame_id = pair.frame_id


def fill_image(message, values, pair, encoding):
    """Fill a sensor_msgs/Image, (R, C) or (R, C, channels) of the encoding's dtype; return it."""
    values = np.ascontiguousarray(values, values.dtype.newbyteorder('<'))
    _fill_header(message.header, pair)
    message.height, message.width = values.shape[:2]
    message.encoding, message.is_bigendian = encoding, 0
    message.step = values.strides[0]
    # rclpy takes array.array('B') as it is; anything else it checks byte by byte.
    data = array('B')
    data.frombytes(memoryview(values).cast('B'))
    message.data = data
    return message
