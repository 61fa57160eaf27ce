# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Winner takes all: the label of least summed cost, seen from the reference and from the target.

Also the sub-pixel offset (equiangular fit: Shimizu and Okutomi, 2001) and the uniqueness margin:
how much more the best label elsewhere costs.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_short, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    at_most, bit_or, equal_bits, first_set, lane_numbers, LANES, load, lowest, minimum, splat,
    subtract)
from fuzzy_stereo_ros.matching.kernels.units import STEPS
import numpy as np

# A vector loaded from MIDDLE - best has 255 in the lanes best - 1, best and best + 1.
MIDDLE = 4 * LANES
NEAR_LABELS = np.zeros(3 * MIDDLE, np.uint8)
NEAR_LABELS[MIDDLE - 1:MIDDLE + 2] = 255


@inlined
def fit_offsets(below, least, above, width, offsets):
    """
    Write the minima of two lines of equal slope through three sums, in 1 / STEPS px.

    below, least, above: addresses of uint8 (width,), the sums beside and at the best label;
    offsets: the address of int8 (width,).
    """
    for column in range(width):
        low, high = np.int32(load_byte(below, column)), np.int32(load_byte(above, column))
        step, rise = low - high, max(low, high) - np.int32(load_byte(least, column))
        # rounded half away from zero
        half = rise >> 1 if step > 0 else -(rise >> 1)
        store_byte(offsets, column, np.int32(
            np.float32(STEPS // 2 * step + half) / np.float32(max(rise, 1))))


@inlined
def least_sum(sums, at, blocks):
    """Return the least sum of `blocks` blocks of labels from `at` on."""
    smallest = load(sums, at)
    for block in range(1, blocks):
        smallest = minimum(smallest, load(sums, at + LANES * block))
    return lowest(smallest)


@inlined
def best_label(sums, at, blocks):
    """Return the index of the least sum from `at` on, the first of equals, and that sum."""
    least = least_sum(sums, at, blocks)
    for block in range(blocks):
        bits = equal_bits(load(sums, at + LANES * block), splat(least))
        if bits != 0:
            return LANES * block + first_set(bits), least
    return 0, least


@inlined
def least_elsewhere(sums, at, blocks, best):
    """Return the least sum, from `at` on, of the labels that are not best or next to it."""
    smallest = splat(np.uint8(255))
    lanes = lane_numbers(smallest)
    for block in range(blocks):
        before = best - 1 - LANES * block
        total = load(sums, at + LANES * block)
        if -3 < before < LANES:
            beyond = subtract(lanes, splat(np.uint8(before & 255)))
            total = bit_or(total, at_most(beyond, splat(np.uint8(2))))
        smallest = minimum(smallest, total)
    return lowest(smallest)


@inlined
def choose_of_target(labels, label_bytes, sums, columns, offers, target, target_columns):
    """
    Give each target pixel the label of the cheapest pixel that points at it.

    All but the sizes are addresses of a row. labels: of 1 or 2 bytes; sums: uint8; offers:
    uint16, working memory; target: uint8, labels modulo 256, 0 where no pixel points; its last
    columns are those of the pixels, any more come before them. Ties go to the
    larger label modulo 256.
    """
    extra = target_columns - columns
    for column in range(target_columns):
        store_short(offers, column, np.uint16(2**16 - 1))
    for column in range(columns):
        label = np.int64(load_byte(labels, column)) if label_bytes == 1 else np.int64(
            load_short(labels, column))
        pointed = column - label + extra
        if pointed >= 0:
            offer = 256 * np.int64(load_byte(sums, column)) + 255 - (label & 255)
            known = np.int64(load_short(offers, pointed))
            store_short(offers, pointed, min(offer, known))
    for column in range(target_columns):
        store_byte(target, column, 255 - np.int64(load_short(offers, column) & 255))
