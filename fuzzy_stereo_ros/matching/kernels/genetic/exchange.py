# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where two parents differ, and sums over an exchange of their genes: see crossover.Exchange."""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import equal_bits, first_set, LANES, load
import numpy as np


@kernel
def differing_cells(first, second, cells):
    """
    Write where two chromosomes of labels differ; return at how many cells.

    first, second: uint8 or uint16 (R, C); cells: int32 (R * C + 1,), row * C + column, ascending.
    """
    number, ours, theirs = 0, first.reshape(-1), second.reshape(-1)
    whole = ours.size // LANES * LANES
    for start in range(0, whole, LANES):
        differ = ~equal_bits(load(ours, start), load(theirs, start))
        while differ != 0:
            cells[number] = start + first_set(differ)
            number += 1
            differ &= differ - np.uint32(1)
    for cell in range(whole, ours.size):
        cells[number] = cell
        number += ours[cell] != theirs[cell]
    return number


@inlined
def row_of(cell, row, columns):
    """Return the row of a cell, row * columns + column, from the row of an earlier one on."""
    while cell >= (row + 1) * columns:
        row += 1
    return row


@kernel
def total_change(alone, pairs):
    """Return what it changes to take all cells: int32 (n,) alone, (n, K) with neighbours."""
    total = np.int64(0)
    for index in range(alone.size):
        total += alone[index]
        for side in range(pairs.shape[1]):
            total += pairs[index, side]
    return total


@kernel
def widest(alone, pairs):
    """Return the largest absolute value of int32 (n,) and (n, K)."""
    low = high = np.int64(0)
    for index in range(alone.size):
        low, high = min(low, alone[index]), max(high, alone[index])
        for side in range(pairs.shape[1]):
            low, high = min(low, pairs[index, side]), max(high, pairs[index, side])
    return max(-low, high)


@kernel
def take_below(cells, alone, pairs, columns, row, taken):
    """
    Take the cells of a row and of those below; return the change of cost.

    cells, alone: int32 (n,); pairs: int32 (n, K), all but the left ones lead a row up; taken:
    bool (n,), written
    """
    total = np.int64(0)
    for index in range(cells.size):
        taken[index] = cells[index] >= row * columns
        if taken[index]:
            total += alone[index] + pairs[index, 0]
        if cells[index] >= (row + 1) * columns:
            for side in range(1, pairs.shape[1]):
                total += pairs[index, side]
    return total


@kernel
def copy_taken(cells, taken, first, second):
    """Give the first parent the genes of the second one at the cells that are taken, (R, C)."""
    ours, theirs = first.reshape(-1), second.reshape(-1)
    for index in range(cells.size):
        if taken[index]:
            ours[cells[index]] = theirs[cells[index]]
