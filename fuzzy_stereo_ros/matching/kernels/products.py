# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Products of which only the upper half counts: fractions of whole numbers."""
from fuzzy_stereo_ros.matching.kernels.simd import broadcast, lanes_in_llvm, VECTOR
from numba import types
from numba.extending import intrinsic

_BITS = 16


@intrinsic
def high_product(typing, a, b):
    """Return the upper 16 bits of the products of the lanes of two 16-bit vectors."""
    signature = VECTOR[_BITS](VECTOR[_BITS], VECTOR[_BITS])

    def generate(context, builder, signature, arguments):
        wide = [builder.zext(argument, lanes_in_llvm(2 * _BITS)) for argument in arguments]
        places = broadcast(builder, context.get_constant(types.uint32, _BITS))
        return builder.trunc(builder.lshr(builder.mul(*wide), places), lanes_in_llvm(_BITS))
    return signature, generate
