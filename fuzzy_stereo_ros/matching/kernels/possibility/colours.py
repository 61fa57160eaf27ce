# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The three channels of pixels as vectors."""
from fuzzy_stereo_ros.matching.kernels.simd import LANES, lanes_in_llvm, place_of, shuffled, VECTOR
from numba import types
from numba.extending import intrinsic


@intrinsic
def load_colours(typing, array, index):
    """Return the blue, green and red of LANES pixels of 8 bits from `index` on, in 16 bits."""
    signature = types.UniTuple(VECTOR[16], 3)(array, types.intp)

    def generate(context, builder, signature, arguments):
        wide = lanes_in_llvm(8, 3 * LANES)
        pixels = builder.load(
            place_of(context, builder, signature.args[0], *arguments, wide))
        pixels.align = 1
        channels = [builder.zext(
            shuffled(builder, pixels, pixels, list(range(channel, 3 * LANES, 3))),
            lanes_in_llvm(16))
            for channel in range(3)]
        return context.make_tuple(builder, signature.return_type, channels)
    return signature, generate
