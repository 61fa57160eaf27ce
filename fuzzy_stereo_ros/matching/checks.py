# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of a pair of images and its stamp, which kernels rely on."""
import numbers

import numpy as np

FEWEST_ROWS, FEWEST_COLUMNS = 2, 2
MOST_PIXELS = 2**30     # kernels number pixels with 32 bits
MOST_SIDE = 2**16       # kernels number rows and columns at half size with 15 and 16 bits


def checked_pair(left, right, config):
    """Return two images, (R, C) or (R, C, 3) of 8 or 16 bits, contiguous and alike; ValueError."""
    images = []
    for name, image in (('left', left), ('right', right)):
        if not isinstance(image, np.ndarray):
            raise ValueError(f'the {name} image is a {type(image).__name__}; '
                             'give a NumPy array of uint8 or uint16')
        if image.ndim not in (2, 3) or image.ndim == 3 and image.shape[2] not in (1, 3):
            raise ValueError(f'the {name} image has the shape {image.shape}; '
                             'allowed are (rows, columns) and (rows, columns, 3)')
        if image.dtype not in (np.uint8, np.uint16):
            raise ValueError(f'the {name} image is {image.dtype}; allowed are uint8 and uint16')
        images.append(image[..., 0] if image.ndim == 3 and image.shape[2] == 1 else image)
    left, right = images
    if left.shape[:2] != right.shape[:2]:
        raise ValueError(
            f'the left image is {_size(left)}, the right one {_size(right)}; '
            'give two rectified images of one size')
    if left.dtype != right.dtype:
        raise ValueError(f'the left image is {left.dtype}, the right one {right.dtype}; '
                         'give two images of one depth')
    rows, columns = left.shape[:2]
    check_size(rows, columns)
    if config.disparities > columns:
        raise ValueError(
            f'{config.disparities} disparities are more than the {columns} columns of the images; '
            'ask for fewer disparities or give larger images')
    if left.ndim != right.ndim:
        left, right = _grey(left), _grey(right)
    return np.ascontiguousarray(left), np.ascontiguousarray(right)


def check_size(rows, columns):
    """Raise ValueError where images of a size are smaller or larger than kernels can take."""
    if rows < FEWEST_ROWS or columns < FEWEST_COLUMNS:
        raise ValueError(f'the images are {columns} x {rows}; '
                         f'at least {FEWEST_COLUMNS} x {FEWEST_ROWS} pixels are needed')
    if rows * columns > MOST_PIXELS or max(rows, columns) > MOST_SIDE:
        raise ValueError(f'the images are {columns} x {rows}; at most {MOST_PIXELS} pixels, and '
                         f'{MOST_SIDE} a side, are allowed')


def checked_stamp(stamp):
    """Return a stamp as an int, ns, or None as it is; ValueError for what is neither."""
    if stamp is None:
        return None
    if not isinstance(stamp, numbers.Integral):
        raise ValueError(f'the stamp is {stamp!r}; allowed are whole numbers of ns, and None')
    return int(stamp)


def _size(image):
    return f'{image.shape[1]} x {image.shape[0]}'


def _grey(image):
    """Return (B + 2 G + R) / 4 of a colour image, in its own dtype; a grey one as it is."""
    if image.ndim == 2:
        return image
    weighted = image.astype(np.uint32) @ np.array([1, 2, 1], np.uint32)
    return ((weighted + 2) >> 2).astype(image.dtype)
