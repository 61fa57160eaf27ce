# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The paper read literally: fitness by Eq. 3 and Eq. 4, row by row, in whole numbers, and mutation.

Mutation places uniform patches on the least possible cells.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import below, mixed, unit
import numpy as np


@kernel(allocates=True)
def fill_row_fitness(chosen, chromosome, gradients, neighbourhood, first, last, row_fitness):
    """
    Write what each row from first to last - 1 adds to the fitness of a chromosome: Eq. 3.

    F(C) is the sum over (r, c) of S(r, c) times the sum over N of the possibilities that C
    chose; S(r, c) = |gradient of (r, c)| |gradient of its match|: Eq. 4. The match of the left
    pixel (r, c) is (r, c - min_disparity - C(r, c)); the paper's right reference, with
    (r, c + d), is had by mirroring and exchanging the images above. Cells of N outside the
    image add nothing.

    The sum over N is kept by a running sum down each column and taken along the row.

    chosen, chromosome: (R, C), not framed; gradients: of the reference, uint16 (R, C), and of the
    target, uint16 (R, C + D - 1), grey levels, from `gradient_by_index`; row_fitness: int64 (R,),
    255ths
    """
    reference_gradient, target_gradient = gradients
    rows, columns = chosen.shape
    half = neighbourhood // 2
    window, support = np.zeros(columns + 2 * half, np.int32), np.empty(columns, np.int32)
    inside = window[half:half + columns]
    for row in range(max(first - half - 1, 0), min(first + half, rows)):
        add(inside, chosen[row])
    for row in range(first, last):
        if row + half < rows:
            add(inside, chosen[row + half])
        if row - half - 1 >= 0:
            subtract(inside, chosen[row - half - 1])
        support[:] = 0
        for shift in range(neighbourhood):
            add(support, window[shift:shift + columns])
        row_fitness[row] = weighted(support, chromosome[row], reference_gradient[row],
                                    target_gradient[row])


@called
def add(total, more):
    """Add whole numbers to int32 ones, cell by cell."""
    for column in range(total.size):
        total[column] += np.int32(more[column])


@called
def subtract(total, less):
    """Subtract whole numbers from int32 ones, cell by cell."""
    for column in range(total.size):
        total[column] -= np.int32(less[column])


@called
def weighted(support, genes, reference_gradient, target_gradient):
    """Return the sum along one row of support weighted by S: Eq. 4."""
    columns = genes.size
    last_index = np.uint64(target_gradient.size - columns)
    total = np.int64(0)
    for column in range(columns):
        # Unsigned, so that the compiler needs no check for negative places.
        seen = np.uint64(column) + last_index - np.uint64(genes[column])
        weight = np.uint32(reference_gradient[column]) * np.uint32(target_gradient[seen])
        total += np.int64(weight) * np.int64(support[column])
    return total


@kernel
def place_patches(key, patches, neighbourhood, disparities, chosen, level, share_of_ties,
                  chromosome):
    """
    Place uniform patches on a chromosome; those whose middle is a least possible cell stay.

    A patch is a square of the size of N, cut at the image's border, with one random disparity.
    `level` and `share_of_ties` come from `least_possible_level`. chosen: of before the mutation
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
