# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mutation of a chromosome by uniform patches on its least possible cells."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import below, mixed, unit
import numpy as np


@kernel
def least_possible_level(chosen, share):
    """
    Return the level below which a cell is one of the least possible ones, and a share of ties.

    Every cell below the level is one, and of the cells at the level the share of ties: together
    `share` of all cells.

    chosen: uint8 (R, C), 255ths
    """
    rows, columns = chosen.shape
    counts = np.zeros((4, 256), np.int64)
    for row in range(rows):
        for column in range(columns):
            # Four histograms: one alone waits for its own last increment.
            counts[column & 3, chosen[row, column]] += 1
    wanted = share * rows * columns
    level = 0
    at_level = counts[:, level].sum()
    while level < 255 and at_level < wanted:
        wanted -= at_level
        level += 1
        at_level = counts[:, level].sum()
    return level, wanted / max(at_level, 1)


@kernel
def throw_patches(key, patches, neighbourhood, disparities, chosen, level, share_of_ties,
                  chromosome):
    """
    Throw uniform patches at a chromosome; those whose middle is a least possible cell stay.

    A patch is a square of the size of N, cut at the image's border, with one random disparity.
    `level` and `share_of_ties` come from `least_possible_level`.

    key: uint64; chosen: uint8 (R, C), 255ths, possibility of each cell before the mutation
    chromosome: uint16 (R, C), index of a disparity, changed
    """
    rows, columns = chosen.shape
    half = neighbourhood // 2
    for patch in range(patches):
        counter = np.uint64(3 * patch)
        place = mixed(key, counter)
        row = min(np.int64((patch + unit(place)) * rows / patches), rows - 1)
        column = np.int64(below(place << np.uint64(32), np.uint64(columns)))
        if chosen[row, column] > level:
            continue
        if (chosen[row, column] == level
                and unit(mixed(key, counter + np.uint64(1))) >= share_of_ties):
            continue
        index = below(mixed(key, counter + np.uint64(2)), np.uint64(disparities))
        left, right = max(column - half, 0), min(column + half + 1, columns)
        for above in range(max(row - half, 0), min(row + half + 1, rows)):
            for beside in range(left, right):
                chromosome[above, beside] = index
