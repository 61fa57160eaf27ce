# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read images from messages and write them into messages, without importing ROS.

A message is any object with the fields of its ROS type: one of rclpy, or one read from a bag.
"""
from array import array
from contextlib import suppress

import cv2
from fuzzy_stereo_ros.pairs.image_files import is_cut_off, size_in_header
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, width_by_height
import numpy as np

# Encoding: dtype and channels of a pixel; OpenCV's code for the conversion to BGR, or which of the
# channels is the luma. OpenCV names a Bayer pattern after its second row and column, ROS after its
# first.
ENCODINGS = {
    **{name.format(8 * np.dtype(kind).itemsize): (kind, channels, conversion)
       for kind in (np.uint8, np.uint16) for name, channels, conversion in (
           ('mono{}', 1, None), ('{}UC1', 1, None), ('bgr{}', 3, None), ('{}UC3', 3, None),
           ('rgb{}', 3, cv2.COLOR_RGB2BGR), ('bgra{}', 4, cv2.COLOR_BGRA2BGR),
           ('{}UC4', 4, cv2.COLOR_BGRA2BGR), ('rgba{}', 4, cv2.COLOR_RGBA2BGR),
           ('bayer_rggb{}', 1, cv2.COLOR_BayerBG2BGR), ('bayer_bggr{}', 1, cv2.COLOR_BayerRG2BGR),
           ('bayer_gbrg{}', 1, cv2.COLOR_BayerGR2BGR), ('bayer_grbg{}', 1, cv2.COLOR_BayerGB2BGR)
       )},
    **dict.fromkeys(('yuv422', 'uyvy'), (np.uint8, 2, 'second')),
    **dict.fromkeys(('yuv422_yuy2', 'yuyv'), (np.uint8, 2, 'first')),
    **dict.fromkeys(('nv12', 'nv21', 'nv24'), (np.uint8, 1, None)),
}
SEMI_PLANAR = ('nv12', 'nv21', 'nv24')      # the luma plane comes first; height is its own
WRITTEN_ENCODINGS = {(2, 1): 'mono8', (2, 2): 'mono16', (3, 1): 'bgr8', (3, 2): 'bgr16'}
SMALLEST_MOSAIC = 4     # px; OpenCV cannot demosaic a smaller Bayer pattern
MOST_PIXELS = 2**26     # of a compressed image: 67 million, 8192 x 8192
PIXELS_PER_BYTE = 10000     # a byte of a PNG holds at most 8256, one of a JPEG less than 500
QUOTED = 60     # characters of a message's texts that an error quotes


def stamp_of(header):
    """Return the stamp of a std_msgs/Header in ns."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def set_stamp(header, stamp):
    """Set the stamp of a std_msgs/Header, ns."""
    header.stamp.sec, header.stamp.nanosec = divmod(stamp, 1_000_000_000)


def fill_header(header, pair):
    """Give a std_msgs/Header the stamp and the frame of a StereoPair."""
    set_stamp(header, pair.stamp)
    header.frame_id = pair.frame_id


def encoding_of(image):
    """Return the ROS encoding of an image, uint8 or uint16, (R, C) or (R, C, 3) BGR."""
    return WRITTEN_ENCODINGS[image.ndim, image.itemsize]


def fill_pixels(message, image, encoding):
    """Fill and return a sensor_msgs/Image without its header; image: of the encoding's dtype."""
    image = np.ascontiguousarray(image, image.dtype.newbyteorder('<'))
    message.height, message.width = image.shape[:2]
    message.encoding, message.is_bigendian = encoding, 0
    message.step = image[0].nbytes      # the stride of a single row may be any number
    # rclpy takes an array.array('B') as it is, and checks anything else byte by byte.
    data = array('B')
    data.frombytes(memoryview(image).cast('B'))
    message.data = data
    return message


def fill_camera(message, camera):
    """Fill and return an empty CameraInfo without its header; camera: a `Camera`, not binned."""
    message.height, message.width = camera.height, camera.width
    message.distortion_model, message.d = camera.distortion_model, array('d', camera.d)
    message.k, message.r, message.p = (np.array(getattr(camera, name)) for name in 'krp')
    return message


