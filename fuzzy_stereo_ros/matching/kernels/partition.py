# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Partition crossover: where two parents differ, each connected region takes the fitter one's genes.

After Whitley et al., Partition crossover, 2009 (`fusion moves` in the literature of Markov random
fields). Regions meet only where the parents agree, so that the cost of the child is the sum of
the cheaper region costs: it is at least as fit as both parents.
"""
from fuzzy_stereo_ros.matching.kernels.consistency import root
from fuzzy_stereo_ros.matching.kernels.gene_cost import jump_cost
from numba import njit
import numpy as np


@njit(nogil=True, cache=True)
def partition_crossover(penalties, mother, mother_costs, father, father_costs, regions, parent,
                        change):
    """
    Give the mother each region of differing genes in which the father is fitter.

    mother, father: (R, C) labels; mother_costs, father_costs: uint8 (R, C), what the genes cost,
    the father's only where they differ; regions: int32 (R, C), parent, change: int32
    (R * C // 2 + 2,), working memory. Returns the cost saved, and what the father costs more
    than the mother did.
    """
    rows, columns = mother.shape
    small, penalties_across, penalties_down = penalties.small, penalties.across, penalties.down
    known = 1
    for row in range(rows):
        for column in range(columns):
            old, new = np.int64(mother[row, column]), np.int64(father[row, column])
            left = regions[row, column - 1] if column > 0 else 0
            above = regions[row - 1, column] if row > 0 else 0
            region = 0
            if old != new:
                if left > 0:
                    region = left
                    if above > 0 and above != left:
                        one, two = root(parent, left), root(parent, above)
                        parent[max(one, two)] = min(one, two)
                elif above > 0:
                    region = above
                else:
                    region = known
                    parent[known] = known
                    change[known] = 0
                    known += 1
                change[region] += (np.int64(father_costs[row, column])
                                   - np.int64(mother_costs[row, column]))
            regions[row, column] = region
            if column > 0 and region + left > 0:
                jump = penalties_across[row, column]
                change[region if region > 0 else left] += (
                    jump_cost(new, np.int64(father[row, column - 1]), small, jump)
                    - jump_cost(old, np.int64(mother[row, column - 1]), small, jump))
            if row > 0 and region + above > 0:
                jump = penalties_down[row, column]
                change[region if region > 0 else above] += (
                    jump_cost(new, np.int64(father[row - 1, column]), small, jump)
                    - jump_cost(old, np.int64(mother[row - 1, column]), small, jump))
    saved = total = 0
    for region in range(known - 1, 0, -1):
        if parent[region] != region:
            change[parent[region]] += change[region]
            continue
        total += change[region]
        saved -= min(change[region], 0)
    for region in range(1, known):
        change[region] = change[parent[region]]
    for row in range(rows):
        for column in range(columns):
            region = regions[row, column]
            if region > 0 and change[region] < 0:
                mother[row, column] = father[row, column]
                mother_costs[row, column] = father_costs[row, column]
    return saved, total
