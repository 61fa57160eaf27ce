# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read image files, write files completely or not at all, and convert images to 8 bits.

Errors are one sentence that names the file.
"""
from contextlib import suppress
import json
import os
from pathlib import Path
import re
import shutil
import struct

import cv2
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

JPEG_START, JPEG_END = b'\xff\xd8\xff', b'\xff\xd9'
PNG_START = b'\x89PNG\r\n\x1a\n'
PNG_HEADER = re.compile(re.escape(PNG_START) + rb'....IHDR(.{8})', re.DOTALL)
# Start-of-frame markers, whose segments have the size: C0 to CF without C4, C8 and CC.
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
JPEG_LAST = 0xD9, 0xDA          # end of image, start of scan: no segment follows with a length
JPEG_MARKER = re.compile(rb'\xff[^\x00\x01\xd0-\xd7\xff](?=..)', re.DOTALL)    # with a length
# A TIFF or BigTIFF of either byte order up to its orientation, which OpenCV obeys there alone.
TIFF_TO_ORIENTATION = re.compile(
    rb'\A(II[*+]\0.*?\x12\x01\x03\0\x01\0{3}(?:\0{4})?|'
    rb'MM\0[*+].*?\x01\x12\0\x03(?:\0{4})?\0{3}\x01\0)[\x02-\x08]', re.DOTALL)


def read_image(path):
    """
    Return the image of a file as it is stored, without alpha channel, whatever its orientation.

    The image is uint8 or uint16, (R, C) grey or (R, C, 3) BGR.
    Raises ValueError if the file is missing, not an image, or of another depth.
    """
    content = read_bytes(path)
    if is_cut_off(content):
        raise ValueError(f'{path} is cut off: its JPEG has no end marker')
    content = TIFF_TO_ORIENTATION.sub(rb'\g<1>' + b'\x01', content)
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
    """Return two images, each as `read_image`; ValueError, too, if they differ in size."""
    left, right = read_image(left_path), read_image(right_path)
    if left.shape[:2] != right.shape[:2]:
        raise ValueError(f'{left_path} is {width_by_height(left)} and {right_path} is '
                         f'{width_by_height(right)}; the two images of a pair must have one size')
    return left, right


def write_image(path, image):
    """Write an image, (R, C) or (R, C, 3) BGR, by the path's suffix, as `write_whole`."""
    check_image_suffix(path)
    written, content = cv2.imencode(Path(path).suffix, image)
    if not written:
        raise ValueError(f'{path}: OpenCV cannot store {image.dtype} {image.shape} in this format')
    write_whole(path, content.tobytes())


def check_image_suffix(path):
    """Raise ValueError unless OpenCV has an image format for the path's suffix."""
    if not Path(path).suffix or not cv2.haveImageWriter(str(path)):
        raise ValueError(f"{path} has the suffix '{Path(path).suffix}', which is no image "
                         'format; take .png')


def read_bytes(path):
    """Return a file's bytes; ValueError with the reason if it cannot be read."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise ValueError(f'{path} cannot be read: {error.strerror}') from None


def read_json(path):
    """Return the content of a JSON file; ValueError if it is missing or damaged."""
    content = read_bytes(path)
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ValueError(f'{path} is damaged: {error}') from error


def check_suffix(path, allowed, others=''):
    """Raise ValueError unless a path has an allowed suffix; others: the end of the sentence."""
    suffix = Path(path).suffix
    if suffix.lower() not in allowed:
        raise ValueError(f"{path} has the suffix '{suffix}'; allowed are "
                         f"{', '.join(allowed)}{others}")


def check_place(path):
    """Raise ValueError if a path is a folder, or lies where there is none that can be written."""
    path = Path(path)
    if not path.parent.is_dir():
        raise ValueError(f'{path} cannot be written: there is no folder {path.parent}')
    if not os.access(path.parent, os.W_OK):
        raise ValueError(f'{path} cannot be written: {path.parent.resolve()} is read-only')
    if path.is_dir():
        raise ValueError(f'{path} is a folder; name a file')


def write_whole(path, content):
    """Write bytes to a file completely, or leave what was there; OSError, which names it."""
    path = Path(path)
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')
    try:
        part.unlink(missing_ok=True)
        with open(part, 'xb') as file:      # x: never follow a link that someone else put there
            file.write(content)
        part.replace(path)
    except OSError as error:
        if error.errno is not None:     # the system names the part, or no file
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def remove(path):
    """Remove a file, a folder with all in it, or a link but not what it leads to, if there is."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def size_in_header(content):
    """Return the (rows, columns) in the header of a whole JPEG or PNG, None for other bytes."""
    if content.startswith(PNG_START):
        found = PNG_HEADER.match(content)
        return found and struct.unpack('>II', found[1])[::-1]
    for marker, start in _jpeg_segments(content):
        if marker in JPEG_FRAMES and start + 7 <= len(content):
            return struct.unpack_from('>HH', content, start + 3)
    return None


def is_cut_off(content):
    """Return whether a JPEG lacks its end marker: OpenCV 4 makes the missing rows grey."""
    last_segment = max((start for _, start in _jpeg_segments(content)), default=0)
    return content.startswith(JPEG_START) and content.rfind(JPEG_END, last_segment) < 0


def _jpeg_segments(content):
    """Yield (marker, index after it) of the segments of a JPEG, up to the first scan."""
    start, marker = 2, None
    while content.startswith(JPEG_START) and marker not in JPEG_LAST and (
            found := JPEG_MARKER.search(content, start)):
        marker, start = found[0][-1], found.end()
        yield marker, start
        start += struct.unpack_from('>H', content, start)[0]


def in_eight_bits(image):
    """
    Return an image as uint8 of the same shape; a uint8 image is returned as it is.

    image: uint8 or uint16, (R, C) or (R, C, 3). The largest value of a uint16 image becomes 255,
    as cameras of 10 and 12 bits use only a part of the 16.
    """
    if image.dtype == np.uint8:
        return image
    return cv2.convertScaleAbs(image, alpha=255.0 / max(int(image.max()), 1))