def read_image(message):
    """
    Return the image of a sensor_msgs/Image or CompressedImage, or of a Frame of a file.

    The image is uint8 or uint16, (R, C) or (R, C, 3) BGR, contiguous; it shares the message's
    memory if its rows are not padded and need no conversion.
    Raises BadPair for an encoding, step, size or length that is not allowed.
    """
    if hasattr(message, 'read'):
        return np.ascontiguousarray(message.read())
    if hasattr(message, 'format'):
        return _decompressed(message)
    dtype, channels, conversion = _format_of(message.encoding)
    pixels = _pixels(message, np.dtype(dtype), channels)
    if conversion is None:
        return np.ascontiguousarray(pixels)
    if conversion in ('first', 'second'):
        return np.ascontiguousarray(pixels[:, :, 0 if conversion == 'first' else 1])
    if channels == 1:
        return _demosaiced(pixels, conversion)
    return cv2.cvtColor(np.ascontiguousarray(pixels), conversion)


def _format_of(encoding):
    if encoding not in ENCODINGS:
        raise BadPair('encoding', f'encoding is {encoding!r:.{QUOTED}}; allowed are '
                      f"{', '.join(ENCODINGS)}")
    return ENCODINGS[encoding]


def _demosaiced(mosaic, conversion):
    if min(mosaic.shape) < SMALLEST_MOSAIC:
        raise BadPair('size', f'the image is {width_by_height(mosaic)}; a Bayer pattern needs '
                      f'at least {SMALLEST_MOSAIC}x{SMALLEST_MOSAIC}')
    return cv2.cvtColor(np.ascontiguousarray(mosaic), conversion)


def _pixels(message, dtype, channels):
    """Return (R, C) or (R, C, channels) pixels in native byte order; BadPair for wrong sizes."""
    rows, columns, step = int(message.height), int(message.width), int(message.step)
    if rows < 1 or columns < 1:
        raise BadPair('size', f'the image is {columns}x{rows}; it needs at least one pixel')
    if step < columns * channels * dtype.itemsize:
        raise BadPair('size', f'step is {step} bytes, but {columns} pixels of '
                      f'{message.encoding} need {columns * channels * dtype.itemsize}')
    length = memoryview(message.data).nbytes
    if message.encoding in SEMI_PLANAR and step == 2 * columns and length == step * rows:
        # sensor_msgs of Jazzy counts two channels here, but the rows are one width apart.
        step = columns
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
    """
    Return the image of a CompressedImage.

    Its format names the file's format; compressed_image_transport puts the encoding of the
    original before it: `bayer_rggb8; jpeg compressed` is a grey file with a Bayer pattern.
    """
    content = memoryview(message.data).tobytes()
    image = _decoded(content)
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise BadPair('encoding', f'{len(content)} bytes of format {message.format!r:.{QUOTED}} '
                      'hold no image of 8 or 16 bits; allowed are JPEG and PNG')
    encoding, _, file_format = message.format.partition(';')
    if image.ndim == 2:
        if encoding.startswith('bayer_'):
            return _demosaiced(image, _format_of(encoding)[2])
        return image
    if image.shape[2] == 4:
        return cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    if 'compressed rgb' in file_format:
        return cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    return image


def _decoded(content):
    """
    Return the image of a JPEG or PNG as it is stored, None if the bytes hold no such image.

    The header is checked before OpenCV reads the bytes: OpenCV decodes other formats, too, whose
    code untrusted data should not reach, and allocates what a header claims before it sees that
    the pixels are missing.
    """
    size = size_in_header(content)
    if size is None:
        return None
    rows, columns = size
    most = min(MOST_PIXELS, PIXELS_PER_BYTE * len(content))
    if rows * columns > most:
        raise BadPair('size', f'the compressed image is {columns}x{rows} by its header; '
                      f'{len(content)} bytes may hold {most} pixels: send smaller or whole images')
    if is_cut_off(content):
        raise BadPair('damaged message', f'the compressed image is cut off: the {len(content)} '
                      'bytes of its JPEG have no end marker; send whole images')
    with suppress(cv2.error):
        return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    return None
