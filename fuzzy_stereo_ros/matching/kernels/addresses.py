# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read, write and find single numbers in arrays and at addresses, without a check of bounds.

Kernels that get addresses instead of arrays compile in a fraction of the time. Numbers are found
by value or by rank; numba needs seconds to compile NumPy's functions for that.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.simd import equal_bits, first_set, LANES, load, splat
from numba import types
from numba.extending import intrinsic
import numpy as np


def address_of(array):
    """Return the address of an array for kernels; the caller keeps the array alive."""
    if not array.flags.c_contiguous:
        raise ValueError(f'an array {array.shape} of strides {array.strides} is not contiguous')
    return array.__array_interface__['data'][0]     # in half the time of array.ctypes.data


def _element(context, builder, kind, address, index):
    """Return a pointer to a number of a kind, `index` numbers behind an address."""
    start = builder.inttoptr(address, context.get_value_type(kind).as_pointer())
    return builder.gep(start, [index])


def _reading(kind):
    """Return an intrinsic that reads a number of a kind from an address on."""
    @intrinsic
    def read(typing, address, index):
        return kind(types.intp, types.intp), lambda context, builder, _, arguments: builder.load(
            _element(context, builder, kind, *arguments))
    return read


def _writing(kind):
    """Return an intrinsic that writes a number, cut to a kind, from an address on."""
    @intrinsic
    def write(typing, address, index, number):
        def generate(context, builder, signature, arguments):
            builder.store(arguments[2], _element(context, builder, kind, *arguments[:2]))
            return context.get_dummy_value()
        return types.void(types.intp, types.intp, kind), generate
    return write


# (address, index) -> the number there; (address, index, number) writes it
load_byte, load_short, load_long = map(_reading, (types.uint8, types.uint16, types.int64))
store_byte, store_short, store_long = map(_writing, (types.uint8, types.uint16, types.int64))


@inlined
def next_byte(numbers, at, number, equal):
    """
    Return the first index from `at` on where a flat uint8 array has a number, else its size.

    equal: False for the first index where it has another number
    """
    while at + LANES <= numbers.size:
        bits = equal_bits(load(numbers, at), splat(np.uint8(number)))
        bits = bits if equal else ~bits
        if bits != 0:
            return at + first_set(bits)
        at += LANES
    while at < numbers.size and (numbers[at] == number) != equal:
        at += 1
    return at


@called
def of_rank(values, number, rank):
    """Return the one of the first values that has so many before it; their order changes."""
    low, high = 0, number - 1
    while low < high:       # quickselect
        pivot, left, right = values[rank], low, high
        while left <= right:
            while values[left] < pivot:
                left += 1
            while values[right] > pivot:
                right -= 1
            if left <= right:
                values[left], values[right] = values[right], values[left]
                left, right = left + 1, right - 1
        if right < rank:
            low = left
        if rank < left:
            high = right
    return values[rank]
