# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The smallest lanes of four vectors at once: half of the work of one after the other."""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    called, LANES, place_of, shuffled, subtract, VECTOR)
from numba import types
from numba.extending import intrinsic

# where the packed numbers are
_FOUR = 0, LANES // 2, LANES // 4, 3 * LANES // 4


def _least(builder, one, other):
    return called(builder, f'llvm.umin.v{LANES}i8', one.type, [one, other])


def _one_block(builder, vector):
    """Return the smaller of both blocks of a vector of two."""
    return _least(builder, *(shuffled(builder, vector, vector, list(range(first, first + LANES)))
                             for first in (0, LANES)))


def _halves_met(builder, one, other, half):
    """Return the smaller of each lane and that `half` lanes on, for two vectors in one."""
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
