# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Partition crossover: where two parents differ, each connected region takes the fitter one's genes.

After Whitley et al., Partition crossover, 2009 (`fusion moves` in the literature of Markov random
fields). Regions meet only where the parents agree, so that the cost of the child is the sum of
the cheaper region costs: it is at least as fit as both parents, where no advantage is
asked for. With one, regions of little difference stay the mother's: a fitness is not the truth.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.genetic.gene_cost import jump_cost
from fuzzy_stereo_ros.matching.kernels.regions import region_of, row_of
from fuzzy_stereo_ros.matching.kernels.simd import equal_bits, first_set, LANES, load
import numpy as np


@kernel
def differing_cells(mother, father, cells):
    """
    Write where two chromosomes differ; return at how many cells.

    cells: int32 (R * C + 1,), row * C + column, ascending.
    """
    number, mothers, fathers = 0, mother.reshape(-1), father.reshape(-1)
    whole = mothers.size // LANES * LANES
    for start in range(0, whole, LANES):
        differ = ~equal_bits(load(mothers, start), load(fathers, start))
        while differ != 0:
            cells[number] = start + first_set(differ)
            number += 1
            differ &= differ - np.uint32(1)
    for cell in range(whole, mothers.size):
        cells[number] = cell
        number += mothers[cell] != fathers[cell]
    return number


@kernel
def partition_crossover(small, across, down, mother, mother_costs, father, father_costs, cells,
                        advantage, regions, parent, change, size):
    """
    Give the mother each region of differing genes in which the father is fitter.

    small, across, down: Penalties; mother, father: (R, C) labels; mother_costs, father_costs:
    uint8 (R, C), what the genes cost where they differ; cells: int32, where that is, ascending;
    advantage: cost a cell by which a region must be the cheaper one to be taken; regions: int32
    (R, C), all 0 before and after; parent, change, size: int32 (R * C // 2 + 2,), working memory.
    Returns the cost saved, and what the father costs more than the mother did.
    """
    rows, columns = mother.shape
    known, row = 1, 0
    for cell in cells:
        row = row_of(cell, row, columns)
        column = cell - row * columns
        left = regions[row, column - 1] if column > 0 else 0
        above = regions[row - 1, column] if row > 0 else 0
        region = region_of(parent, left, above, known)
        if region == known:
            change[known] = 0
            size[known] = 0
            known += 1
        regions[row, column] = region
        old, new = np.int64(mother[row, column]), np.int64(father[row, column])
        dearer = np.int64(father_costs[row, column]) - np.int64(mother_costs[row, column])
        if column > 0:
            jump = across[row, column]
            dearer += (jump_cost(new, np.int64(father[row, column - 1]), small, jump)
                       - jump_cost(old, np.int64(mother[row, column - 1]), small, jump))
        if row > 0:
            jump = down[row, column]
            dearer += (jump_cost(new, np.int64(father[row - 1, column]), small, jump)
                       - jump_cost(old, np.int64(mother[row - 1, column]), small, jump))
        # The jumps to the right and down are counted there, if genes differ there.
        if column + 1 < columns and mother[row, column + 1] == father[row, column + 1]:
            after, jump = np.int64(mother[row, column + 1]), across[row, column + 1]
            dearer += jump_cost(new, after, small, jump) - jump_cost(old, after, small, jump)
        if row + 1 < rows and mother[row + 1, column] == father[row + 1, column]:
            below, jump = np.int64(mother[row + 1, column]), down[row + 1, column]
            dearer += jump_cost(new, below, small, jump) - jump_cost(old, below, small, jump)
        change[region] += dearer
        size[region] += 1
    saved = total = 0
    for region in range(known - 1, 0, -1):
        if parent[region] != region:
            change[parent[region]] += change[region]
            size[parent[region]] += size[region]
            continue
        total += change[region]
        if change[region] + advantage * size[region] >= 0:
            change[region] = 0
        saved -= change[region]
    for region in range(1, known):
        change[region] = change[parent[region]]
    mothers, fathers = mother.reshape(-1), father.reshape(-1)
    costs, other_costs, marks = (
        mother_costs.reshape(-1), father_costs.reshape(-1), regions.reshape(-1))
    for cell in cells:
        if change[marks[cell]] < 0:
            mothers[cell] = fathers[cell]
            costs[cell] = other_costs[cell]
        marks[cell] = 0
    return saved, total
