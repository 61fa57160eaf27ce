# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read and write image files, with a sentence where that fails."""
from pathlib import Path

import cv2
from fuzzy_stereo_ros.pairs.image_headers import is_cut_off
from fuzzy_stereo_ros.pairs.whole_files import write_whole
import numpy as np


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
