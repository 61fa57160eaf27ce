# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What came of a pair into messages, without importing ROS.

A message is anything with the fields of its ROS type: rclpy's and those written to a bag.
"""
from array import array

import numpy as np

DISPARITY_STEP = 1 / 16     # px; what the matcher rounds its sub-pixel disparities to
WHOLE_PIXEL = 1.0           # step of the paper's disparities


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
    np.copyto(values, smallest - np.float32(1), where=np.isnan(values))
    _fill_header(message.header, pair)
    _fill_image(message.image, values, pair)
    message.f = pair.calibration.focal
    setattr(message, 't' if hasattr(message, 't') else 'T', pair.calibration.baseline)
    message.min_disparity, message.max_disparity = float(smallest), float(largest)
    message.delta_d = WHOLE_PIXEL if config.search == 'paper' else DISPARITY_STEP
    window = message.valid_window
    first, behind = (0, columns) if config.fill else (
        min(max(0, last), columns), columns - max(0, -config.min_disparity))
    window.x_offset, window.width = first, max(0, behind - first)
    window.y_offset, window.height, window.do_rectify = 0, rows, False
    return message


def fill_confidence(message, match, pair):
    """Fill a sensor_msgs/Image, 32FC1, with match.confidence, float32 (R, C), 0 to 1."""
    _fill_image(message, match.confidence, pair)
    return message


def _fill_header(header, pair):
    header.stamp.sec, header.stamp.nanosec = divmod(pair.stamp, 1_000_000_000)
    header.frame_id = pair.frame_id


def _fill_image(message, values, pair):
    """Fill a sensor_msgs/Image of 32FC1 with float32 (R, C)."""
    _fill_header(message.header, pair)
    message.height, message.width = values.shape
    message.encoding, message.is_bigendian = '32FC1', 0
    message.step = 4 * values.shape[1]
    # rclpy takes array.array('B') as it is; anything else it checks byte by byte.
    data = array('B')
    data.frombytes(memoryview(np.ascontiguousarray(values, '<f4')).cast('B'))
    message.data = data
