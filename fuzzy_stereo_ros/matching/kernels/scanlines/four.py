# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Four rows or columns at once: tuples of four vectors, which stay in registers.

Their paths hide each other's latency, and their smallest lanes are found at once, in half of the
work of one after the other. `at`, `stride`: where the first of the four is in the memory, and
from one to the next, in its elements.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import splat_word
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import advance
from fuzzy_stereo_ros.matching.kernels.simd import (
    bit_or, first_equal, LANES, load_like, saturating_add, shuffled, store, subtract, VECTOR,
    vector_call, write)
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _a_stride_apart(read):
    """Return a function that reads four vectors like `kind`."""
    @inlined
    def read_four(kind, memory, at, stride):
        return (read(kind, memory, at), read(kind, memory, at + stride),
                read(kind, memory, at + 2 * stride), read(kind, memory, at + 3 * stride))
    return read_four


def _pair_by_pair(function):
    """Return a function of four vectors and four others, which calls one for each pair."""
    @inlined
    def of_four(four, others):
        return (function(four[0], others[0]), function(four[1], others[1]),
                function(four[2], others[2]), function(four[3], others[3]))
    return of_four


load_four, splat_four = _a_stride_apart(load_like), _a_stride_apart(splat_word)
add_four, _subtract_four = _pair_by_pair(saturating_add), _pair_by_pair(subtract)
first_of_four = _pair_by_pair(first_equal)      # -> four indices of lanes


@inlined
def store_four(memory, at, stride, four):
    """Write four vectors."""
    store(memory, at, four[0])
    store(memory, at + stride, four[1])
    store(memory, at + 2 * stride, four[2])
    store(memory, at + 3 * stride, four[3])


@inlined
def advance_four(paths, jumps, penalty, costs):
    """Move four paths on by a pixel: see `advance`."""
    return (advance(paths[0], jumps[0], penalty, costs[0]),
            advance(paths[1], jumps[1], penalty, costs[1]),
            advance(paths[2], jumps[2], penalty, costs[2]),
            advance(paths[3], jumps[3], penalty, costs[3]))


@inlined
def without_least(four):
    """Return four vectors; the smallest lane of each is subtracted from its lanes."""
    return _subtract_four(four, unpacked(four[0], lowest_of_four(four)))


@inlined
def mask_four(four, masks, middle, lanes):
    """Set the bits of four vectors that masks, loaded from middle - lane on, have."""
    return (bit_or(four[0], load_like(four[0], masks, middle - lanes[0])),
            bit_or(four[1], load_like(four[1], masks, middle - lanes[1])),
            bit_or(four[2], load_like(four[2], masks, middle - lanes[2])),
            bit_or(four[3], load_like(four[3], masks, middle - lanes[3])))


# where the packed numbers are
_FOUR = 0, LANES // 2, LANES // 4, 3 * LANES // 4


def _one_block(builder, vector):
    """Return the smallest of all blocks of a vector."""
    blocks = [shuffled(builder, vector, vector, list(range(first, first + LANES)))
              for first in range(0, vector.type.count, LANES)]
    while len(blocks) > 1:
        blocks = [*blocks[2:], vector_call(builder, 'umin', *blocks[:2])]
    return blocks[0]


def _halves_met(builder, one, other, half):
    """Return the minima with the lane `half` further, of two vectors packed into one."""
    # in the order that a processor interleaves by
    pick = [start + lane for begin in range(0, LANES, 2 * half) for start in (0, LANES)
            for lane in range(begin, begin + half)]
    return vector_call(builder, 'umin', *(
        shuffled(builder, one, other, [lane + shift for lane in pick]) for shift in (0, half)))


@intrinsic
def lowest_of_four(typing, vectors):
    """Return the smallest lane of each of four vectors, packed: see `unpacked`, `store_packed`."""
    signature = VECTOR[8](vectors)

    def generate(context, builder, signature, arguments):
        one, two, three, four = (
            _one_block(builder, vector) for vector in cgutils.unpack_tuple(builder, arguments[0]))
        met = _halves_met(builder, _halves_met(builder, one, two, LANES // 2),
                          _halves_met(builder, three, four, LANES // 2), LANES // 4)
        for half in (4, 2, 1):
            met = vector_call(builder, 'umin', met, shuffled(builder, met, met, [
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
def store_packed(typing, array, index, packed):
    """Write the four packed numbers to a flat array, or an address, from `index` on."""
    signature = types.void(array, types.intp, packed)

    def generate(context, builder, signature, arguments):
        four = shuffled(builder, arguments[2], arguments[2], _FOUR)
        return write(context, builder, array, arguments[:2], four)
    return signature, generate
