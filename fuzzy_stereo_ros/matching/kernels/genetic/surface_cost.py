# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the genes of a map in parts of a pixel cost."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
import numpy as np


@kernel
def cost_at(costs, row, column, disparity, disparities):
    """Return the cost of a disparity in parts of a pixel, between those of its labels."""
    place = min(max(disparity, np.float32(0)), np.float32(disparities - 1))
    label = min(np.int64(place), max(disparities - 2, 0))
    cell = costs[row, column]
    low, high = np.float32(cell[label]), np.float32(cell[min(label + 1, disparities - 1)])
    return low + (high - low) * (place - np.float32(label))


@kernel
def gene_costs(costs, disparities, surface, trust, result, first, last):
    """
    Write what the matches of some rows of a map cost.

    costs: unsigned (R, C, labels); disparities: how many labels exist; surface: float32 (R, C),
    px; trust: float32 (R, C), the share of it that counts; result: float32 (R, C).
    """
    for row in range(first, last):
        for column in range(surface.shape[1]):
            result[row, column] = trust[row, column] * cost_at(
                costs, row, column, surface[row, column], disparities)


@kernel
def step_cost(one, other, slope, free, jump):
    """Return what a step of disparity costs: nothing up to `free` px, in the end `jump`."""
    return min(max(abs(one - other) - free, np.float32(0)) * slope, jump)


@kernel
def row_costs(surface, costs, across, down, slope, free, jump, result, first, last):
    """
    Write what each row costs: its matches and its steps to the left and up.

    surface, costs: float32 (R, C); across, down: float32 (R, C), weights of the steps; result:
    float64 (R,)
    """
    for row in range(first, last):
        total = 0.0
        for column in range(surface.shape[1]):
            total += costs[row, column]
            here = surface[row, column]
            if column > 0:
                total += across[row, column] * step_cost(
                    here, surface[row, column - 1], slope, free, jump)
            if row > 0:
                total += down[row, column] * step_cost(
                    here, surface[row - 1, column], slope, free, jump)
        result[row] = total
