# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where two parents differ, sums over an exchange of their genes, and partition crossover.

An exchange: see crossover.Exchange. Partition crossover takes connected regions of cells whole, or
not at all (Whitley et al., Partition crossover for pseudo-Boolean optimization, 2009 and 2015).
Regions meet only where the parents agree, so that the gain is the sum over the regions taken.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import equal_bits, first_set, LANES, load
from fuzzy_stereo_ros.matching.kernels.union_find import join
import numpy as np


@kernel
def differing_cells(first, second, cells):
    """Write the cells where two chromosomes of labels differ; return how many there are."""
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
def copy_taken(cells, taken, first, second):
    """Give the first parent the genes of the second one at the cells that are taken, (R, C)."""
    ours, theirs = first.reshape(-1), second.reshape(-1)
    for index in range(cells.size):
        if taken[index]:
            ours[cells[index]] = theirs[cells[index]]


@inlined
def _at(region, place):
    """Return the region at a place, 0 for none; unsigned: no check for negative places."""
    return np.int64(region[np.uint64(place)])


@inlined
def _joined(parent, region, other):
    """Return the region of a cell that has two neighbours; 0 is none."""
    if region == 0 or other == 0 or region == other:
        return max(region, other)
    return join(parent, region, other)[0]


@kernel
def take_regions(changes, advantage, taken, region, parent, change):
    """
    Take each region of cells whose change of cost is negative; return the change of all taken.

    advantage: cost a cell by which a region must be the cheaper one; taken: bool (n,), which cells
    may be taken, then which are; region: int32 (R + 3, C + 1), the image with a border, 0 before
    and after; parent, change: int32 and int64 (m,), m > number of regions: memory, of the
    union-find of regions, from 1 on, and of their changes, each cell's with the advantage
    """
    cells, alone, pairs = changes
    diagonal, wide = pairs.shape[1] == 4, region.shape[1]
    known, row, columns, region = 1, 0, wide - 1, region.reshape(-1)
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        place = cells[index] + row + wide + 1
        if not taken[index]:
            continue
        left, up = _at(region, place - 1), _at(region, place - wide)
        cost = np.int64(alone[index]) + advantage
        cost += pairs[index, 0] if left != 0 else 0
        if diagonal:
            up_left, up_right = _at(region, place - wide - 1), _at(region, place - wide + 1)
            cost += pairs[index, 1] if up_left != 0 else 0
            cost += pairs[index, 2] if up != 0 else 0
            cost += pairs[index, 3] if up_right != 0 else 0
            # all others touch the cell above, and the left one touches that above it
            mine = up
            if mine == 0:
                mine = _joined(parent, left if left != 0 else up_left, up_right)
        else:
            cost += pairs[index, 1] if up != 0 else 0
            mine = _joined(parent, left, up)
        if mine == 0:
            mine = known
            parent[known], change[known] = known, 0
            known += 1
        region[place] = mine
        change[mine] += cost
    total, row = _choose(parent, change, known), 0
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        place = np.uint64(cells[index] + row + wide + 1)
        taken[index] = taken[index] and change[region[place]] < 0
        total -= advantage * taken[index]
        region[place] = 0
    return total


@called
def _choose(parent, change, known):
    """Let `change` be negative for regions to take, 0 for others; return the sum of the former."""
    total = np.int64(0)
    for region in range(known - 1, 0, -1):
        above = parent[region]
        if above != region:
            change[above] += change[region]
        elif change[region] < 0:
            total += change[region]
        else:
            change[region] = 0
    for region in range(1, known):
        change[region] = change[parent[region]]
    return total
