# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""PNG files small enough for a page of many: reduced, and drawings with a palette."""
import base64
import struct
import zlib

import cv2
import numpy as np

WIDTH = 400         # px, of the widest picture
COLOURS = 256       # of a palette


def photograph(image):
    """Return an image uint8, (R, C) or (R, C, 3) BGR, as the data URI of a reduced PNG file."""
    size = _reduced_size(image)
    if size != image.shape[1::-1]:
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return _as_uri(cv2.imencode('.png', image, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes())


def drawing(image):
    """
    Return an image uint8 (R, C, 3) BGR of few colours as the data URI of a reduced PNG file.

    Pixels are left out, not averaged, so that no colour is there that means nothing.
    Raises ValueError for more than COLOURS colours.
    """
    image = cv2.resize(image, _reduced_size(image), interpolation=cv2.INTER_NEAREST)
    return _as_uri(indexed_png(image))


def indexed_png(image):
    """
    Return an image uint8 (R, C, 3) BGR as a PNG file with a palette, which OpenCV does not write.

    Raises ValueError for more than COLOURS colours.
    """
    packed = image.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)
    colours, places = np.unique(packed, return_inverse=True)
    if colours.size > COLOURS:
        raise ValueError(f'the image has {colours.size} colours; a palette holds {COLOURS}')
    rows, columns = image.shape[:2]
    palette = np.stack([colours >> 16 & 255, colours >> 8 & 255, colours & 255], axis=1)
    lines = np.zeros((rows, columns + 1), np.uint8)     # each begins with its filter: none
    lines[:, 1:] = places.reshape(rows, columns)
    return b'\x89PNG\r\n\x1a\n' + b''.join((
        _chunk(b'IHDR', struct.pack('>IIBBBBB', columns, rows, 8, 3, 0, 0, 0)),
        _chunk(b'PLTE', palette.astype(np.uint8).tobytes()),
        _chunk(b'IDAT', zlib.compress(lines.tobytes(), 9)),
        _chunk(b'IEND', b'')))


def _chunk(kind, content):
    return struct.pack('>I', len(content)) + kind + content + struct.pack(
        '>I', zlib.crc32(kind + content))


def _reduced_size(image):
    """Return columns and rows of an image that is reduced to the width of the page."""
    rows, columns = image.shape[:2]
    width = min(columns, WIDTH)
    return width, max(1, round(rows * width / columns))


def _as_uri(content):
    return 'data:image/png;base64,' + base64.b64encode(content).decode()
