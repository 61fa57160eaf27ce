# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of every candidate of a row: 0 for a fully possible match, more for less possible ones.

cost = min(hamming(census), census_cut) + min(|slope difference|, slope_cut) + what the priors add

The Hamming distance may count the nearest eight neighbours twice: they blur edges least.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import repeat_bytes, splat_word
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, bit_and, bit_or, bit_xor, count_bits, count_bits_of_word,
    lane_numbers, LANES, lanes_of, load, load_like, minimum, saturating_subtract, shift_right,
    splat, splat_like, store, subtract)
import numpy as np

CENSUS_CUT, SLOPE_CUT = 14, 4   # largest differences that count at full size
DEAD_ZONE = 4       # bit of a weight of a prior from which on its dead zone begins


class Features(NamedTuple):
    """The features that costs compare, by address; see features.py. The target's are mirrored."""

    columns: int
    disparities: int
    near_weight: int              # how often the nearest eight neighbours count: once or twice
    census_cut: int
    slope_cut: int
    census: int                   # of uint8 (R, 3, census_stride)
    slopes: int                   # of uint8 (R, slope_stride)
    target_census: int            # of uint8 (R, 3, target_stride)
    target_slopes: int            # of uint8 (R, target_stride)
    census_stride: int
    slope_stride: int
    target_stride: int


class Prior(NamedTuple):
    """A map of preferred labels, which makes others cost more."""

    labels: np.ndarray            # uint8 or uint16 (R, C)
    weights: np.ndarray           # uint8 (R, C), see weight_of; 0 means no preference


def weight_of(dead_zone, cut):
    """Return a weight of a prior: 1 a label costs, beyond so many, until it is `cut`; below 16."""
    return dead_zone << DEAD_ZONE | cut


@inlined
def raw_costs(target, candidate, stride, target_slopes, slope_at, code, slope, cuts):
    """
    Return the costs of as many candidates of a pixel as there are lanes: census and gradient.

    cuts: vectors of census_cut, slope_cut and a mask, all set where the nearest count twice
    """
    near = count_bits(bit_xor(code[0], load_like(slope, target, candidate)))
    distance = add(add(add(near, bit_and(near, cuts[2])),
                       count_bits(bit_xor(code[1], load_like(slope, target, candidate + stride)))),
                   count_bits(bit_xor(code[2], load_like(slope, target, candidate + 2 * stride))))
    difference = absolute_difference(slope, load_like(slope, target_slopes, slope_at))
    return add(minimum(distance, cuts[0]), minimum(difference, cuts[1]))


@inlined
def cuts_of(search, vector):
    """Return the limits of the costs, as vectors like another: see raw_costs."""
    return (splat_like(vector, search.census_cut), splat_like(vector, search.slope_cut),
            splat_like(vector, 255 * (search.near_weight - 1)))


@inlined
def beyond(vector, label, disparities):
    """Return 255 in the lanes of the labels, `label` the first, that do not exist; 0 elsewhere."""
    number = max(min(disparities - label, lanes_of(vector)), 0)     # of labels that exist
    # their number minus the lane's, saturated, is 0 where the label does not exist
    short = saturating_subtract(splat_like(vector, number), lane_numbers(vector))
    one = splat_like(vector, 1)
    return subtract(minimum(short, one), one)


@inlined
def _widen_codes(search, row, begin, end, codes, at):
    """Write the features of a row of the reference as words: census planes, then gradients."""
    width, stride = end - begin, search.census_stride
    for plane in range(3):
        first = (3 * row + plane) * stride
        repeat_bytes(search.census, first + begin, first + end, codes, at + plane * width)
    first = row * search.slope_stride
    repeat_bytes(search.slopes, first + begin, first + end, codes, at + 3 * width)


@inlined
def _codes_of(kind, codes, at, width):
    """Return the features of a pixel from _widen_codes, as vectors: census planes, gradient."""
    return (splat_word(kind, codes, at), splat_word(kind, codes, at + width),
            splat_word(kind, codes, at + 2 * width)), splat_word(kind, codes, at + 3 * width)


@called
def raw_row(search, row, blocks, costs, at, codes):
    """Write the costs of a row from `at` on, every label, without a mask."""
    columns, stride = search.columns, search.target_stride
    _widen_codes(search, row, 0, columns, codes, 0)
    cuts = cuts_of(search, splat(np.uint8(0)))
    target, target_slopes = search.target_census, search.target_slopes
    for column in range(columns):
        pointed = columns - 1 - column
        code, slope = _codes_of(cuts[0], codes, column, columns)
        for block in range(blocks):
            label = LANES * block
            store(costs, at, raw_costs(
                target, row * 3 * stride + pointed + label, stride, target_slopes,
                row * stride + pointed + label, code, slope, cuts))
            at += LANES


@called
def box_row(search, above, here, below, blocks, costs, at):
    """
    Write the sums of raw costs over 3 x 3 pixels / 2**box from `at` on, borders repeated.

    above, here, below: addresses of rows that raw_row wrote; 255 where a label does not exist.
    """
    columns, size, places = search.columns, LANES * blocks, search.box
    for block in range(blocks):
        offset = LANES * block
        mask = beyond(splat(np.uint8(0)), offset, search.disparities)
        middle = add(load(here, offset), add(load(above, offset), load(below, offset)))
        left = middle
        for column in range(columns):
            next_one = min(column + 1, columns - 1) * size + offset
            right = add(load(here, next_one), add(load(above, next_one), load(below, next_one)))
            total = shift_right(add(left, add(middle, right)), places)
            store(costs, at + column * size + offset, bit_or(total, mask))
            left, middle = middle, right


@inlined
def match_cost(left, right, row, column, mirrored):
    """
    Return the cost of one match of full images without priors, as raw_costs has it.

    left, right: census, uint8 (R, 3, ...), and slopes, uint8 (R, ...); mirrored: column of the
    right ones
    """
    (census, slopes), (target_census, target_slopes) = left, right
    word = np.uint32(0)
    for plane in range(3):
        code = census[row, plane, column] ^ target_census[row, plane, mirrored]
        word |= np.uint32(code) << np.uint32(8 * plane)
    difference = abs(np.int64(slopes[row, column]) - np.int64(target_slopes[row, mirrored]))
    distance = count_bits_of_word(word) + count_bits_of_word(word & np.uint32(255))
    return min(distance, CENSUS_CUT) + min(difference, SLOPE_CUT)
