# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The cost of the genes of a map with sub-pixel disparities."""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import row_of
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
import numpy as np

COST_PARTS = 1024   # of a unit of cost that an exchange counts
FREE, APART = np.float32(0.25), np.float32(0.5)     # px of steps that cost nothing; of other genes
# Cost of a px beyond the free ones, and the most that a step costs; genes cost FULL / 2 at most.
SLOPE, JUMP = np.float32(0.16 * FULL / 2), np.float32(4 * FULL / 2)


@called
def cost_at(costs, row, column, disparity, disparities):
    """Return the cost of a disparity in parts of a pixel, between those of its labels."""
    place = min(max(disparity, np.float32(0)), np.float32(disparities - 1))
    label = min(np.int64(place), max(disparities - 2, 0))
    cell = costs[row, column]
    low, high = np.float32(cell[label]), np.float32(cell[min(label + 1, disparities - 1)])
    return low + (high - low) * (place - np.float32(label))


@kernel
def gene_costs(costs, disparities, surface, trust, result):
    """Write the costs of the matches of some rows of a map, times the trust in them."""
    for row in range(len(costs)):
        for column in range(surface.shape[1]):
            result[row, column] = trust[row, column] * cost_at(
                costs, row, column, surface[row, column], disparities)


@inlined
def _parts(cost):
    return np.int64(np.rint(np.float64(cost) * COST_PARTS))


@called
def _step_parts(one, other, weight):
    """Return what a step of disparity costs: nothing up to FREE px, in the end JUMP."""
    return _parts(weight * min(max(abs(one - other) - FREE, np.float32(0)) * SLOPE, JUMP))


@kernel
def exchange_changes(first, first_costs, second, second_costs, weights, changes):
    """
    Write the changes of cost where cells take the second parent's genes: see crossover.Exchange.

    first, second: float32 (R, C), px; first_costs, second_costs: float32 (R, C), what the genes
    cost; weights: float32 (2, R, C), of the steps to the left and up; changes: cells are some of
    those where the parents are APART
    """
    cells, alone, pairs = changes
    rows, columns = first.shape
    row = 0
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        column = np.int64(cells[index]) - row * columns
        old, new = first[row, column], second[row, column]
        change = _parts(second_costs[row, column]) - _parts(first_costs[row, column])
        for side in range(2):
            pairs[index, side] = 0
            if (row if side else column) > 0:
                place = row - side, column - 1 + side
                weight = weights[side, row, column]
                its_old, its_new = first[place], second[place]
                before = _step_parts(old, its_old, weight)
                after = _step_parts(new, its_old, weight)
                change += after - before
                if abs(its_old - its_new) > APART:
                    pairs[index, side] = before - after + (
                        _step_parts(new, its_new, weight)
                        - _step_parts(old, its_new, weight))
            if (row + 1 < rows) if side else (column + 1 < columns):
                place = row + side, column + 1 - side
                weight = weights[side, place[0], place[1]]
                change += (_step_parts(new, first[place], weight)
                           - _step_parts(old, first[place], weight))
        alone[index] = change
