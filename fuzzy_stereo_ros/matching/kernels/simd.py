# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Vectors of 32 or more small whole numbers, as values inside of kernels.

Everything is portable LLVM (no instruction of a special processor is named), so the same source
runs on SSE, AVX2, AVX-512 and NEON. Loads and stores need no alignment and check no bounds.
"""
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

LANES = 32
LINE = 64       # bytes of a cache line


class _Vector(types.Type):
    """The type of a vector of unsigned integers of a number of bits."""

    def __init__(self, bits, lanes=LANES):
        self.bits, self.lanes = bits, lanes
        super().__init__(name=f'Vector{lanes}x{bits}')


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):
    """Vectors live in registers as the LLVM vectors that they are."""

    def __init__(self, manager, vector):
        super().__init__(manager, vector, lanes_in_llvm(vector.bits, vector.lanes))


def lanes_in_llvm(bits, lanes=LANES):
    """Return what LLVM calls a vector of a number of lanes."""
    return ir.VectorType(ir.IntType(bits), lanes)


VECTOR = {bits: _Vector(bits) for bits in (8, 16, 32)}


def broadcast(builder, scalar, lanes=LANES):
    """Return a vector with a number in every lane."""
    undefined = ir.Constant(ir.VectorType(scalar.type, lanes), ir.Undefined)
    single = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    return shuffled(builder, single, undefined, [0] * lanes)


# What modules of intrinsics generate code with: lanes_in_llvm, broadcast and these.


def generated(signature, generate):
    """Return what an intrinsic returns, whose code is that of generate(builder, *arguments)."""
    return signature, lambda context, builder, _, arguments: generate(builder, *arguments)


def shuffled(builder, one, other, order):
    """Return the lanes of two vectors in an order: those of the other are numbered on."""
    return builder.shuffle_vector(one, other, ir.Constant(
        ir.VectorType(ir.IntType(32), len(order)), order))


def llvm_call(builder, name, result, arguments):
    """Return what a function of LLVM returns; result: its type."""
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)


def vector_call(builder, name, *vectors):
    """Return the vector that a function of LLVM makes of vectors of its own type."""
    kind = vectors[0].type
    return llvm_call(builder, f'llvm.{name}.v{kind.count}i{kind.element.width}', kind, vectors)


def place_of(context, builder, memory_type, memory, index, kind):
    """Return a pointer to the element `index`: of an array, or of the bytes at an address."""
    if isinstance(memory_type, types.Integer):
        data = builder.inttoptr(memory, ir.IntType(8).as_pointer())
    else:
        data = cgutils.create_struct_proxy(memory_type)(context, builder, memory).data
    return builder.bitcast(builder.gep(data, [index]), kind.as_pointer())


def read(context, builder, memory_type, place, kind):
    """Return the vector of a type of LLVM at a place: a memory, and the index of its element."""
    value = builder.load(place_of(context, builder, memory_type, *place, kind))
    value.align = 1
    return value


def write(context, builder, memory_type, place, vector):
    """Write a vector to a place, see `read`; return what an intrinsic without a result does."""
    builder.store(vector, place_of(context, builder, memory_type, *place, vector.type)).align = 1
    return context.get_dummy_value()


@intrinsic
def load(typing, array, index):
    """Return the LANES elements of a flat array, or bytes at an address, from `index` on."""
    bits = 8 if isinstance(array, types.Integer) else array.dtype.bitwidth
    return VECTOR[bits](array, types.intp), lambda context, builder, _, place: read(
        context, builder, array, place, lanes_in_llvm(bits))


@intrinsic
def load_like(typing, vector, array, index):
    """Return as many bytes, of a flat array or at an address, as a vector has lanes."""
    return vector(vector, array, types.intp), lambda context, builder, _, arguments: read(
        context, builder, array, arguments[1:], arguments[0].type)


@intrinsic
def store(typing, array, index, vector):
    """Write LANES elements of a flat array, or bytes at an address, from `index` on."""
    return types.void(array, types.intp, vector), lambda context, builder, _, arguments: write(
        context, builder, array, arguments[:2], arguments[2])


@intrinsic
def prefetch(typing, address):
    """Have the cache line at an address on its way; it may lie outside of any array."""
    def generate(context, builder, signature, arguments):
        place = builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())
        llvm_call(builder, 'llvm.prefetch.p0i8', ir.VoidType(), [
            place, *map(ir.IntType(32), (0, 3, 1))])    # to read, into all caches, data
        return context.get_dummy_value()
    return types.void(types.intp), generate


@intrinsic
def splat(typing, scalar):
    """Return a vector with the same number, uint8, uint16 or float32, in every lane."""
    return generated(VECTOR[scalar.bitwidth](scalar), lambda builder, number: builder.bitcast(
        broadcast(builder, number), lanes_in_llvm(scalar.bitwidth)))


@intrinsic
def splat_like(typing, vector, number):
    """Return a vector of the kind of another with an integer, cut to its bits, in every lane."""
    return generated(vector(vector, types.int64), lambda builder, _, whole: broadcast(
        builder, builder.trunc(whole, ir.IntType(vector.bits)), vector.lanes))


def _pairwise(generate):
    """Return an intrinsic of two vectors of one kind made by generate(builder, a, b)."""
    @intrinsic
    def pairwise(typing, a, b):
        return generated(a(a, b), generate)
    return pairwise


def _library(name):
    return _pairwise(lambda builder, a, b: vector_call(builder, name, a, b))


def _instruction(name):
    return _pairwise(lambda builder, a, b: getattr(builder, name)(a, b))


def _of_floats(generate):
    """Return an intrinsic of two vectors whose lanes hold float32 numbers."""
    return _pairwise(lambda builder, *both: builder.bitcast(generate(builder, *(
        builder.bitcast(lanes, ir.VectorType(ir.FloatType(), lanes.type.count))
        for lanes in both)), both[0].type))


def _in_order(order_of):
    return _pairwise(lambda builder, a, b: shuffled(
        builder, a, b, list(order_of(a.type.count))))


def _shifted(name):
    """Return an intrinsic of a vector and of the number of bits to shift each of its lanes by."""
    @intrinsic
    def shift(typing, vector, places):
        return generated(vector(vector, types.int64), lambda builder, lanes, number: getattr(
            builder, name)(lanes, broadcast(
                builder, builder.trunc(number, ir.IntType(vector.bits)), vector.lanes)))
    return shift


def _compared(relation):
    return _pairwise(lambda builder, a, b: builder.sext(
        builder.icmp_unsigned(relation, a, b), a.type))


minimum, maximum = _library('umin'), _library('umax')
signed_minimum, signed_maximum = _library('smin'), _library('smax')
saturating_add, saturating_subtract = _library('uadd.sat'), _library('usub.sat')
absolute_difference = _pairwise(lambda builder, a, b: builder.or_(
    vector_call(builder, 'usub.sat', a, b), vector_call(builder, 'usub.sat', b, a)))
add, subtract, multiply = (_instruction(name) for name in ('add', 'sub', 'mul'))
add_floats, multiply_floats = _of_floats(ir.IRBuilder.fadd), _of_floats(ir.IRBuilder.fmul)
least_float = _of_floats(lambda builder, a, b: builder.select(
    builder.fcmp_ordered('<', a, b), a, b))
bit_and, bit_or, bit_xor = (_instruction(name) for name in ('and_', 'or_', 'xor'))
# (before, labels) -> every lane gets the label below its own; (labels, after) -> the one above.
label_below = _in_order(lambda lanes: range(lanes - 1, 2 * lanes - 1))
label_above = _in_order(lambda lanes: range(1, lanes + 1))
# of the first of two vectors
reversed_lanes = _in_order(lambda lanes: range(lanes - 1, -1, -1))
neighbours = _in_order(lambda lanes: [lane ^ 1 for lane in range(lanes)])
# Each lane divided by, or multiplied by, 2**places and cut to its bits.
shift_right, shift_left = _shifted('lshr'), _shifted('shl')
# Comparisons: all bits of a lane set where true, 0 elsewhere.
equal, at_most, less = _compared('=='), _compared('<='), _compared('<')


@intrinsic
def narrow(typing, vector):
    """Return the low eight bits of each lane of a vector of 16 bits, or of 8."""
    return generated(VECTOR[8](vector), lambda builder, wide: (
        wide if vector.bits == 8 else builder.trunc(wide, lanes_in_llvm(8))))


@intrinsic
def widen(typing, vector):
    """Return a vector of 8-bit lanes with 16 bits in each."""
    return generated(VECTOR[16](VECTOR[8]),
                     lambda builder, lanes: builder.zext(lanes, lanes_in_llvm(16)))


@intrinsic
def total(typing, vector):
    """Return the sum of the lanes of a 16-bit vector."""
    def generate(builder, lanes):
        sum_of_lanes = llvm_call(builder, f'llvm.vector.reduce.add.v{LANES}i32', ir.IntType(32),
                                 [builder.zext(lanes, lanes_in_llvm(32))])
        return builder.zext(sum_of_lanes, ir.IntType(64))
    return generated(types.int64(VECTOR[16]), generate)


@intrinsic
def equal_bits(typing, a, b):
    """Return a uint32 with a bit set for each equal lane."""
    return generated(types.uint32(a, b), lambda builder, one, other: builder.bitcast(
        builder.icmp_unsigned('==', one, other), ir.IntType(one.type.count)))


@intrinsic
def first_set(typing, bits):
    """Return the index of the lowest set bit of a uint32 or uint64; their size for 0."""
    return generated(types.intp(bits), lambda builder, word: builder.zext(llvm_call(
        builder, f'llvm.cttz.i{bits.bitwidth}', word.type, [word, ir.IntType(1)(0)]),
        ir.IntType(64)))


@intrinsic
def choose(typing, mask, a, b):
    """Return the lanes of a where the mask is not 0, of b where it is."""
    return generated(a(mask, a, b), lambda builder, flags, one, other: builder.select(
        builder.icmp_unsigned('!=', flags, flags.type([0] * mask.lanes)), one, other))


@intrinsic
def count_bits(typing, vector):
    """Return the number of set bits of each lane."""
    return generated(vector(vector), lambda builder, lanes: vector_call(builder, 'ctpop', lanes))


@intrinsic
def count_bits_of_word(typing, word):
    """Return the number of set bits of a uint32."""
    return generated(types.int64(types.uint32), lambda builder, bits: builder.zext(
        llvm_call(builder, 'llvm.ctpop.i32', bits.type, [bits]), ir.IntType(64)))


@intrinsic
def lowest(typing, vector):
    """Return the smallest lane as a scalar."""
    bits = vector.bits
    return generated(
        (types.uint8 if bits == 8 else types.uint16)(vector), lambda builder, lanes: llvm_call(
            builder, f'llvm.vector.reduce.umin.v{vector.lanes}i{bits}', ir.IntType(bits),
            [lanes]))


@intrinsic
def lane_numbers(typing, vector):
    """Return 0, 1, 2, ... one a lane, in a vector like another."""
    return generated(vector(vector), lambda builder, lanes: lanes.type(list(range(vector.lanes))))


def _high_product(extend):
    """Return an intrinsic of the upper 16 bits of the products of the lanes of two vectors."""
    def generate(builder, *both):
        wide = [getattr(builder, extend)(lanes, lanes_in_llvm(32)) for lanes in both]
        return builder.trunc(builder.lshr(builder.mul(*wide), broadcast(
            builder, ir.IntType(32)(16))), lanes_in_llvm(16))
    return _pairwise(generate)


high_product, signed_high_product = _high_product('zext'), _high_product('sext')


@intrinsic
def pair_products(typing, a, b):
    """Return the sums of two products of neighbouring signed 16-bit lanes, in 32 bits."""
    def generate(builder, *both):
        products = builder.mul(*(builder.sext(lanes, lanes_in_llvm(32)) for lanes in both))
        return builder.add(*(shuffled(builder, products, products, list(range(odd, LANES, 2)))
                             for odd in range(2)))
    return generated(_Vector(32, LANES // 2)(a, b), generate)


def _of_halves(name):
    """Return an intrinsic of a 32-bit vector: an int64 of each half of its lanes."""
    @intrinsic
    def of_halves(typing, vector):
        half = vector.lanes // 2

        def generate(context, builder, signature, arguments):
            return context.make_tuple(builder, signature.return_type, [builder.sext(llvm_call(
                builder, f'llvm.vector.reduce.{name}.v{half}i32', ir.IntType(32),
                [shuffled(builder, *arguments, *arguments, list(range(begin, begin + half)))]),
                ir.IntType(64)) for begin in (0, half)])
        return types.UniTuple(types.int64, 2)(vector), generate
    return of_halves


sums_of_halves, largest_of_halves = _of_halves('add'), _of_halves('smax')


@intrinsic
def transpose(typing, square, stride):
    """Transpose LANES lines of as many bytes in their place, an address; stride: between lines."""
    def generate(context, builder, signature, arguments):
        begin, half, places = arguments[0], LANES // 2, []
        for _ in range(LANES):
            places.append(builder.inttoptr(begin, lanes_in_llvm(8).as_pointer()))
            begin = builder.add(begin, arguments[1])
        lines = [builder.load(place) for place in places]
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
        for near, ends in enumerate(zip(places[:half], places[half:])):
            for side, place in zip((0, half), ends):
                order = [start + side + lane for start in (0, LANES) for lane in range(half)]
                builder.store(shuffled(
                    builder, sides[0][near], sides[1][near], order), place).align = 1
        return context.get_dummy_value()
    return types.void(types.intp, types.intp), generate
