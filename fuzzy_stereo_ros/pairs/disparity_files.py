# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read and write files of disparities, depth and points.

Disparities: float32 (R, C), pixels, NaN = invalid.

| suffix | stored | invalid is stored as | steps and range |
|---|---|---|---|
| .pfm | float32, little endian, rows bottom-up | +inf (as Middlebury does) | all of float32 |
| .npy | float32 | NaN | all of float32 |
| .png | uint16, 256 times the disparity (KITTI) | 0 | 1/256 px, 1/256 to 65535/256 |

A valid disparity is never stored as invalid: in a .png disparities from -0.5 px (sub-pixel
refinement goes a little below 0) to 1/256 px are stored as 1/256 px. Disparities below -0.5 px or
above 65535/256 px are an error. When reading, NaN and both infinities are invalid.

Depth: float32 (R, C), metres, NaN = invalid, infinite = too far.

| suffix | stored | invalid, infinite |
|---|---|---|
| .pfm, .npy | float32, metres | NaN, +inf |
| .png | uint16, millimetres | 0, also for depth beyond 65.535 m |
| .ply (points) | x right, y down, z forward, metres, and colours | left out |
"""
import io
from pathlib import Path
import re

import cv2
from fuzzy_stereo_ros.pairs.calibration import millimetres_of
from fuzzy_stereo_ros.pairs.image_files import (
    check_suffix, in_eight_bits, read_bytes, read_image, write_whole)
import numpy as np

KITTI_SCALE = 256
POINT_SUFFIX = '.ply'
MILLIMETRES = 1000      # in a metre
MOST_UNPACKED = 2**28   # bytes of an array that is compressed: 8192 x 8192 of float32
COLOURS = 'blue', 'green', 'red'    # channels of images
_PLY_TYPES = {'f4': 'float', 'u1': 'uchar'}


def encode_pfm(values):
    """Return the bytes of a PFM file, little endian, rows bottom-up, of float32 (R, C)."""
    rows, columns = values.shape
    return f'Pf\n{columns} {rows}\n-1.0\n'.encode() + values[::-1].astype('<f4').tobytes()


def decode_pfm(path, content):
    """Return the values of a PFM, float32 (R, C), without its scale; ValueError names the path."""
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
    """Return the bytes of a .npy file of an array."""
    stored = io.BytesIO()
    np.save(stored, values, allow_pickle=False)
    return stored.getvalue()


def decode_numpy(path, content):
    """Return the only array, numbers (R, C), of a .npy or .npz; ValueError names the path."""
    try:
        stored = np.load(io.BytesIO(content), allow_pickle=False)
        if not isinstance(stored, np.ndarray):
            if len(stored.files) != 1:
                raise ValueError(f'it holds {len(stored.files)} arrays, one is allowed')
            if (size := stored.zip.infolist()[0].file_size) > max(len(content), MOST_UNPACKED):
                raise ValueError(f'its array is compressed and takes {size} bytes, of which at '
                                 f'most {MOST_UNPACKED} are unpacked; save it by np.savez')
            stored = stored[stored.files[0]]
    except Exception as error:  # numpy raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(f'{path} is not a NumPy file with one array: {error}') from None
    if stored.ndim != 2 or stored.dtype.kind not in 'fiu':
        raise ValueError(f'{path} holds {stored.dtype} of shape {stored.shape}; '
                         'allowed are two dimensions of numbers')
    return stored


def _read(path, scale, usual, unit):
    """
    Return the values of a file: float32 (R, C); of images grey levels by scale, NaN for 0.

    An image may have three equal channels, as those of Middlebury do. scale: None for usual, the
    scale of 16-bit images. unit: of the values, for errors.
    """
    decode = {'.pfm': decode_pfm, '.npy': decode_numpy, '.npz': decode_numpy}.get(
        Path(path).suffix.lower())
    if decode is not None:
        if scale is not None:
            raise ValueError(f'{path} holds values already; a scale is for images')
        values = decode(path, read_bytes(path)).astype(np.float32)
        if not values.size:
            raise ValueError(f'{path} holds no pixels')
        return values
    levels = read_image(path)
    if levels.ndim == 3:
        if (levels != levels[:, :, :1]).any():
            raise ValueError(f'{path} is a colour image; grey levels are needed')
        levels = levels[:, :, 0]
    if scale is None and levels.dtype == np.uint8:
        raise ValueError(f'{path} has 8 bits: give the scale, the grey levels of one {unit}')
    if scale is not None and not 0 < scale < np.inf:
        raise ValueError(f'scale is {scale}; allowed are numbers above 0')
    values = (levels / (scale or usual)).astype(np.float32)
    values[levels == 0] = np.nan
    return values


def read_disparity(path, scale=None):
    """
    Return the disparities of a file: float32 (R, C), pixels, NaN = invalid.

    Reads what `write_disparity` writes, .npz with one array, and images of 8 or 16 bits, 0 =
    invalid. scale: grey levels per pixel; None = 256, of 16 bits only. Raises ValueError if the
    file is missing or damaged, or the scale is needed or not allowed.
    """
    disparity = _read(path, scale, KITTI_SCALE, 'pixel of disparity')
    disparity[~np.isfinite(disparity)] = np.nan
    return disparity


def read_depth(path, scale=None):
    """Return depth, m, as `read_disparity`: infinite = too far, NaN = invalid, as 0 and less."""
    depth = _read(path, scale, MILLIMETRES, 'metre')
    depth[~(depth > 0)] = np.nan
    return depth


def write_disparity(path, disparity):
    """Write disparities (R, C), px, NaN = invalid, by the suffix; ValueError if too far."""
    encode = _encoder(path)[0]
    disparity = np.asarray(disparity, np.float32)
    write_whole(path, encode(np.where(np.isfinite(disparity), disparity, np.float32(np.nan))))


def write_depth(path, depth):
    """Write depth, float32 (R, C), metres, as `write_disparity`."""
    write_whole(path, _encoder(path)[1](depth))


def write_confidence(path, confidence):
    """Write confidence, float32 (R, C), 0 to 1, as `write_disparity`; in a .png 1 is 255."""
    write_whole(path, _encoder(path)[2](confidence))


def check_map_suffix(path, others=''):
    """Raise ValueError unless a map can have the path's suffix; others: end of the sentence."""
    check_suffix(path, _ENCODERS, others)


