# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Winner takes all: the label of least summed cost, seen from the reference and from the target.

With it come the sub-pixel offset (equiangular fit: Shimizu and Okutomi, 2001) and how much worse
the best label elsewhere would be. The smallest lanes of four vectors are found at once, in half of
the work of one after the other.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_short, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    at_most, bit_or, called, equal_bits, first_set, lane_numbers, LANES, load, lowest, minimum,
    place_of, shuffled, splat, subtract, VECTOR)
from fuzzy_stereo_ros.matching.kernels.units import STEPS
from numba import types
from numba.extending import intrinsic
import numpy as np

# where the packed numbers are
_FOUR = 0, LANES // 2, LANES // 4, 3 * LANES // 4


def _least(builder, one, other):
    return called(builder, f'llvm.umin.v{LANES}i8', one.type, [one, other])


def _one_block(builder, vector):
    """Return the smallest of all blocks of a vector."""
    blocks = [shuffled(builder, vector, vector, list(range(first, first + LANES)))
              for first in range(0, vector.type.count, LANES)]
    while len(blocks) > 1:
        blocks = [*blocks[2:], _least(builder, *blocks[:2])]
    return blocks[0]


def _halves_met(builder, one, other, half):
    """Return the minima with the lane `half` further, of two vectors packed into one."""
    # in the order that a processor interleaves by
    pick = [start + lane for begin in range(0, LANES, 2 * half) for start in (0, LANES)
            for lane in range(begin, begin + half)]
    return _least(builder, *(shuffled(builder, one, other, [lane + shift for lane in pick])
                             for shift in (0, half)))


@intrinsic
def lowest_of_four(typing, a, b, c, d):
    """Return the smallest lane of each of four vectors, packed: see `unpacked`, `store_four`."""
    signature = VECTOR[8](a, b, c, d)

    def generate(context, builder, signature, arguments):
        if a.lanes > LANES:
            arguments = [_one_block(builder, vector) for vector in arguments]
        one, two, three, four = arguments
        met = _halves_met(builder, _halves_met(builder, one, two, LANES // 2),
                          _halves_met(builder, three, four, LANES // 2), LANES // 4)
        for half in (4, 2, 1):
            met = _least(builder, met, shuffled(builder, met, met, [
                lane + half if lane % 8 < half else lane for lane in range(LANES)]))
        return met
    return signature, generate


@intrinsic
def unpacked(typing, vector, packed):
    """Return four vectors like another, each with one of the packed numbers in every lane."""
    signature = types.UniTuple(vector, 4)(vector, packed)

    def generate(context, builder, signature, arguments):
        packed = arguments[1]
        return context.make_tuple(builder, signature.return_type, [
            shuffled(builder, packed, packed, [place] * vector.lanes) for place in _FOUR])
    return signature, generate


@intrinsic
def store_four(typing, array, index, packed):
    """Write the four packed numbers to a flat array, or an address, from `index` on."""
    signature = types.void(array, types.intp, packed)

    def generate(context, builder, signature, arguments):
        four = shuffled(builder, arguments[2], arguments[2], _FOUR)
        builder.store(four, place_of(context, builder, signature.args[0], arguments[0],
                                     arguments[1], four.type)).align = 1
        return context.get_dummy_value()
    return signature, generate


@inlined
def without_least(one, two, three, four):
    """Return four vectors with the smallest lane of each taken off its lanes."""
    least_1, least_2, least_3, least_4 = unpacked(one, lowest_of_four(one, two, three, four))
    return (subtract(one, least_1), subtract(two, least_2), subtract(three, least_3),
            subtract(four, least_4))


# loaded from MIDDLE - best on, it has 255 in the lanes best - 1, best and best + 1
MIDDLE = 4 * LANES
NEAR = np.zeros(3 * MIDDLE, np.uint8)
NEAR[MIDDLE - 1:MIDDLE + 2] = 255


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
def best_label(sums, at, blocks):
    """Return the index of the first of the least sums from `at` on, and that sum."""
    smallest = splat(np.uint8(255))
    for block in range(blocks):
        smallest = minimum(smallest, load(sums, at + LANES * block))
    least = lowest(smallest)
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
