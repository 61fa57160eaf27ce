# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Winner takes all: the label of least summed cost, seen from the reference and from the target.

With it come the sub-pixel offset (equiangular fit: Shimizu and Okutomi, 2001) and how much worse
the best label elsewhere would be.
"""
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, at_most, bit_or, choose, equal_bits, first_set, lane_numbers, LANES, load, lowest,
    minimum, saturating_add, splat, store, subtract)
from numba import njit
import numpy as np

STEPS = 16       # sub-pixel steps in a pixel


@njit(nogil=True, cache=True, error_model='numpy')
def equiangular(below, here, above):
    """Return the offset of the minimum of two lines of equal slope, in 1 / STEPS px."""
    rise = max(below, above) - here
    if rise <= 0:
        return 0
    # rounded half away from zero; no branch on the sign, which is a toss-up
    half = (2 * np.int64(below > above) - 1) * (rise >> 1)
    return int(np.float32(STEPS // 2 * (below - above) + half) / np.float32(rise))


@njit(nogil=True, cache=True)
def best_label(sums, blocks):
    """Return the index of the first of the least sums, and that sum."""
    smallest = splat(np.uint8(255))
    for block in range(blocks):
        smallest = minimum(smallest, load(sums, LANES * block))
    least = lowest(smallest)
    for block in range(blocks):
        bits = equal_bits(load(sums, LANES * block), splat(least))
        if bits != 0:
            return LANES * block + first_set(bits), least
    return 0, least


@njit(nogil=True, cache=True)
def least_elsewhere(sums, blocks, best):
    """Return the least sum of the labels that are not best or next to it."""
    smallest = splat(np.uint8(255))
    lanes = lane_numbers()
    for block in range(blocks):
        before = best - 1 - LANES * block
        total = load(sums, LANES * block)
        if -3 < before < LANES:
            beyond = subtract(lanes, splat(np.uint8(before & 255)))
            total = bit_or(total, at_most(beyond, splat(np.uint8(2))))
        smallest = minimum(smallest, total)
    return lowest(smallest)


@njit(nogil=True, cache=True)
def offer_to_target(sums, blocks, label, at, best_sums, best_labels):
    """
    Let a pixel's labels compete for the target pixels that they point at.

    best_sums, best_labels: uint8, the mirrored target row; `at` is where the first label points;
    labels are kept modulo 256.
    """
    lanes = lane_numbers()
    for block in range(blocks):
        place = at + LANES * block
        total, rival = load(sums, LANES * block), load(best_sums, place)
        labels = add(lanes, splat(np.uint8((label + LANES * block) & 255)))
        store(best_labels, place, choose(at_most(total, rival), labels, load(best_labels, place)))
        store(best_sums, place, minimum(total, rival))


@njit(nogil=True, cache=True)
def total_of(sums, sum_at, path, path_at, blocks, totals):
    """Add the last path to the sums of a pixel: totals, uint8, for all of its labels."""
    for block in range(blocks):
        offset = LANES * block
        store(totals, offset,
              saturating_add(load(sums, sum_at + offset), load(path, path_at + offset)))
