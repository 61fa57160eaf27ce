# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Random chromosomes."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import below, mixed
import numpy as np


@kernel
def fill_random_genes(key, disparities, chromosome):
    """
    Write a chromosome whose cells are independent and uniform from 0 to disparities - 1.

    key: uint64; chromosome: uint16 (R, C), index of a disparity, written
    """
    rows, columns = chromosome.shape
    limit = np.uint64(disparities)
    for row in range(rows):
        for column in range(columns):
            bits = mixed(key, np.uint64(row * columns + column))
            chromosome[row, column] = below(bits, limit)


@kernel
def scatter_random_genes(key, disparities, share, chromosome):
    """
    Draw a share of the genes of a chromosome anew, independent and uniform.

    key: uint64; share: 0 to 1; chromosome: uint16 (R, C), index of a disparity, changed
    """
    rows, columns = chromosome.shape
    limit = np.uint64(disparities)
    drawn = np.uint64(np.ceil(share * 2.0**32))
    for row in range(rows):
        for column in range(columns):
            bits = mixed(key, np.uint64(row * columns + column))
            # the upper bits choose the gene, the lower ones whether it is drawn
            gene = np.uint16(below(bits, limit))
            chromosome[row, column] = gene if (
                bits & np.uint64(0xFFFFFFFF) < drawn) else chromosome[row, column]
