# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fill rejected pixels from their row, and the membership median.

In the left image a nearer object hides a strip at its left, as wide as the jump of disparity. A
rejected run that is not such a strip is a mismatch, so it is not filled as background. At a jump
of disparity the membership median is the median of the neighbours of similar grey: a crisp form of
the fuzzy class of a pixel in its 7 x 7 neighbours.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import next_byte
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.rows import copy_row, pad_row
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, at_most, bit_and, bit_or, choose, equal_bits, LANES, less, load,
    maximum, minimum, saturating_subtract, shift_right, splat_like, store, subtract)
from fuzzy_stereo_ros.matching.kernels.units import INVALID
import numpy as np

WIDEST = 3       # a run is no hidden strip when it is wider than so many jumps ...
BESIDE = 2       # ... and the columns beside it that an edge makes inconsistent


@kernel
def fill_rows(labels, validity, filled, first, last):
    """
    Copy the labels and fill each rejected run with the background label or that of its nearer end.

    A row without consistent labels takes those of the nearest row above, or 0 where none has any.
    """
    columns, source = labels.shape[1], first
    while source >= 0 and next_byte(validity[source], 0, INVALID, False) == columns:
        source -= 1
    for row in range(first, last):
        if next_byte(validity[row], 0, INVALID, False) < columns:
            source = row
        line = filled[row]
        if source < 0:
            line[:] = 0
            continue
        seen = validity[source]
        copy_row(labels[source], line)
        column = 0
        while True:
            begin = next_byte(seen, column, INVALID, True)
            if begin == columns:
                break
            column = next_byte(seen, begin, INVALID, False)
            behind = line[begin - 1] if begin > 0 else line[column]
            label, middle = line[column] if column < columns else behind, (begin + column + 1) // 2
            jump = np.int64(label) - np.int64(behind)
            if jump > 0 and column - begin <= WIDEST * jump + BESIDE:
                middle = column
            line[begin:middle] = behind
            line[middle:column] = label


MEDIAN_RADIUS = 3
MEDIAN_NEIGHBOURS = (2 * MEDIAN_RADIUS + 1) ** 2
ALL_EQUAL = 2**32 - 1


@called
def _pad(values, columns, padded, first, last):
    """
    Copy a map into one with MEDIAN_RADIUS pixels around, its border repeated.

    So far as the rows first .. last - 1 and those around them need it.
    """
    rows = padded.shape[0] - 2 * MEDIAN_RADIUS
    for row in range(max(first - MEDIAN_RADIUS, 0), min(last + MEDIAN_RADIUS, rows)):
        copy_row(values[row], padded[row + MEDIAN_RADIUS, MEDIAN_RADIUS:MEDIAN_RADIUS + columns])
        pad_row(padded, row, columns, MEDIAN_RADIUS)


@called
def _median(drops, count, span, bits):
    """Return the median of `count` drops, at most `span`, bit by bit; the other drops are 0."""
    limit = subtract(splat_like(count, MEDIAN_NEIGHBOURS), shift_right(count, 1))
    # A pixel counts itself, which LLVM does not know: else it compares by masks, half as fast.
    zero, one = splat_like(count, 0), minimum(count, splat_like(count, 1))
    result = zero
    for place in range(bits - 1, -1, -1):
        bit = splat_like(count, 1 << place)
        if equal_bits(less(span, bit), zero) == 0:
            continue
        candidate = bit_or(result, bit)
        below = zero
        for neighbour in range(MEDIAN_NEIGHBOURS):
            drop = load(drops, LANES * neighbour)
            below = add(below, minimum(saturating_subtract(candidate, drop), one))
        result = choose(less(below, limit), candidate, result)
    return result


@inlined
def _extremes_of_columns(source, stride, row, columns, low, high):
    """Write the least and the largest label of each column of seven rows, of a padded map."""
    for column in range(0, columns + 2 * MEDIAN_RADIUS, LANES):
        place = row * stride + column
        least = largest = load(source, place)
        for down in range(1, 2 * MEDIAN_RADIUS + 1):
            other = load(source, place + down * stride)
            least, largest = minimum(least, other), maximum(largest, other)
        store(low, column, least)
        store(high, column, largest)


@kernel(allocates=True)
def membership_median(chromosome, levels, padded, reach, bits, out, first, last):
    """
    Take the median over similar neighbours where the 7 x 7 pixels span more than one label.

    chromosome: (R, C) labels; levels: of grey, uint8 (R, C or more); padded: memory for both,
    (R + 6, C + 70) of one dtype, uint8 or uint16; reach: grey levels by which similar pixels
    differ at most; bits: of the largest label; out: (R, C + 64)
    """
    (labels, grey_levels), columns = padded, chromosome.shape[1]
    _pad(chromosome, columns, labels, first, last)
    _pad(levels, columns, grey_levels, first, last)
    stride, out_stride = labels.shape[1], out.shape[1]
    source, grey, target = labels.reshape(-1), grey_levels.reshape(-1), out.reshape(-1)
    neighbours = np.zeros(MEDIAN_NEIGHBOURS * LANES, labels.dtype)
    lows, highs = np.zeros(stride + LANES, labels.dtype), np.zeros(stride + LANES, labels.dtype)
    for row in range(first, last):
        _extremes_of_columns(source, stride, row, columns, lows, highs)
        for column in range(0, columns, LANES):
            centre = (row + MEDIAN_RADIUS) * stride + column + MEDIAN_RADIUS
            here, low, high = load(source, centre), load(lows, column), load(highs, column)
            for right in range(1, 2 * MEDIAN_RADIUS + 1):
                low = minimum(low, load(lows, column + right))
                high = maximum(high, load(highs, column + right))
            jump = less(splat_like(here, 1), subtract(high, low))
            if equal_bits(jump, splat_like(here, 0)) == ALL_EQUAL:
                store(target, row * out_stride + column, here)
                continue
            centre_grey, alike = load(grey, centre), splat_like(here, reach)
            count, neighbour = splat_like(here, 0), 0
            for down in range(-MEDIAN_RADIUS, MEDIAN_RADIUS + 1):
                for right in range(-MEDIAN_RADIUS, MEDIAN_RADIUS + 1):
                    place = centre + down * stride + right
                    like = at_most(absolute_difference(load(grey, place), centre_grey), alike)
                    count = subtract(count, like)
                    store(neighbours, LANES * neighbour,
                          bit_and(subtract(high, load(source, place)), like))
                    neighbour += 1
            store(target, row * out_stride + column,
                  choose(jump, subtract(high, _median(
                      neighbours, count, subtract(high, low), bits)), here))
