# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Thirty-two labels at once: small vectors of integers as values inside numba kernels.

Everything is portable LLVM (no instruction of a special processor is named), so the same source
runs on SSE, AVX2, AVX-512 and NEON. Loads and stores need no alignment and check no bounds.
"""
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

LANES = 32


class _Vector(types.Type):
    """The type of a vector of LANES unsigned integers of a number of bits."""

    def __init__(self, bits):
        self.bits = bits
        super().__init__(name=f'Vector{LANES}x{bits}')


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):
    """Vectors live in registers as the LLVM vectors that they are."""

    def __init__(self, manager, vector):
        super().__init__(manager, vector, _llvm(vector.bits))


def _llvm(bits):
    return ir.VectorType(ir.IntType(bits), LANES)


VECTOR = {8: _Vector(8), 16: _Vector(16)}


def _broadcast(builder, scalar, bits):
    kind = _llvm(bits)
    undefined = ir.Constant(kind, ir.Undefined)
    single = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(
        single, undefined, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _call(builder, name, result, arguments):
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)


def _pointer(context, builder, array_type, array, index, bits):
    data = cgutils.create_struct_proxy(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), _llvm(bits).as_pointer())


@intrinsic
def load(typing, array, index):
    """Return the LANES elements of a flat array from `index` on."""
    bits = array.dtype.bitwidth
    signature = VECTOR[bits](array, types.intp)

    def generate(context, builder, signature, arguments):
        value = builder.load(_pointer(context, builder, signature.args[0], *arguments, bits))
        value.align = 1
        return value
    return signature, generate


@intrinsic
def peek(typing, array, index):
    """Return one element of a flat array, without the test for a negative index."""
    signature = array.dtype(array, types.intp)

    def generate(context, builder, signature, arguments):
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, arguments[0]).data
        return builder.load(builder.gep(data, [arguments[1]]))
    return signature, generate


@intrinsic
def store(typing, array, index, vector):
    """Write LANES elements of a flat array from `index` on."""
    signature = types.void(array, types.intp, vector)

    def generate(context, builder, signature, arguments):
        instruction = builder.store(arguments[2], _pointer(
            context, builder, signature.args[0], arguments[0], arguments[1], vector.bits))
        instruction.align = 1
        return context.get_dummy_value()
    return signature, generate


@intrinsic
def splat(typing, scalar):
    """Return a vector with the same number, uint8 or uint16, in every lane."""
    bits = scalar.bitwidth
    signature = VECTOR[bits](scalar)

    def generate(context, builder, signature, arguments):
        return _broadcast(builder, arguments[0], bits)
    return signature, generate


@intrinsic
def splat_like(typing, vector, number):
    """Return a vector of the kind of another with an integer, cut to its bits, in every lane."""
    signature = vector(vector, types.int64)

    def generate(context, builder, signature, arguments):
        scalar = builder.trunc(arguments[1], ir.IntType(vector.bits))
        return _broadcast(builder, scalar, vector.bits)
    return signature, generate


def _pairwise(generate_value):
    """Return an intrinsic of two vectors of one kind made by generate_value(builder, a, b)."""
    @intrinsic
    def pairwise(typing, a, b):
        signature = a(a, b)

        def generate(context, builder, signature, arguments):
            return generate_value(builder, *arguments)
        return signature, generate
    return pairwise


def _library(name):
    return _pairwise(lambda builder, a, b: _call(
        builder, f'llvm.{name}.v{LANES}i{a.type.element.width}', a.type, [a, b]))


def _instruction(name):
    return _pairwise(lambda builder, a, b: getattr(builder, name)(a, b))


def _shuffled(order):
    return _pairwise(lambda builder, a, b: builder.shuffle_vector(
        a, b, ir.Constant(ir.VectorType(ir.IntType(32), LANES), order)))


def _compared(relation):
    return _pairwise(lambda builder, a, b: builder.sext(
        builder.icmp_unsigned(relation, a, b), a.type))


minimum, maximum = _library('umin'), _library('umax')
saturating_add, saturating_subtract = _library('uadd.sat'), _library('usub.sat')
add, subtract = _instruction('add'), _instruction('sub')
bit_and, bit_or, bit_xor = (_instruction(name) for name in ('and_', 'or_', 'xor'))
# (before, labels) -> every lane gets the label below its own; (labels, after) -> the one above.
label_below = _shuffled([LANES - 1] + list(range(LANES, 2 * LANES - 1)))
label_above = _shuffled(list(range(1, LANES)) + [LANES])
# Comparisons: all bits of a lane set where true, 0 elsewhere.
equal, at_most, less = _compared('=='), _compared('<='), _compared('<')


@intrinsic
def narrow(typing, vector):
    """Return the low eight bits of each lane of a 16-bit vector."""
    signature = VECTOR[8](VECTOR[16])

    def generate(context, builder, signature, arguments):
        return builder.trunc(arguments[0], _llvm(8))
    return signature, generate


@intrinsic
def equal_bits(typing, a, b):
    """Return a uint32 with a bit set for each equal lane."""
    signature = types.uint32(a, b)

    def generate(context, builder, signature, arguments):
        return builder.bitcast(builder.icmp_unsigned('==', *arguments), ir.IntType(32))
    return signature, generate


@intrinsic
def choose(typing, mask, a, b):
    """Lanes of a where the mask is set, of b where it is 0."""
    signature = a(mask, a, b)

    def generate(context, builder, signature, arguments):
        zero = ir.Constant(arguments[0].type, [0] * LANES)
        condition = builder.icmp_unsigned('!=', arguments[0], zero)
        return builder.select(condition, arguments[1], arguments[2])
    return signature, generate


@intrinsic
def count_bits(typing, vector):
    """Return the number of set bits of each lane."""
    signature = VECTOR[8](VECTOR[8])

    def generate(context, builder, signature, arguments):
        return _call(builder, f'llvm.ctpop.v{LANES}i8', _llvm(8), [arguments[0]])
    return signature, generate


@intrinsic
def count_bits_of_word(typing, word):
    """Return the number of set bits of a uint32."""
    signature = types.int64(types.uint32)

    def generate(context, builder, signature, arguments):
        count = _call(builder, 'llvm.ctpop.i32', ir.IntType(32), [arguments[0]])
        return builder.zext(count, ir.IntType(64))
    return signature, generate


@intrinsic
def lowest(typing, vector):
    """Return the smallest lane as a scalar."""
    signature = types.uint8(VECTOR[8])

    def generate(context, builder, signature, arguments):
        return _call(builder, f'llvm.vector.reduce.umin.v{LANES}i8', ir.IntType(8),
                     [arguments[0]])
    return signature, generate


@intrinsic
def first_set(typing, bits):
    """Return the index of the lowest set bit of a uint32; 32 for 0."""
    signature = types.intp(types.uint32)

    def generate(context, builder, signature, arguments):
        false = ir.Constant(ir.IntType(1), 0)
        index = _call(builder, 'llvm.cttz.i32', ir.IntType(32), [arguments[0], false])
        return builder.zext(index, ir.IntType(64))
    return signature, generate


@intrinsic
def lane_numbers(typing):
    """Return 0, 1, 2, ... one a lane."""
    signature = VECTOR[8]()

    def generate(context, builder, signature, arguments):
        return ir.Constant(_llvm(8), list(range(LANES)))
    return signature, generate


@intrinsic
def shift_right(typing, vector, places):
    """Each lane divided by 2**places."""
    signature = vector(vector, types.int64)

    def generate(context, builder, signature, arguments):
        scalar = builder.trunc(arguments[1], ir.IntType(vector.bits))
        return builder.lshr(arguments[0], _broadcast(builder, scalar, vector.bits))
    return signature, generate


@intrinsic
def load_colours(typing, array, index):
    """Return the blue, green and red of LANES pixels of 8 bits from `index` on, in 16 bits."""
    signature = types.UniTuple(VECTOR[16], 3)(array, types.intp)

    def generate(context, builder, signature, arguments):
        wide = ir.VectorType(ir.IntType(8), 3 * LANES)
        data = cgutils.create_struct_proxy(signature.args[0])(context, builder, arguments[0]).data
        place = builder.bitcast(builder.gep(data, [arguments[1]]), wide.as_pointer())
        pixels = builder.load(place)
        pixels.align = 1
        channels = [builder.zext(builder.shuffle_vector(pixels, pixels, ir.Constant(
            ir.VectorType(ir.IntType(32), LANES), [3 * lane + channel for lane in range(LANES)])),
            _llvm(16)) for channel in range(3)]
        return context.make_tuple(builder, signature.return_type, channels)
    return signature, generate


@intrinsic
def shift_left(typing, vector, places):
    """Each lane times 2**places, cut to its bits."""
    signature = vector(vector, types.int64)

    def generate(context, builder, signature, arguments):
        scalar = builder.trunc(arguments[1], ir.IntType(vector.bits))
        return builder.shl(arguments[0], _broadcast(builder, scalar, vector.bits))
    return signature, generate


reversed_lanes = _shuffled(list(range(LANES - 1, -1, -1)))
