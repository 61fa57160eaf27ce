# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The initial population."""
from fuzzy_stereo_ros.matching.kernels.grey_random import fill_random_genes


def random_chromosome(key, disparities, chromosome):
    """
    Write a chromosome of independent, uniform genes: the paper's initial population.

    A gene may point outside the target image; its possibility is 0 there, so that selection
    and mutation deal with it.

    key: uint64, from `chance.key_of`; chromosome: uint16 (R, C), index of a disparity, written
    """
    fill_random_genes(key, disparities, chromosome)
