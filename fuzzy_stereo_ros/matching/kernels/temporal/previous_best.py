# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decide where the previous frame's best chromosome is still trusted in this frame."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
import numpy as np


@kernel
def tile_strengths(choices, ages, most, strengths):
    """
    Write the weight of the previous best in each tile: uint8, 0 in and beside changed tiles.

    choices: int8, < 0 for changed tiles; ages: float32, number of averaged frames with this one;
    most: the largest strength, reached after as many previous frames.
    """
    rows, columns = choices.shape
    for row in range(rows):
        above, below = max(row - 1, 0), min(row + 1, rows - 1)
        for column in range(columns):
            left, right = max(column - 1, 0), min(column + 1, columns - 1)
            least = min(choices[row, left], choices[row, column], choices[row, right],
                        choices[above, column], choices[below, column])
            strength = min(max(int(ages[row, column] + 0.5) - 1, 1), most)
            strengths[row, column] = strength if least >= 0 else 0


@kernel
def trusted_cells(labels, validity, half, distance, half_labels, trusted, first, last):
    """
    Mark the half-size pixels where the previous best is trusted, in the half rows first .. last.

    labels, validity: (R, C), the previous best and whether it was consistent then; half: (r, c),
    this frame's half map; half_labels: (r, c), the previous best on the half grid; trusted: uint8
    (r, c), 1 where it was consistent and is within `distance` of the half map.
    """
    for row in range(first, last):
        line, was, seen = labels[2 * row], validity[2 * row], half[row]
        found, marks = half_labels[row], trusted[row]
        for column in range(half.shape[1]):
            label = line[2 * column]
            found[column] = label
            apart = abs(2 * np.int32(seen[column]) - np.int32(label))
            marks[column] = (apart <= distance) & (was[2 * column] == CONSISTENT)


@kernel(allocates=True)
def previous_prior(trusted, smooth, strengths, weights, first, last):
    """
    Write the weights of the prior at full size.

    trusted, smooth: uint8 (r, c); strengths: uint8 (tile rows, tile columns), the weight where
    both are 1; weights: uint8 (R, C), the tile rows first .. last are written.
    """
    rows, columns = trusted.shape
    half_tile = TILE // 2
    strength = np.zeros(columns + half_tile, np.uint8)
    for row in range(first * TILE, min(last * TILE, weights.shape[0])):
        if row % TILE == 0:
            for column in range(columns):
                strength[column] = strengths[row // TILE, column // half_tile]
        source = min(row // 2, rows - 1)
        one, other, line = trusted[source], smooth[source], weights[row]
        for column in range(columns):
            weight = one[column] * other[column] * strength[column]
            line[2 * column] = weight
            line[2 * column + 1] = weight
        if weights.shape[1] > 2 * columns:
            line[2 * columns] = line[2 * columns - 1]
