# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Files of images and others: read with a sentence where that fails, written whole or not at all.

And images and disparities in colours of 8 bits, to look at.
"""
import json
import os
from pathlib import Path
import re
import struct

import cv2
import numpy as np

JPEG_START, JPEG_END = b'\xff\xd8\xff', b'\xff\xd9'
PNG_START = b'\x89PNG\r\n\x1a\n'
PNG_HEADER = re.compile(re.escape(PNG_START) + rb'....IHDR(.{8})', re.DOTALL)
# Start of frame, with the size: the markers C0 to CF but for those of tables (C4, C8, CC).
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
JPEG_LAST = 0xD9, 0xDA          # the end, and the scan that is behind the frame's head
JPEG_MARKER = re.compile(rb'\xff[^\x00\x01\xd0-\xd7\xff](?=..)', re.DOTALL)    # with a length
INVALID_GREY = 32       # of pictures, where nothing is known


def read_image(path):
    """
    Return the image of a file as it is stored, an alpha channel left out.

    The image is uint8 or uint16, (R, C) grey or (R, C, 3) BGR.
    Raises ValueError where the file is missing, not an image, or of another depth.
    """
    content = read_bytes(path)
    if is_cut_off(content):
        raise ValueError(f'{path} is cut off: its JPEG has no end')
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:  # an empty file
        image = None
    if image is None:
        raise ValueError(f'{path} is not an image that OpenCV can read (PNG, JPEG, PGM, TIFF, '
                         '...)')
    if image.dtype not in (np.uint8, np.uint16):
        raise ValueError(f'{path} holds {image.dtype} pixels; allowed are 8 and 16 bits')
    return image[:, :, :3] if image.ndim == 3 and image.shape[2] == 4 else image


def read_pair(left_path, right_path):
    """
    Return the left and the right image, each as `read_image` does.

    Raises ValueError where one cannot be read or the two differ in size.
    """
    left, right = read_image(left_path), read_image(right_path)
    if left.shape[:2] != right.shape[:2]:
        sizes = [f'{image.shape[1]}x{image.shape[0]}' for image in (left, right)]
        raise ValueError(f'{left_path} is {sizes[0]} and {right_path} is {sizes[1]}; '
                         'the two images of a pair must have one size')
    return left, right


def write_image(path, image):
    """
    Write an image (R, C) or (R, C, 3) BGR in the format of the path's suffix, whole or not.

    Raises ValueError for a suffix without a format, OSError where it cannot be written.
    """
    check_image_suffix(path)
    written, content = cv2.imencode(Path(path).suffix, image)
    if not written:
        raise ValueError(f'{path}: OpenCV cannot store {image.dtype} {image.shape} so')
    write_whole(path, content.tobytes())


def check_image_suffix(path):
    """Raise ValueError unless OpenCV has an image format for the path's suffix."""
    if not Path(path).suffix or not cv2.haveImageWriter(str(path)):
        raise ValueError(f"{path} has the suffix '{Path(path).suffix}', which is no image "
                         'format; take .png')


def read_bytes(path):
    """Return a file's bytes; raise ValueError with the reason where it cannot be read."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise ValueError(f'{path} cannot be read: {error.strerror}') from None


def read_json(path):
    """Return the content of a JSON file; ValueError where it is missing or damaged."""
    content = read_bytes(path)
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ValueError(f'{path} is damaged: {error}') from error


def check_place(path):
    """Raise ValueError where no file can be written to a path: no folder, or it is one itself."""
    path = Path(path)
    if not path.parent.is_dir():
        raise ValueError(f'{path} cannot be written: there is no folder {path.parent}')
    if path.is_dir():
        raise ValueError(f'{path} is a folder; name a file')


def write_whole(path, content):
    """
    Write bytes to a file: on an error what was there before stays, and nothing is left behind.

    path: str or Path; an existing file is replaced. Raises OSError, which names the file, where
    it cannot be written.
    """
    path = Path(path)
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')
    part.unlink(missing_ok=True)
    try:
        with open(part, 'xb') as file:      # never through a link that somebody else has put there
            file.write(content)
        part.replace(path)
    except OSError as error:
        if error.errno is not None:     # the system names the unfinished file, or none
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        part.unlink(missing_ok=True)


def size_in_header(content):
    """
    Return (rows, columns) as the header of a JPEG or PNG has them.

    content: bytes, the whole file. None where it is another file, or has no such header.
    """
    if content.startswith(PNG_START):
        found = PNG_HEADER.match(content)
        return found and struct.unpack('>II', found[1])[::-1]
    for marker, place in _jpeg_segments(content):
        if marker in JPEG_FRAMES and place + 7 <= len(content):
            return struct.unpack_from('>HH', content, place + 3)
    return None


def is_cut_off(content):
    """
    Return whether bytes are a JPEG that has no end behind its first scan.

    OpenCV 4 makes grey rows of what is missing and tells nobody.
    """
    behind_heads = max((place for _, place in _jpeg_segments(content)), default=0)
    return content.startswith(JPEG_START) and content.rfind(JPEG_END, behind_heads) < 0


def _jpeg_segments(content):
    """Yield (marker, place behind it) of the segments of a JPEG, up to the first scan."""
    place, marker = 2, None
    while content.startswith(JPEG_START) and marker not in JPEG_LAST and (
            found := JPEG_MARKER.search(content, place)):
        marker, place = found[0][-1], found.end()
        yield marker, place
        place += struct.unpack_from('>H', content, place)[0]


def in_eight_bits(image):
    """
    Return an image as uint8 of the same shape; one that is uint8 as it is.

    image: uint8 or uint16, (R, C) or (R, C, 3). 16 bits are divided by the largest value of all
    channels: cameras of 10 and 12 bits fill only a part of the 16.
    """
    if image.dtype == np.uint8:
        return image
    return cv2.convertScaleAbs(image, alpha=255.0 / max(int(image.max()), 1))


def colour_disparity(disparity, low, high):
    """
    Return disparities in the colours of Turbo, far blue and near red: uint8 (R, C, 3) BGR.

    disparity: float (R, C), pixels, NaN or infinite = invalid, which is dark grey.
    low, high: pixels, shown as the ends of the colours; what lies outside takes the end.
    """
    span = max(high - low, 1e-6)
    levels = cv2.convertScaleAbs(np.clip(disparity - low, 0, span), alpha=255 / span)
    picture = cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)
    invalid = ~np.isfinite(disparity)
    return cv2.copyTo(np.full_like(picture, INVALID_GREY), invalid.view(np.uint8), picture)
