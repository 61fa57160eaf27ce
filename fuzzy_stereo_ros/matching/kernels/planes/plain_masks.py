# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where a half-size view is plain.

A mask is written in blocks of LANES columns, so that kernels can pass over what has no marked
pixel.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.simd import equal_bits, LANES, load, splat
import numpy as np

NONE = np.uint32(0xFFFFFFFF)     # the bits of lanes equal to 0 where no lane of a mask is set


class PlainMask(NamedTuple):
    """Where a half-size view is plain."""

    mask: np.ndarray         # uint8 (r, c + LANES)
    ends: np.ndarray         # int32 (r, 2), begin of the first and end of the last block of LANES
    #                          columns in which a pixel of the row is marked


@kernel(allocates=True)
def plain_mask(luminance, columns, burnt, limit, plain, first, last):
    """
    Mark the half-size pixels all of whose 3 x 3 pixels have small steps and are not burnt out.

    A step is that of the smoothed picture in the direction of the largest, 1/64 grey level a px.
    luminance: uint16, with a margin; burnt: luminance from which a pixel is burnt out; limit: of
    steps; plain: the fields of PlainMask, written; first, last: rows
    """
    mask, ends = plain
    wide = columns + 2 * MARGIN
    smooth, slope = np.empty(wide, np.int32), np.empty(wide, np.int32)
    steps, flat = np.empty(columns, np.uint16), np.ones((3, columns + 2), np.uint8)
    for row in range(first - 1, last + 1):
        flags = flat[row % 3, 1:]
        if row < 0 or row >= len(mask):
            flags[:columns] = 1
        else:
            a, b, c, d, e = (luminance[row], luminance[row + 1], luminance[row + 2],
                             luminance[row + 3], luminance[row + 4])
            for column in range(wide):
                smooth[column] = (np.int32(a[column]) + e[column] + 6 * np.int32(c[column])
                                  + 4 * (np.int32(b[column]) + d[column]))
            for column in range(wide):      # apart: LLVM compares few arrays in a loop
                slope[column] = (np.int32(e[column]) - a[column]
                                 + 2 * (np.int32(d[column]) - b[column]))
            for column in range(columns):
                across = (smooth[column + 4] - smooth[column]
                          + 2 * (smooth[column + 3] - smooth[column + 1]))
                down = (slope[column] + slope[column + 4] + 6 * slope[column + 2]
                        + 4 * (slope[column + 1] + slope[column + 3]))
                step = min(max(abs(across), abs(down)) >> 9, 65535)
                steps[column] = 65535 if c[column + MARGIN] >= burnt else step
            for column in range(columns):
                flags[column] = steps[column] < limit
        if row > first:
            _mark_row(flat[0], flat[1], flat[2], mask, row - 1, columns, ends)


@inlined
def _mark_row(one, two, three, mask, row, columns, ends):
    """Mark where all of 3 x 3 flags are set; write the ends of what is marked."""
    line, flags, start = mask[row], mask.reshape(-1), row * mask.shape[1]
    for column in range(columns):
        line[column] = (one[column] & one[column + 1] & one[column + 2]
                        & two[column] & two[column + 1] & two[column + 2]
                        & three[column] & three[column + 1] & three[column + 2])
    ends[row] = columns, 0
    for column in range(0, columns, LANES):
        if equal_bits(load(flags, start + column), splat(np.uint8(0))) != NONE:
            ends[row, 0] = min(ends[row, 0], column)
            ends[row, 1] = min(column + LANES, columns)
