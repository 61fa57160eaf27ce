# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read and write image files, with a sentence where that fails; headers of JPEG and PNG."""
import json
from pathlib import Path
import struct

import cv2
from fuzzy_stereo_ros.pairs.whole_files import write_whole
import numpy as np

JPEG_START, JPEG_END = b'\xff\xd8\xff', b'\xff\xd9'
PNG_START = b'\x89PNG\r\n\x1a\n'
PNG_SIZE_AT = 16                # bytes, behind the start and the head of the first chunk
# Start of frame, with the size: the markers C0 to CF but for those of tables (C4, C8, CC).
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
JPEG_WITHOUT_LENGTH = frozenset([0x00, 0x01, *range(0xD0, 0xD8)])
JPEG_LAST = 0xD9, 0xDA          # the end, and the scan that is behind the frame's head


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


def size_in_header(content):
    """
    Return (rows, columns) as the header of a JPEG or PNG has them.

    content: bytes, the whole file. None where it is another file, or has no such header.
    """
    if content.startswith(PNG_START):
        if content[12:PNG_SIZE_AT] != b'IHDR' or len(content) < PNG_SIZE_AT + 8:
            return None
        columns, rows = struct.unpack_from('>II', content, PNG_SIZE_AT)
        return rows, columns
    return _jpeg_size(content) if content.startswith(JPEG_START) else None


def is_cut_off(content):
    """
    Return whether bytes are a JPEG that has no end behind its first scan.

    OpenCV 4 makes grey rows of what is missing and tells nobody.
    """
    if not content.startswith(JPEG_START):
        return False
    behind_heads = max((place for _, place in _jpeg_segments(content)), default=0)
    return content.rfind(JPEG_END, behind_heads) < 0


def _jpeg_size(content):
    for marker, place in _jpeg_segments(content):
        if marker in JPEG_FRAMES and place + 7 <= len(content):
            return struct.unpack_from('>HH', content, place + 3)
    return None


def _jpeg_segments(content):
    """Yield (marker, place behind it) of the segments with a length, up to the first scan."""
    place = 2
    while (place := content.find(b'\xff', place)) >= 0:
        while content[place:place + 1] == b'\xff':      # as many as you like before a marker
            place += 1
        marker = content[place] if place < len(content) else JPEG_LAST[0]
        place += 1
        if marker in JPEG_WITHOUT_LENGTH:
            continue
        if marker == JPEG_LAST[0] or place + 2 > len(content):
            return
        yield marker, place
        if marker in JPEG_LAST:
            return
        place += struct.unpack_from('>H', content, place)[0]
