# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Partition crossover of maps in parts of a pixel: each region takes the fitter parent's genes.

As kernels/partition.py has it for labels. Here a step of disparity costs nothing up to a slope
that surfaces have, then in proportion, up to a jump.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.genetic.surface_cost import step_cost
from fuzzy_stereo_ros.matching.kernels.regions import region_of


@kernel
def cross_regions(mother, mother_costs, father, father_costs, across, down, slope, free, jump,
                  apart, regions, parent, change):
    """
    Give the mother each region of differing genes in which the father is fitter.

    mother, father: float32 (R, C), px; mother_costs, father_costs: float32 (R, C), what the genes
    cost; across, down: float32 (R, C), weight of a step from the left, from above; slope, jump: a
    step costs slope a px beyond `free`, at most jump; apart: px by which genes differ that count
    as different; regions: int32 (R, C), parent: int32 (R * C // 2 + 2,), change: float64
    likewise, working memory. Returns the cost saved, and what the father costs more than the
    mother did.
    """
    rows, columns = mother.shape
    known = 1
    for row in range(rows):
        for column in range(columns):
            old, new = mother[row, column], father[row, column]
            left = regions[row, column - 1] if column > 0 else 0
            above = regions[row - 1, column] if row > 0 else 0
            region = 0
            if abs(old - new) > apart:
                region = region_of(parent, left, above, known)
                if region == known:
                    change[known] = 0
                    known += 1
                change[region] += father_costs[row, column] - mother_costs[row, column]
            regions[row, column] = region
            for side in range(2):
                other = above if side else left
                if region + other == 0 or (row if side else column) == 0:
                    continue
                y, x = row - side, column - 1 + side
                weight = down[row, column] if side else across[row, column]
                one = new if region > 0 else old
                two = father[y, x] if other > 0 else mother[y, x]
                change[region if region > 0 else other] += weight * (
                    step_cost(one, two, slope, free, jump)
                    - step_cost(old, mother[y, x], slope, free, jump))
    saved = total = 0.0
    for region in range(known - 1, 0, -1):
        if parent[region] != region:
            change[parent[region]] += change[region]
            continue
        total += change[region]
        saved -= min(change[region], 0.0)
    for region in range(1, known):
        change[region] = change[parent[region]]
    for row in range(rows):
        for column in range(columns):
            region = regions[row, column]
            if region > 0 and change[region] < 0:
                mother[row, column] = father[row, column]
                mother_costs[row, column] = father_costs[row, column]
    return saved, total