def _encoder(path):
    check_map_suffix(path)
    return _ENCODERS[Path(path).suffix.lower()]


def _encode_kitti(disparity):
    valid = np.isfinite(disparity)
    top = 65535 / KITTI_SCALE
    outside = disparity[valid & ((disparity < -0.5) | (disparity > top))]
    if outside.size:
        raise ValueError(f'a disparity of {outside[0]:g} px does not fit into a KITTI .png, which '
                         f'holds 0 to {top:.3f} px; use .pfm or .npy')
    levels = np.rint(np.where(valid, disparity, 0).astype(np.float64) * KITTI_SCALE)
    return _encode_png(np.where(valid, np.clip(levels, 1, 65535), 0).astype(np.uint16))


def _encode_png(levels):
    return cv2.imencode('.png', levels)[1].tobytes()


# Encoders of disparities, of depth and of confidence, by suffix.
_ENCODERS = {
    '.pfm': (lambda disparity: encode_pfm(np.where(np.isnan(disparity), np.inf, disparity)),
             encode_pfm, encode_pfm),
    '.npy': (encode_numpy, encode_numpy, encode_numpy),
    '.png': (_encode_kitti, lambda depth: _encode_png(millimetres_of(depth)),
             lambda confidence: _encode_png(np.rint(255 * confidence).astype(np.uint8)))}


def write_point_file(path, depth, left, image=None, farthest=np.inf):
    """
    Write the points of all pixels with finite depth as binary PLY.

    depth: float32 (R, C), metres. left: Projection of the left camera. image: for the colours,
    uint8 or uint16, (R, C) or (R, C, 3) BGR. farthest: m, points beyond are left out. Raises
    OSError if it cannot be written.
    """
    finite = np.isfinite(depth) & (depth <= farthest)
    positions = left.points(depth)
    kinds = dict.fromkeys('xyz', 'f4')
    if image is not None:
        kinds.update(dict.fromkeys(reversed(COLOURS), 'u1'))
    points = np.empty(np.count_nonzero(finite),
                      [(name, f'<{kind}') for name, kind in kinds.items()])
    for axis, name in enumerate('xyz'):
        points[name] = positions[finite, axis]
    if image is not None:
        image = in_eight_bits(image)
        for channel, name in enumerate(COLOURS):
            points[name] = (image if image.ndim == 2 else image[:, :, channel])[finite]
    header = ['ply', 'format binary_little_endian 1.0',
              'comment left optical frame: x right, y down, z forward, metres',
              f'element vertex {len(points)}',
              *(f'property {_PLY_TYPES[kind]} {name}' for name, kind in kinds.items()),
              'end_header']
    write_whole(path, ('\n'.join(header) + '\n').encode() + points.tobytes())
