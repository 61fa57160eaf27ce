# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of every candidate of a row: 0 for a fully possible match, more for less possible ones.

cost = min(hamming(census), census_cut) + min(|slope difference|, slope_cut) + what the priors add

The Hamming distance may count the nearest eight neighbours twice: they blur edges least.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, bit_and, bit_xor, count_bits, count_bits_of_word, load_like,
    minimum, splat_like)
import numpy as np

CENSUS_CUT, SLOPE_CUT = 14, 4   # largest differences that count at full size
DEAD_ZONE = 4       # bit of a weight of a prior from which on its dead zone begins


class Features(NamedTuple):
    """The features that costs compare, by address; see features.py. The target's are mirrored."""

    columns: int
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
    Return the costs of the candidates of as many pixels as there are lanes: census and gradient.

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
