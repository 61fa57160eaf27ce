# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Messages into pairs, without importing ROS.

A message is anything with the fields of its ROS type: rclpy's and those read from a bag.
"""
from dataclasses import replace

import cv2
from fuzzy_stereo_ros.pairs.calibration import expected_size, read_calibration
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, StereoPair
import numpy as np

# Encoding: dtype and channels of a pixel, then OpenCV's code for BGR, or the place of the luma.
# OpenCV names a Bayer pattern after its second row and column, ROS after its first.
ENCODINGS = {
    'mono8': (np.uint8, 1, None),
    '8UC1': (np.uint8, 1, None),
    'mono16': (np.uint16, 1, None),
    '16UC1': (np.uint16, 1, None),
    'bgr8': (np.uint8, 3, None),
    '8UC3': (np.uint8, 3, None),
    'rgb8': (np.uint8, 3, cv2.COLOR_RGB2BGR),
    'bgra8': (np.uint8, 4, cv2.COLOR_BGRA2BGR),
    '8UC4': (np.uint8, 4, cv2.COLOR_BGRA2BGR),
    'rgba8': (np.uint8, 4, cv2.COLOR_RGBA2BGR),
    'bgr16': (np.uint16, 3, None),
    '16UC3': (np.uint16, 3, None),
    'rgb16': (np.uint16, 3, cv2.COLOR_RGB2BGR),
    'bayer_rggb8': (np.uint8, 1, cv2.COLOR_BayerBG2BGR),
    'bayer_bggr8': (np.uint8, 1, cv2.COLOR_BayerRG2BGR),
    'bayer_gbrg8': (np.uint8, 1, cv2.COLOR_BayerGR2BGR),
    'bayer_grbg8': (np.uint8, 1, cv2.COLOR_BayerGB2BGR),
    'bayer_rggb16': (np.uint16, 1, cv2.COLOR_BayerBG2BGR),
    'bayer_bggr16': (np.uint16, 1, cv2.COLOR_BayerRG2BGR),
    'bayer_gbrg16': (np.uint16, 1, cv2.COLOR_BayerGR2BGR),
    'bayer_grbg16': (np.uint16, 1, cv2.COLOR_BayerGB2BGR),
    'yuv422': (np.uint8, 2, 'second'),
    'uyvy': (np.uint8, 2, 'second'),
    'yuv422_yuy2': (np.uint8, 2, 'first'),
    'yuyv': (np.uint8, 2, 'first'),
    'nv12': (np.uint8, 1, None),
    'nv21': (np.uint8, 1, None),
}
SMALLEST_MOSAIC = 4     # px; below this OpenCV cannot fill in a Bayer pattern


def read_pair(left, left_info, right, right_info):
    """
    Return the StereoPair of four messages: two images, raw or compressed, and their CameraInfo.

    The remarks of its calibration also tell where an image is not of the size its CameraInfo
    expects. Raises BadPair with a sentence where the four cannot be matched.
    """
    calibration = read_calibration(left_info, right_info)
    images, remarks = [], list(calibration.remarks)
    for side, message, info in (('left', left, left_info), ('right', right, right_info)):
        try:
            images.append(read_image(message))
        except BadPair as bad:
            raise BadPair(bad.reason, f'{side} image: {bad}') from None
        expected = expected_size(info)
        if expected not in (None, images[-1].shape[:2]):
            remarks.append(f'the {side} image is {_size(images[-1].shape)}, its camera_info '
                           f'expects {_size(expected)}; disparities are of the image as it is')
    if images[0].shape[:2] != images[1].shape[:2]:
        raise BadPair('size', f'the left image is {_size(images[0].shape)}, the right one '
                      f'{_size(images[1].shape)}; a pair needs two of one size')
    if len(remarks) > len(calibration.remarks):
        calibration = replace(calibration, remarks=tuple(remarks))
    return StereoPair(*_equally_deep(*images), calibration, stamp_of(left.header),
                      left.header.frame_id)


def stamp_of(header):
    """Return the stamp of a std_msgs/Header in ns."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def read_image(message):
    """
    Return the image of a sensor_msgs/Image or CompressedImage.

    The image is uint8 or uint16, (R, C) or (R, C, 3) BGR, contiguous; it shares the message's
    memory where rows are not padded and nothing has to be converted.
    Raises BadPair for an encoding, step, size or length that cannot be right.
    """
    if hasattr(message, 'format'):
        return _decompressed(message)
    if message.encoding not in ENCODINGS:
        raise BadPair('encoding', f"encoding is '{message.encoding}'; allowed are "
                      f"{', '.join(ENCODINGS)}")
    dtype, channels, conversion = ENCODINGS[message.encoding]
    pixels = _pixels(message, np.dtype(dtype), channels)
    if conversion is None:
        return np.ascontiguousarray(pixels)
    if conversion in ('first', 'second'):
        return np.ascontiguousarray(pixels[:, :, 0 if conversion == 'first' else 1])
    if channels == 1 and min(pixels.shape) < SMALLEST_MOSAIC:
        raise BadPair('size', f'the image is {_size(pixels.shape)}; a Bayer pattern needs '
                      f'at least {_size((SMALLEST_MOSAIC, SMALLEST_MOSAIC))}')
    return cv2.cvtColor(np.ascontiguousarray(pixels), conversion)


def _pixels(message, dtype, channels):
    """Return a view of (R, C) or (R, C, channels) pixels in native byte order, sizes checked."""
    rows, columns, step = int(message.height), int(message.width), int(message.step)
    if rows < 1 or columns < 1:
        raise BadPair('size', f'the image is {columns}x{rows}; it needs at least one pixel')
    if step < columns * channels * dtype.itemsize:
        raise BadPair('size', f'step is {step} bytes, but {columns} pixels of '
                      f'{message.encoding} need {columns * channels * dtype.itemsize}')
    length = memoryview(message.data).nbytes
    if length < step * rows:
        raise BadPair('size', f'data has {length} bytes, but {rows} rows of {step} bytes need '
                      f'{step * rows}')
    stored = dtype.newbyteorder('>' if message.is_bigendian else '<')
    shape, strides = (rows, columns), (step, channels * dtype.itemsize)
    if channels > 1:
        shape, strides = (*shape, channels), (*strides, dtype.itemsize)
    pixels = np.ndarray(shape, stored, buffer=message.data, strides=strides)
    return pixels if stored.isnative else pixels.astype(dtype)


def _decompressed(message):
    try:
        image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_UNCHANGED)
    except (cv2.error, ValueError):
        image = None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise BadPair('encoding', f'{memoryview(message.data).nbytes} bytes of format '
                      f"'{message.format}' hold no image of 8 or 16 bits; allowed are JPEG and "
                      'PNG')
    if image.ndim == 3 and image.shape[2] == 4:
        return cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    return image


def _equally_deep(left, right):
    """Return two images with the same number of bits."""
    if left.dtype != right.dtype:
        left, right = _full_range(left), _full_range(right)
    return left, right


def _full_range(image):
    """Return an image of 8 bits, or of few used bits in 16, spread over the 16."""
    if image.dtype == np.uint8:
        return image.astype(np.uint16) * np.uint16(257)
    used = max(8, int(image.max()).bit_length())
    return image << np.uint16(16 - used)


def _size(shape):
    return f'{shape[1]}x{shape[0]}'
