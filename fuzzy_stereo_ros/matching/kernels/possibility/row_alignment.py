# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rows of two images that are not the same: which features match, and reading at other rows.

Not in the paper, whose pairs are rectified exactly. Few pairs of features are near enough to be
matched; only their bits are compared. Along a row the offset of an image changes linearly; it
stays between the same two rows for most of it, so that the inner loop is a few vectors.
"""
from math import ceil, floor

from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.simd import count_bits_of_word
import numpy as np

NONE = -1       # the nearest feature where none is near
# Keys' parameter is -0.75 as in OpenCV, not -0.5: half a pixel apart that keeps finer texture.
_HALF, _SHARP = np.float32(0.5), np.float32(0.75)
_TWICE, _SQUARE, _CUBE = np.float32(1.5), np.float32(2.25), np.float32(1.25)


@kernel
def nearest_features(features, others, lowest, highest, apart, nearest, distances):
    """
    Write which feature of another image is most like each feature; of equals the first one.

    features: float32 (2, N), column and row, px, their bits, uint32 (N, words), and the first of
    the others whose row may be near, int64 (N,); others: places and bits of M, ascending by row,
    and their numbers, int64 (M,); lowest, highest: of the difference of columns, apart: of that of
    rows at most, float32, px; nearest: int32 (N,), NONE where there is none so near; distances:
    int32 (N,), bits that differ
    """
    (places, bits, begins), (other_places, other_bits, numbers) = features, others
    columns, rows = other_places[0], other_places[1]
    for one in range(places.shape[1]):
        column, row = places[0, one], places[1, one]
        found, least, other = NONE, 32 * bits.shape[1] + 1, begins[one]
        while other < len(rows) and rows[other] - row <= apart:
            difference = column - columns[other]
            if difference >= lowest and difference <= highest and row - rows[other] <= apart:
                differing = 0
                for word in range(bits.shape[1]):
                    differing += count_bits_of_word(
                        np.uint32(bits[one, word] ^ other_bits[other, word]))
                if differing < least or differing == least and numbers[other] < found:
                    found, least = numbers[other], differing
            other += 1
        nearest[one], distances[one] = found, least


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


@called
def _blend_rows(above, here, below, last, begin, slope, largest, moved):
    """Write pixels between `here` and `below`; begin: place of the first, in px below `here`."""
    for index in range(len(moved)):
        place = begin + slope * np.float32(np.int32(index))     # AVX2 converts no int64
        one, two = np.float32(above[index]), np.float32(here[index])
        three, four = np.float32(below[index]), np.float32(last[index])
        linear = _SHARP * (three - one)
        square = _TWICE * (one + three) - _SQUARE * two - _SHARP * four
        cube = _SHARP * (four - one) + _CUBE * (two - three)
        value = two + place * (linear + place * (square + place * cube)) + _HALF
        moved[index] = np.int32(min(max(value, np.float32(0)), largest))
