# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Partition crossover: connected regions of cells are taken whole, or not at all.

After Whitley et al., Partition crossover for pseudo-Boolean optimization, 2009 and 2015. Regions
meet only where the parents agree, so that what is gained is the sum over the regions taken.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import row_of
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import root
import numpy as np


@inlined
def _joined(parent, region, other):
    """Return the region of a cell that has two neighbours; 0 is none."""
    if region == 0 or region == other:
        return other
    one, two = root(parent, region), root(parent, other)
    parent[max(one, two)] = min(one, two)
    return region


@kernel
def take_regions(cells, alone, pairs, columns, advantage, taken, region, parent, change, size):
    """
    Take each region of cells whose change of cost is negative; return the change of all taken.

    cells: int32 (n,), row * columns + column, ascending; alone: int32 (n,); pairs: int32 (n, K);
    see crossover.Exchange; advantage: cost a cell by which a region must be the cheaper one.
    taken: bool (n,), which cells may be taken, then which are; region: int32 (n,), parent: int32
    (m,), change: int64 (m,), size: int32 (m,), with m > number of regions, working memory.
    """
    diagonal = 1 if pairs.shape[1] == 4 else 0
    known, row, above = 1, 0, 0
    for index in range(cells.size):
        cell = np.int64(cells[index])
        row = row_of(cell, row, columns)
        column = cell - row * columns
        first = cell - columns - (diagonal if column > 0 else 0)
        last = cell - columns + (diagonal if column + 1 < columns else 0)
        while cells[above] < first:
            above += 1
        if not taken[index]:
            continue
        mine, cost = 0, np.int64(alone[index])
        if column > 0 and index > 0 and cells[index - 1] == cell - 1 and taken[index - 1]:
            mine = region[index - 1]
            cost += pairs[index, 0]
        other = above
        while cells[other] <= last:
            if taken[other]:
                mine = _joined(parent, mine, region[other])
                cost += pairs[index, 1 + diagonal + cells[other] - (cell - columns)]
            other += 1
        if mine == 0:
            mine = known
            parent[known], change[known], size[known] = known, 0, 0
            known += 1
        region[index] = mine
        change[mine] += cost
        size[mine] += 1
    total = _choose(parent, change, size, known, advantage)
    for index in range(cells.size):
        if taken[index]:
            taken[index] = change[region[index]] < 0
    return total


@kernel
def _choose(parent, change, size, known, advantage):
    """Let `change` be negative for regions to take, 0 for others; return the sum of the former."""
    total = np.int64(0)
    for region in range(known - 1, 0, -1):
        above = parent[region]
        if above != region:
            change[above] += change[region]
            size[above] += size[region]
        elif change[region] + advantage * size[region] < 0:
            total += change[region]
        else:
            change[region] = 0
    for region in range(1, known):
        change[region] = change[parent[region]]
    return total
