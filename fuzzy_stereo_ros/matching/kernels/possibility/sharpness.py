# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How sharp a picture is, whether JPEG has quantised it, and its binomial mean.

Not in the paper, whose pictures are sharp. JPEG rounds each coefficient of the cosine transform of
8 x 8 pixels to a multiple of a step: between 0 and the first multiple there is nothing. In any
other picture small coefficients are more frequent than large ones.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.rows import pad_row
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, LANES, load, minimum, shift_left, shift_right, subtract, total)
import numpy as np

JPEG_BLOCK = 8              # side of a block of JPEG
ROW_STEP = 8                    # every ROW_STEP-th row is measured for sharpness
# Ranges of counted coefficients, grey levels; MIDDLE: below the steps of quality 70.
SMALL, LARGE, MIDDLE = (1.5, 3.5), (4.5, 24.5), (4.5, 8.0)
FREQUENCIES = (1, 2), (2, 1), (2, 2), (1, 3), (3, 1), (2, 3), (3, 2)
WAVES = (np.cos((2 * np.arange(JPEG_BLOCK) + 1) * np.arange(4)[:, None] * np.pi / (2 * JPEG_BLOCK))
         * np.sqrt(2 / JPEG_BLOCK)).astype(np.float32)     # of the frequencies 1 to 3, orthonormal


@inlined
def _coefficient(values, wave):
    """Return the coefficient of a wave in JPEG_BLOCK values: odd waves turn their sign halfway."""
    total = np.float32(0)
    for near in range(JPEG_BLOCK // 2):
        one, other = values[near], values[JPEG_BLOCK - 1 - near]
        total += WAVES[wave, near] * (one - other if wave % 2 else one + other)
    return total


@kernel(allocates=True)
def count_coefficients(luminance, begin, columns, apart, unit, counts, first, last):
    """
    Count the small, the large and the middle coefficients of some blocks of a picture.

    begin: column of the first block, from 0; apart: step of measured blocks; unit: of luminance in
    a grey level; counts: int64 (3,), increased; first: a multiple of JPEG_BLOCK
    """
    pixels = np.empty(JPEG_BLOCK, np.float32)
    waves = np.empty((4, JPEG_BLOCK), np.float32)   # of the columns of a block
    smallest, small_to = np.float32(SMALL[0] * unit), np.float32(SMALL[1] * unit)
    large_from, largest = np.float32(LARGE[0] * unit), np.float32(LARGE[1] * unit)
    middle_from, middle_to = np.float32(MIDDLE[0] * unit), np.float32(MIDDLE[1] * unit)
    for top in range(first, last - JPEG_BLOCK + 1, JPEG_BLOCK):
        start = begin + JPEG_BLOCK * (top // JPEG_BLOCK * 3 % apart)
        for left in range(start, columns - JPEG_BLOCK + 1, JPEG_BLOCK * apart):
            for column in range(JPEG_BLOCK):
                place = left + MARGIN + column
                for row in range(JPEG_BLOCK):
                    pixels[row] = luminance[top + row + MARGIN, place]
                for wave in range(1, 4):
                    waves[wave, column] = _coefficient(pixels, wave)
            for down, right in FREQUENCIES:
                value = _coefficient(waves[down], right)
                size = abs(value)
                counts[0] += smallest <= size < small_to
                counts[1] += large_from <= size < largest
                counts[2] += middle_from <= size < middle_to


@kernel
def add_steps(luminance, columns, sums, first, last):
    """
    Add the sizes of the second differences along some rows, over 1 px and over 2 px.

    columns: whole LANES of them count; sums: int64 (2,), in quarters of luminance
    """
    pixels, stride = luminance.reshape(-1), luminance.shape[1]
    for row in range(first, last):
        if row % ROW_STEP:
            continue
        for column in range(0, columns - LANES + 1, LANES):
            place = (row + MARGIN) * stride + column + MARGIN
            twice = shift_left(shift_right(load(pixels, place), 2), 1)
            for distance in range(1, 3):
                around = add(shift_right(load(pixels, place - distance), 2),
                             shift_right(load(pixels, place + distance), 2))
                step = subtract(twice, around)
                sums[distance - 1] += total(minimum(step, subtract(around, twice)))


@kernel(allocates=True)
def smooth(luminance, columns, share, smoothed, grey, first, last):
    """
    Move pixels towards the binomial means of 3 x 3, a Gaussian of 0.7 px, or away from them.

    luminance, smoothed: uint16, with a margin; share: of the way, 1: the means, below 0: sharper;
    grey: uint8 (R, ...), smoothed / 256, rounded
    """
    sums = np.empty(columns + 2, np.int32)
    for row in range(first, last):
        above, here = luminance[row + MARGIN - 1], luminance[row + MARGIN]
        below = luminance[row + MARGIN + 1]
        for column in range(columns + 2):
            place = column + MARGIN - 1
            sums[column] = np.int32(above[place]) + 2 * np.int32(here[place]) + below[place]
        line, greys = smoothed[row + MARGIN, MARGIN:], grey[row]
        for column in range(columns):
            mean = (sums[column] + 2 * sums[column + 1] + sums[column + 2] + 8) >> 4
            value = np.int32(here[column + MARGIN])
            value = min(max(value + share * (mean - value), 0), 65535)
            line[column] = value
            greys[column] = min((value + 128) >> 8, 255)
        pad_row(smoothed, row, columns, MARGIN)
