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
import io
from pathlib import Path
import re

import cv2
from fuzzy_stereo_ros.pairs.image_files import read_bytes, read_image
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
    decode = {'.pfm': _decode_pfm, '.npy': _decode_numpy, '.npz': _decode_numpy}.get(
        Path(path).suffix.lower())
    if decode is None:
        return _read_grey_levels(path, scale)
    if scale is not None:
        raise ValueError(f'{path} holds pixels already; a scale is for pictures')
    disparity = decode(path, read_bytes(path)).astype(np.float32)
    disparity[~np.isfinite(disparity)] = np.nan
    return disparity


def _encode_pfm(disparity):
    rows, columns = disparity.shape
    stored = np.where(np.isnan(disparity), np.inf, disparity)[::-1].astype('<f4')
    return f'Pf\n{columns} {rows}\n-1.0\n'.encode() + stored.tobytes()


def _decode_pfm(path, content):
    """Return float32 (R, C). OpenCV's reader multiplies by the header's scale: not used here."""
    header = re.match(rb'(P[fF])\s+(\d+)\s+(\d+)\s+(-?[0-9.eE+-]+)\s', content)
    if header is None:
        raise ValueError(f'{path} is not a PFM file: it does not begin with "Pf", width, height '
                         'and scale')
    if header[1] != b'Pf':
        raise ValueError(f'{path} is a PFM file of three channels; disparity has one (Pf)')
    columns, rows = int(header[2]), int(header[3])
    kind = '<f4' if header[4].startswith(b'-') else '>f4'
    if len(content) - header.end() != 4 * rows * columns:
        raise ValueError(f'{path} is damaged: {columns}x{rows} pixels take {4 * rows * columns} '
                         f'bytes, but {len(content) - header.end()} follow the header')
    values = np.frombuffer(content, kind, offset=header.end())
    return values.reshape(rows, columns)[::-1]


def _encode_numpy(disparity):
    stored = io.BytesIO()
    np.save(stored, disparity, allow_pickle=False)
    return stored.getvalue()


def _decode_numpy(path, content):
    try:
        stored = np.load(io.BytesIO(content), allow_pickle=False)
        if not isinstance(stored, np.ndarray):
            if len(stored.files) != 1:
                raise ValueError(f'it holds {len(stored.files)} arrays, one is allowed')
            stored = stored[stored.files[0]]
    except Exception as error:  # numpy raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(f'{path} is not a NumPy file with one array: {error}') from None
    if stored.ndim != 2 or stored.dtype.kind not in 'fiu':
        raise ValueError(f'{path} holds {stored.dtype} of shape {stored.shape}; '
                         'disparity has two dimensions of numbers')
    return stored


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


def _read_grey_levels(path, scale):
    levels = read_image(path)
    if levels.ndim != 2:
        raise ValueError(f'{path} is a colour picture; disparity is stored in grey levels')
    if scale is None and levels.dtype == np.uint8:
        raise ValueError(f'{path} has 8 bits: say how many grey levels one pixel of disparity is')
    if scale is not None and not 0 < scale < np.inf:
        raise ValueError(f'scale is {scale}; allowed are numbers above 0')
    disparity = (levels / (scale or KITTI_SCALE)).astype(np.float32)
    disparity[levels == 0] = np.nan
    return disparity


_ENCODERS = {'.pfm': _encode_pfm, '.npy': _encode_numpy, '.png': _encode_kitti}
