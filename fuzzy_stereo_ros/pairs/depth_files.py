# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Depth and points in files. Depth: float32 (R, C), metres, NaN = invalid, infinite = too far.

| suffix | stored | invalid, too far |
|---|---|---|
| .pfm, .npy | float32, metres | NaN, +inf |
| .png | uint16, millimetres | 0, as are those beyond 65.535 m |
| .ply | a point for each other pixel: x right, y down, z forward, metres, and colours | left out |
"""
from pathlib import Path

import cv2
from fuzzy_stereo_ros.pairs.brightness import in_eight_bits
from fuzzy_stereo_ros.pairs.float_files import encode_numpy, encode_pfm, read_values
from fuzzy_stereo_ros.pairs.metres import millimetres_of, write_points
from fuzzy_stereo_ros.pairs.whole_files import write_whole
import numpy as np

MILLIMETRES = 1000      # in a metre
COLOURS = 'blue', 'green', 'red'    # the order that images have here
_PLY_TYPES = {'f4': 'float', 'u1': 'uchar'}


def read_depth(path, scale=None):
    """
    Return the depth of a file: float32 (R, C), metres, NaN = invalid, infinite = too far.

    Reads .pfm, .npy, .npz with a single array, and pictures; what is not above 0 is invalid.
    scale: grey levels per metre; None is 1000 for 16 bits; 8 bits must be told.
    Raises ValueError where the file is missing, damaged, or the scale is needed or not allowed.
    """
    return read_values(path, scale, MILLIMETRES, 'metre', 'metres', lambda depth: depth > 0)


def write_depth(path, depth):
    """
    Write depth in the format of the path's suffix; the file is there as a whole or not.

    depth: float32 (R, C), metres. Raises ValueError for a suffix, OSError for the disk.
    """
    check_depth_suffix(path)
    write_whole(path, _ENCODERS[Path(path).suffix.lower()](depth))


def check_depth_suffix(path):
    """Raise ValueError unless `write_depth` knows the suffix of the path."""
    if Path(path).suffix.lower() not in _ENCODERS:
        raise ValueError(f"{path} has the suffix '{Path(path).suffix}'; "
                         f"allowed for depth are {', '.join(_ENCODERS)}")


def write_point_file(path, depth, left, image=None):
    """
    Write the points of all pixels whose depth is finite as binary PLY; return how many.

    depth: float32 (R, C), metres. left: Projection of the left camera. image: for the colours,
    uint8 or uint16, (R, C) or (R, C, 3) BGR. Raises OSError where it cannot be written.
    """
    seen = np.isfinite(depth)
    places = np.empty((*depth.shape, 3), np.float32)
    write_points(depth, left, places)
    names = dict.fromkeys('xyz', 'f4')
    if image is not None:
        names.update((name, 'u1') for name in reversed(COLOURS))
    points = np.empty(np.count_nonzero(seen), [(name, f'<{kind}') for name, kind in names.items()])
    for channel, name in enumerate('xyz'):
        points[name] = places[seen, channel]
    if image is not None:
        image = in_eight_bits(image)
        for channel, name in enumerate(COLOURS):
            points[name] = (image if image.ndim == 2 else image[:, :, channel])[seen]
    header = ['ply', 'format binary_little_endian 1.0',
              'comment left optical frame: x right, y down, z forward, metres',
              f'element vertex {len(points)}',
              *(f'property {_PLY_TYPES[kind]} {name}' for name, kind in names.items()),
              'end_header']
    write_whole(path, ('\n'.join(header) + '\n').encode() + points.tobytes())
    return len(points)


def _encode_millimetres(depth):
    return cv2.imencode('.png', millimetres_of(depth))[1].tobytes()


_ENCODERS = {'.pfm': encode_pfm, '.npy': encode_numpy, '.png': _encode_millimetres}
