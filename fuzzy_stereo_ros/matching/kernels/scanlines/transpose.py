# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Transposition of a square of bytes, so that vectors along its rows become such along columns."""
from fuzzy_stereo_ros.matching.kernels.compiled import called
from fuzzy_stereo_ros.matching.kernels.simd import LANES, lanes_in_llvm, place_of, shuffled
from numba import types
from numba.extending import intrinsic

SQUARE = LANES * LANES      # bytes
# From a square to the next: a fraction of a page apart, lines would evict each other, and loads
# would wait for stores that only seem to be of the same place.
PITCH = SQUARE + 64


@intrinsic
def _transposed(typing, source, target):
    """Write a square at an address transposed to another, or to its own place."""
    def generate(context, builder, signature, arguments):
        kind, half = lanes_in_llvm(8), LANES // 2

        def place(memory, line):
            return place_of(context, builder, types.intp, memory,
                            context.get_constant(types.intp, LANES * line), kind)
        lines = [builder.load(place(arguments[0], line)) for line in range(LANES)]
        for line in lines:
            line.align = 1
        # pairs of bytes of either half interleaved, which processors do in one instruction
        low = [start + lane + other for start in (0, half) for lane in range(half // 2)
               for other in (0, LANES)]
        orders = low, [half // 2 + lane for lane in low]
        sides = []
        for begin in (0, half):
            group = lines[begin:begin + half]
            for _ in range(4):
                group = [shuffled(builder, group[near], group[near + half // 2], order)
                         for near in range(half // 2) for order in orders]
            sides.append(group)
        for near in range(half):
            for side in (0, half):
                order = [start + side + lane for start in (0, LANES) for lane in range(half)]
                builder.store(shuffled(builder, sides[0][near], sides[1][near], order),
                              place(arguments[1], near + side)).align = 1
        return context.get_dummy_value()
    return types.void(types.intp, types.intp), generate


@called
def transpose(source, target):
    """Write the 32 x 32 bytes at an address transposed to another, or to their own place."""
    _transposed(source, target)
