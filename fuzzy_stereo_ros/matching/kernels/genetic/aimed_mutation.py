# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mutation aimed at the least possible cells: patches that take the gene of a cell nearby."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import below, mixed
import numpy as np


@kernel
def count_costs(costs, histogram, step):
    """Count the costs, uint8 (R, C), of every step-th row and column: int64 (256,)."""
    histogram[:] = 0
    for row in range(0, costs.shape[0], step):
        for column in range(0, costs.shape[1], step):
            histogram[costs[row, column]] += 1


@kernel
def mutate_patches(parent, costs, child, dear, radius, reach, patches, key):
    """
    Paint patches of the child: cells that cost `dear` or more take one gene from nearby.

    parent, child: (R, C) labels; costs: uint8 (R, C); radius: patches are 2 * radius + 1 wide;
    reach: how far the gene comes from, px; patches: how many are tried; key: uint64 of chance.
    """
    rows, columns = parent.shape
    span = np.uint64(2 * reach + 1)
    for patch in range(patches):
        counter = np.uint64(4 * patch)
        row = np.int64(below(mixed(key, counter), np.uint64(rows)))
        column = np.int64(below(mixed(key, counter + np.uint64(1)), np.uint64(columns)))
        if costs[row, column] < dear:
            continue
        down = np.int64(below(mixed(key, counter + np.uint64(2)), span)) - reach
        right = np.int64(below(mixed(key, counter + np.uint64(3)), span)) - reach
        gene = parent[min(max(row + down, 0), rows - 1), min(max(column + right, 0), columns - 1)]
        for near_row in range(max(row - radius, 0), min(row + radius + 1, rows)):
            for near in range(max(column - radius, 0), min(column + radius + 1, columns)):
                if costs[near_row, near] >= dear:
                    child[near_row, near] = gene
