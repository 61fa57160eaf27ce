# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The median of 5 x 5 labels, LANES at once, by exchanges of vectors in a fixed order."""
from itertools import combinations

from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.simd import (
    LANES, lanes_in_llvm, read, store, VECTOR, vector_call, write)
from numba import types
from numba.extending import intrinsic
import numpy as np

SIDE = 5
REACH, MIDDLE = SIDE // 2, SIDE**2 // 2 + 1


def _exchange(builder, lanes, low, high):
    """Put the lesser of two of some vectors at one place, lane by lane, the greater at another."""
    lanes[low], lanes[high] = (
        vector_call(builder, name, lanes[low], lanes[high]) for name in ('umin', 'umax'))


def _sorted(context, builder, kind, memory, places):
    """Return the vectors at some places of an array, sorted lane by lane."""
    lanes = [read(context, builder, kind, (memory, place), lanes_in_llvm(kind.dtype.bitwidth))
             for place in places]
    for low, high in combinations(range(SIDE), 2):
        _exchange(builder, lanes, low, high)
    return lanes


def _places(builder, first, step):
    """Return the indices of SIDE elements, `step` apart."""
    return [builder.add(first, builder.mul(step, step.type(number))) for number in range(SIDE)]


@intrinsic
def sort_column(typing, lines, ranked, column, width):
    """Write the vectors of SIDE lines from a column on, sorted lane by lane, to as many lines."""
    def generate(context, builder, signature, arguments):
        source, target, *place = arguments
        places = _places(builder, *place)
        for place, lanes in zip(places, _sorted(context, builder, lines, source, places)):
            write(context, builder, ranked, (target, place), lanes)
        return context.get_dummy_value()
    return types.void(lines, ranked, column, width), generate


@intrinsic
def median_of_columns(typing, ranked, column, width):
    """Return the medians of SIDE sorted columns from each column on."""
    def generate(context, builder, signature, arguments):
        memory, *place = arguments
        # sorted both ways: those with too many below or above them cannot be the median of all
        rest = [lanes for rank, first in enumerate(_places(builder, *place)) for near, lanes in
                enumerate(_sorted(context, builder, ranked, memory, _places(
                    builder, first, first.type(1))))
                if max((rank + 1) * (near + 1), (SIDE - rank) * (SIDE - near)) <= MIDDLE]
        kept, rest = rest[:len(rest) // 2 + 2], rest[len(rest) // 2 + 2:]
        while len(kept) > 1:        # of just over half of the rest neither can the extremes
            for place in range(1, len(kept)):
                _exchange(builder, kept, 0, place)
            for place in range(1, len(kept) - 1):
                _exchange(builder, kept, place, -1)
            kept, rest = kept[1:-1] + rest[:1], rest[1:]
        return kept[0]
    return VECTOR[ranked.dtype.bitwidth](ranked, column, width), generate


@kernel(allocates=True)
def square_median(labels, medians, first, last):
    """
    Write the median of 5 x 5 pixels, the border repeated, of the rows first to last - 1.

    labels: uint8 or uint16 (R, C or more); medians: the same, (R, C)
    """
    rows, columns = medians.shape
    width = columns + SIDE + LANES
    lines, ranked, found = (np.zeros(SIDE * width, labels.dtype),
                            np.zeros(SIDE * width, labels.dtype), np.zeros(width, labels.dtype))
    for row in range(first - REACH, last + REACH):
        source, line = labels[min(max(row, 0), rows - 1)], lines[row % SIDE * width:]
        line[:REACH], line[columns + REACH:columns + 2 * REACH] = source[0], source[columns - 1]
        copy_row(source, line[REACH:columns + REACH])
        if row >= first + REACH:    # whose columns are sorted: their order does not matter
            for column in range(0, columns + 2 * REACH, LANES):
                sort_column(lines, ranked, column, width)
            for column in range(0, columns, LANES):
                store(found, column, median_of_columns(ranked, column, width))
            copy_row(found, medians[row - REACH])
