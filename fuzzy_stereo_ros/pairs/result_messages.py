# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Make the messages of a matched pair, for the node and for bags, without importing ROS.

A message is any object with the fields of its ROS type: one of rclpy, or one written to a bag.
"""
from array import array

import cv2
from fuzzy_stereo_ros.pairs.calibration import depth_of, millimetres_of, write_points
from fuzzy_stereo_ros.pairs.image_files import colour_disparity, in_eight_bits
from fuzzy_stereo_ros.pairs.messages import fill_pixels, set_stamp
import numpy as np

DISPARITY, POINTS = 'disparity', 'points2'
# Topics and their types, by the word of the parameter `outputs`.
TOPICS = {
    'disparity': ((DISPARITY, 'stereo_msgs/msg/DisparityImage'),),
    'confidence': (('confidence', 'sensor_msgs/msg/Image'),),
    'depth': (('depth/image_rect', 'sensor_msgs/msg/Image'),
              ('depth/camera_info', 'sensor_msgs/msg/CameraInfo')),
    'points2': ((POINTS, 'sensor_msgs/msg/PointCloud2'),),
    'preview': (('preview', 'sensor_msgs/msg/Image'),),
}
METRIC = 'depth/image_rect', 'depth/camera_info', POINTS    # topics that need a baseline
DISPARITY_STEP = 1 / 16     # px, to which the matcher rounds sub-pixel disparities
WHOLE_PIXEL = 1.0           # px, step of the disparities of `paper`
FLOAT32 = 7                 # sensor_msgs/PointField.FLOAT32
# By (use_color, avoid_point_cloud_padding): 32-bit words of a point, and the index of its colour.
POINT_LAYOUTS = {(True, False): (8, 4), (False, False): (4, None),
                 (True, True): (4, 3), (False, True): (3, None)}


class ResultMessages:
    """Makes the messages of the output topics; all point clouds use the same memory."""

    def __init__(self, make, settings):
        """
        Store how to make messages.

        make(type name, **fields): returns a message with these fields, all others empty.
        settings: {name: value} of depth_encoding, use_color and avoid_point_cloud_padding.
        """
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
        depth = depth_of(match.disparity, pair.calibration)
        encoding = self._settings['depth_encoding']     # of REP 118: metres, or millimetres
        return fill_image(image, millimetres_of(depth) if encoding == '16UC1' else depth, pair,
                          encoding)


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
    Fill an empty sensor_msgs/CameraInfo of the left image as it was matched, and return it.

    It has no binning, no region of interest and no distortion.
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
    Fill a sensor_msgs/PointCloud2 with a point for each pixel, in rows and columns; return it.

    A message of the same layout and size is filled in its own memory.
    match.disparity: float32 (R, C), px, NaN = invalid; invalid and infinitely far points are NaN.
    point_field(**fields): returns a PointField message.
    use_color, avoid_point_cloud_padding: the fields and their offsets are those that
    stereo_image_proc's point_cloud_node sends with these parameters; rgb is of the left image.
    """
    words, colour = POINT_LAYOUTS[use_color, avoid_point_cloud_padding]
    rows, columns = match.disparity.shape
    indices = [('x', 0), ('y', 1), ('z', 2), *([] if colour is None else [('rgb', colour)])]
    fields = [point_field(name=name, offset=4 * index, datatype=FLOAT32, count=1)
              for name, index in indices]
    data, size = message.data, 4 * words * columns * rows
    if len(data) != size or message.fields != fields or message.point_step != 4 * words:
        data = array('B', b'\0') * size
    values = np.frombuffer(data, '<f4').reshape(rows, columns, words)
    write_points(depth_of(match.disparity, pair.calibration), pair.calibration.left, values)
    if colour is not None:
        image = in_eight_bits(pair.left)
        from_to = [number for byte, channel in enumerate(range(3) if image.ndim == 3 else 3 * [0])
                   for number in (channel, 4 * colour + byte)]  # 0x00RRGGBB, little-endian
        cv2.mixChannels([image], [values.view(np.uint8)], from_to)
    _fill_header(message.header, pair)
    message.height, message.width = rows, columns
    message.fields, message.data = fields, data
    message.point_step, message.row_step = 4 * words, 4 * words * columns
    message.is_bigendian = message.is_dense = False
    return message


def _step(config, largest):
    """Return the smallest step between two disparities, px; largest: magnitude of any, px."""
    if config.algorithm == 'quality':
        return float(np.spacing(largest))       # disparities of planes are not rounded
    return WHOLE_PIXEL if config.algorithm == 'paper' else DISPARITY_STEP


def _fill_header(header, pair):
    set_stamp(header, pair.stamp)
    header.frame_id = pair.frame_id


def fill_image(message, values, pair, encoding):
    """Fill a sensor_msgs/Image with the header of a pair, as `fill_pixels`; return it."""
    _fill_header(message.header, pair)
    return fill_pixels(message, values, encoding)
