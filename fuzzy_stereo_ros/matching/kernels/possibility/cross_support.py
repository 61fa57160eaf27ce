# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Means of costs over cross-shaped supports: pixels of like colour along rows and columns.

After Zhang, Lu and Lafruit, Cross-based local stereo matching, 2009. Not in the paper: the
possibility is more reliable when averaged over similar neighbours. Sums over arms are
differences of running sums, so that long arms cost no more than short ones. Running sums may
overflow: their differences do not.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, high_product, LANES, load, splat, store, subtract)
import numpy as np

LEFT, RIGHT, UP, DOWN = range(4)


class ArmRules(NamedTuple):
    """How far an arm reaches, and before which pixels it ends."""

    longest: int         # px
    near: int            # px
    alike: int           # least difference from the centre or the pixel before, in any channel
    much_alike: int      # least difference from the centre, farther than `near`
    level: float         # px of a parent's surface that are still at the level of the centre


@called
def _unlike(colours, row, column, other_row, other_column):
    """Return the largest difference of two pixels in any channel."""
    largest = 0
    for channel in range(3):
        largest = max(largest, abs(np.int64(colours[row, column, channel])
                                   - np.int64(colours[other_row, other_column, channel])))
    return largest


@kernel
def fill_arms(colours, surface, rules, arms, first, last):
    """
    Write how many pixels each arm reaches from its centre.

    colours: uint8 (R, C, 3); surface: float32 (R, C); rules: the fields of ArmRules; arms: uint8
    (R, C, 4), LEFT, RIGHT, UP, DOWN
    """
    longest, near, alike, much_alike, level = rules
    rows, columns = colours.shape[:2]
    for row in range(first, last):
        for column in range(columns):
            centre = surface[row, column]
            for arm in range(4):
                down = -1 if arm == UP else 1 if arm == DOWN else 0
                right = -1 if arm == LEFT else 1 if arm == RIGHT else 0
                reached = 0
                for step in range(1, longest + 1):
                    y, x = row + step * down, column + step * right
                    if y < 0 or y >= rows or x < 0 or x >= columns:
                        break
                    difference = _unlike(colours, row, column, y, x)
                    if (difference >= alike or step > near and difference >= much_alike
                            or abs(surface[y, x] - centre) > level):
                        break
                    if _unlike(colours, y, x, y - down, x - right) >= alike:
                        break
                    reached = step
                arms[row, column, arm] = reached


@inlined
def _store_mean(total, number, costs, place):
    """Write the mean of a number of costs from their totals."""
    if number > 1:
        total = high_product(add(total, splat(np.uint16(number >> 1))),
                             splat(np.uint16(65536 // number)))
    store(costs, place, total)


@kernel
def mean_over_rows(costs, arms, row_sums, first, last):
    """
    Replace each cost by the mean over the row arms of its pixel, in some rows.

    costs: uint16 (R, C, labels); row_sums: uint16 ((C + 1) * labels,), working memory
    """
    columns, labels = costs.shape[1:]
    flat = costs.reshape(-1)
    row_sums[:labels] = 0
    for row in range(first, last):
        begin = row * columns * labels
        for place in range(0, columns * labels, LANES):
            store(row_sums, place + labels, add(load(row_sums, place),
                                                load(flat, begin + place)))
        for column in range(columns):
            low = column - np.int64(arms[row, column, LEFT])
            high = column + np.int64(arms[row, column, RIGHT]) + 1
            for block in range(0, labels, LANES):
                total = subtract(load(row_sums, high * labels + block),
                                 load(row_sums, low * labels + block))
                _store_mean(total, high - low, flat, begin + column * labels + block)


@kernel
def mean_over_columns(costs, arms, longest, ring, first, last):
    """
    Replace each cost by the mean over the column arms of its pixel, in some columns.

    longest: of the arms; ring: uint16 (2 * longest + 2, some columns * labels), working memory
    """
    rows, columns, labels = costs.shape
    flat, span = costs.reshape(-1), 2 * longest + 2
    flat_ring, stride = ring.reshape(-1), ring.shape[1]
    ring[0] = 0
    for newest in range(rows + longest):
        if newest < rows:
            above, here = newest % span * stride, (newest + 1) % span * stride
            begin = (newest * columns + first) * labels
            for place in range(0, (last - first) * labels, LANES):
                store(flat_ring, here + place, add(load(flat_ring, above + place),
                                                   load(flat, begin + place)))
        row = newest - longest
        if row < 0:
            continue
        for column in range(first, last):
            up, down = np.int64(arms[row, column, UP]), np.int64(arms[row, column, DOWN])
            low = (row - up) % span * stride + (column - first) * labels
            high = (row + down + 1) % span * stride + (column - first) * labels
            for block in range(0, labels, LANES):
                total = subtract(load(flat_ring, high + block), load(flat_ring, low + block))
                _store_mean(total, up + down + 1, flat, (row * columns + column) * labels + block)
