# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Disparities in files: float32 (R, C), pixels, NaN = invalid, in and out.

| suffix | stored | invalid is stored as | steps and range |
|---|---|---|---|
| .pfm | float32, little endian, rows bottom-up | +inf (as Middlebury does) | all of float32 |
| .npy | float32 | NaN | all of float32 |
| .png | uint16, 256 times the disparity (KITTI) | 0 | 1/256 px, 1/256 to 65535/256 |

A valid disparity is never stored as invalid: in a .png what would round to 0 becomes 1/256 px,
and so does what sub-pixel refinement left below zero, down to -0.5 px. What lies below that or
above 65535/256 px is refused, not bent. When reading, NaN and both infinities are invalid.
"""
from pathlib import Path

import cv2
from fuzzy_stereo_ros.pairs.float_files import encode_numpy, encode_pfm, read_values
from fuzzy_stereo_ros.pairs.whole_files import write_whole
import numpy as np

KITTI_SCALE = 256


def check_disparity_suffix(path):
    """Raise ValueError unless `write_disparity` knows the suffix of the path."""
    if Path(path).suffix.lower() not in _ENCODERS:
        raise ValueError(f"{path} has the suffix '{Path(path).suffix}'; "
                         f'allowed are {", ".join(_ENCODERS)}')


def write_disparity(path, disparity):
    """
    Write disparities in the format of the path's suffix; the file is there as a whole or not.

    disparity: float (R, C), pixels, NaN or infinite = invalid.
    Raises ValueError for a suffix, shape or value that cannot be stored, OSError for the disk.
    """
    check_disparity_suffix(path)
    disparity = np.asarray(disparity)
    if disparity.ndim != 2 or disparity.dtype.kind != 'f':
        raise ValueError(f'disparity is {disparity.dtype} of shape {disparity.shape}; '
                         'allowed is a float array of two dimensions')
    disparity = np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32)
    write_whole(path, _ENCODERS[Path(path).suffix.lower()](disparity))


def read_disparity(path, scale=None):
    """
    Return the disparities of a file: float32 (R, C), pixels, NaN = invalid.

    Reads what `write_disparity` writes, .npz with a single array, and pictures of 8 or 16 bits
    whose grey level 0 is invalid.
    scale: grey levels per pixel of disparity; None is 256 for 16 bits; 8 bits must be told.
    Raises ValueError where the file is missing, damaged, or the scale is needed or not allowed.
    """
    return read_values(path, scale, KITTI_SCALE, 'pixel of disparity', 'pixels', np.isfinite)


def _encode_pfm(disparity):
    return encode_pfm(np.where(np.isnan(disparity), np.inf, disparity))


def _encode_kitti(disparity):
    valid = np.isfinite(disparity)
    top = 65535 / KITTI_SCALE
    outside = disparity[valid & ((disparity < -0.5) | (disparity > top))]
    if outside.size:
        raise ValueError(f'a disparity of {outside[0]:g} px does not fit into a KITTI .png, which '
                         f'holds 0 to {top:.3f} px; take .pfm or .npy')
    levels = np.rint(np.where(valid, disparity, 0).astype(np.float64) * KITTI_SCALE)
    stored = np.where(valid, np.clip(levels, 1, 65535), 0).astype(np.uint16)
    return cv2.imencode('.png', stored)[1].tobytes()


_ENCODERS = {'.pfm': _encode_pfm, '.npy': encode_numpy, '.png': _encode_kitti}
