# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One map of numbers as the bytes of a PFM or NumPy file and back, or from a picture."""
import io
from pathlib import Path
import re

from fuzzy_stereo_ros.pairs.image_files import read_bytes, read_image
import numpy as np


def encode_pfm(values):
    """Return a PFM file, little endian, rows bottom-up, of float32 (R, C) as they are."""
    rows, columns = values.shape
    return f'Pf\n{columns} {rows}\n-1.0\n'.encode() + values[::-1].astype('<f4').tobytes()


def decode_pfm(path, content):
    """
    Return what a PFM file holds: float32 (R, C).

    OpenCV's reader multiplies by the header's scale: not used here.
    path: named in errors. Raises ValueError for three channels and for another or damaged file.
    """
    header = re.match(rb'(P[fF])\s+(\d{1,18})\s+(\d{1,18})\s+(-?[0-9.eE+-]+)\s', content)
    if header is None:
        raise ValueError(f'{path} is not a PFM file: it does not begin with "Pf", width, height '
                         'and scale')
    if header[1] != b'Pf':
        raise ValueError(f'{path} is a PFM file of three channels; one (Pf) is allowed')
    columns, rows = int(header[2]), int(header[3])
    kind = '<f4' if header[4].startswith(b'-') else '>f4'
    if len(content) - header.end() != 4 * rows * columns:
        raise ValueError(f'{path} is damaged: {columns}x{rows} pixels take {4 * rows * columns} '
                         f'bytes, but {len(content) - header.end()} follow the header')
    values = np.frombuffer(content, kind, offset=header.end())
    return values.reshape(rows, columns)[::-1]


def encode_numpy(values):
    """Return a .npy file of an array as it is."""
    stored = io.BytesIO()
    np.save(stored, values, allow_pickle=False)
    return stored.getvalue()


def decode_numpy(path, content):
    """
    Return the one array (R, C) of numbers that a .npy or .npz file holds.

    path: named in errors. Raises ValueError for another or damaged file.
    """
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
                         'allowed are two dimensions of numbers')
    return stored


def read_levels(path, scale, usual, unit):
    """
    Return a picture's grey levels over a scale: float32 (R, C), NaN where the level is 0.

    A picture may be grey in three channels, as those of Middlebury are.
    scale: levels per unit; None is the usual one for 16 bits; 8 bits must be told. unit: in words.
    Raises ValueError for a picture in colour, and where the scale is needed or not allowed.
    """
    levels = read_image(path)
    if levels.ndim == 3:
        if (levels != levels[:, :, :1]).any():
            raise ValueError(f'{path} is a colour picture; grey levels are needed')
        levels = levels[:, :, 0]
    if scale is None and levels.dtype == np.uint8:
        raise ValueError(f'{path} has 8 bits: say how many grey levels one {unit} is')
    if scale is not None and not 0 < scale < np.inf:
        raise ValueError(f'scale is {scale}; allowed are numbers above 0')
    values = (levels / (scale or usual)).astype(np.float32)
    values[levels == 0] = np.nan
    return values


def read_values(path, scale, usual, unit, units, valid):
    """
    Return the values of a .pfm, .npy, .npz or picture: float32 (R, C), NaN where there is none.

    scale, usual, unit: as of `read_levels`; other files hold units, in words, and take no scale.
    valid(values): which values of such a file are some.
    Raises ValueError where the file is missing, damaged, or the scale is needed or not allowed.
    """
    decode = {'.pfm': decode_pfm, '.npy': decode_numpy, '.npz': decode_numpy}.get(
        Path(path).suffix.lower())
    if decode is None:
        return read_levels(path, scale, usual, unit)
    if scale is not None:
        raise ValueError(f'{path} holds {units} already; a scale is for pictures')
    values = decode(path, read_bytes(path)).astype(np.float32)
    values[~valid(values)] = np.nan
    return values
