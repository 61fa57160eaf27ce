# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read an image at rows that differ from its own by a smooth offset, by cubic interpolation.

Not in the paper, whose pairs are rectified exactly. Along a row the offset changes linearly; it
stays between the same two rows for most of it, so that the inner loop is a few vectors.
"""
from math import ceil, floor

from fuzzy_stereo_ros.matching.kernels.compiled import kernel
import numpy as np

# Keys' parameter is -0.75 as in OpenCV, not -0.5: half a pixel apart that keeps finer texture.
_HALF, _SHARP = np.float32(0.5), np.float32(0.75)
_TWICE, _SQUARE, _CUBE = np.float32(1.5), np.float32(2.25), np.float32(1.25)


@kernel
def shift_rows(image, channels, offsets, largest, moved, first_row, last_row):
    """
    Write an image whose pixel (row, column) is that at row + offset of another; borders repeat.

    Cubic convolution (Keys, 1981). image, moved: uint8 or uint16 (R, C * channels); offsets:
    float64 (4,), px: in the centre, and what x, y and x y add, each from -1 at the first to 1 at
    the last column or row; largest: value of a pixel, float32; first_row, last_row: of `moved`
    """
    rows, width = image.shape
    bottom, step = rows - 1, 2.0 / max(width - channels, 1)
    for row in range(first_row, last_row):
        y = 2.0 * row / max(bottom, 1) - 1.0
        slope = (offsets[1] + offsets[3] * y) * step
        start = row + offsets[0] + offsets[2] * y - offsets[1] - offsets[3] * y
        first = 0
        while first < width:
            base, end = floor(start + slope * first), width
            if slope != 0:      # up to where it comes between two other rows
                edge = base + 1 if slope > 0 else base
                end = min(max(ceil((edge - start) / slope), first + 1), width)
            _blend_rows(
                image[min(max(base - 1, 0), bottom), first:end],
                image[min(max(base, 0), bottom), first:end],
                image[min(max(base + 1, 0), bottom), first:end],
                image[min(max(base + 2, 0), bottom), first:end],
                np.float32(start + slope * first - base), np.float32(slope), largest,
                moved[row, first:end])
            first = end


@kernel
def _blend_rows(above, here, below, last, begin, slope, largest, moved):
    """Write pixels between `here` and `below`; begin: place of the first, in px below `here`."""
    for index in range(len(moved)):
        place = begin + slope * np.float32(index)
        one, two = np.float32(above[index]), np.float32(here[index])
        three, four = np.float32(below[index]), np.float32(last[index])
        linear = _SHARP * (three - one)
        square = _TWICE * (one + three) - _SQUARE * two - _SHARP * four
        cube = _SHARP * (four - one) + _CUBE * (two - three)
        value = two + place * (linear + place * (square + place * cube)) + _HALF
        moved[index] = np.int32(min(max(value, np.float32(0)), largest))
