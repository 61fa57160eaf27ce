# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Transposition of a square of bytes, so that vectors along its rows become such along columns."""
from fuzzy_stereo_ros.matching.kernels.compiled import called
from fuzzy_stereo_ros.matching.kernels.simd import LANES, lanes_in_llvm, shuffled
from numba import types
from numba.extending import intrinsic

SQUARE = LANES * LANES      # bytes


@intrinsic
def _transposed(typing, source, target, stride):
    """Write a square at an address transposed to another, or to its own place."""
    def generate(context, builder, signature, arguments):
        kind, half = lanes_in_llvm(8), LANES // 2
        source, target, stride = arguments

        def places(begin, count):
            """Return pointers to lines, each a stride behind the one before."""
            found = []
            for _ in range(count):
                found.append(builder.inttoptr(begin, kind.as_pointer()))
                begin = builder.add(begin, stride)
            return found
        lines = [builder.load(place) for place in places(source, LANES)]
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
        behind = builder.add(target, builder.mul(stride, context.get_constant(types.intp, half)))
        for near, ends in enumerate(zip(places(target, half), places(behind, half))):
            for side, place in zip((0, half), ends):
                order = [start + side + lane for start in (0, LANES) for lane in range(half)]
                builder.store(shuffled(
                    builder, sides[0][near], sides[1][near], order), place).align = 1
        return context.get_dummy_value()
    return types.void(types.intp, types.intp, types.intp), generate


@called
def transpose(source, target, stride):
    """Write 32 x 32 bytes transposed to another address or their own; stride: between lines."""
    _transposed(source, target, stride)
