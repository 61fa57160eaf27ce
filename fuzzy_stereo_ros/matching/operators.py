# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The genetic operators of the paper: who lives, who mates, crossover and mutation."""
from fuzzy_stereo_ros.matching.kernels.grey_mutation import least_possible_level, throw_patches
import numpy as np


def fittest_first(fitness):
    """
    Return the order of a population from the fittest on; of equals the earlier goes first.

    fitness: float64 (P,); order: int64 (P,)
    """
    return np.argsort(-fitness, kind='stable')


def elite_size(population, share):
    """Return how many of the fittest live on unchanged; the fittest one always does."""
    return min(max(round(share * population), 1), population)


def rank_survival(fitness):
    """
    Return the probability to survive by rank: 1 for the fittest, less by 1 / P a rank.

    fitness: float64 (P,); survival: float64 (P,), above 0 to 1
    """
    fitter = fitness.size - np.searchsorted(np.sort(fitness), fitness, side='right')
    return 1.0 - fitter / fitness.size


def sigmoid_survival(fitness):
    """
    Return the probability to survive by a sigmoid of fitness: one half for the mean.

    Fitness is counted in standard deviations of the population.

    fitness: float64 (P,); survival: float64 (P,), 0 to 1
    """
    spread = fitness.std()
    if spread == 0.0:
        return np.full(fitness.size, 0.5)
    return 1.0 / (1.0 + np.exp(-(fitness - fitness.mean()) / spread))


SURVIVAL = {'rank': rank_survival, 'sigmoid': sigmoid_survival}


def survivors(fitness, survival, draws):
    """
    Return who survives to mate: whose probability is greater than its random number.

    Two are needed to mate: where fewer survive, the two fittest do.

    fitness, survival: float64 (P,); draws: float64 (P,), 0 to below 1
    chosen: int64 (from 2 to P,), or (1,) when the population is one
    """
    chosen = np.flatnonzero(survival > draws)
    return chosen if chosen.size >= 2 else fittest_first(fitness)[:2]


def couples(chosen, first_draws, second_draws):
    """
    Return the parents of each child, two different ones where there are two.

    chosen: int64 (S,), who survived; first_draws, second_draws: float64 (children,), 0 to
    below 1; parents: int64 (children, 2)
    """
    first = (first_draws * chosen.size).astype(np.int64)
    further = 1 + (second_draws * (chosen.size - 1)).astype(np.int64)
    return np.stack([chosen[first], chosen[(first + further) % chosen.size]], axis=1)


def crossover_lines(rows, draws):
    """
    Return the line of each crossover, uniform in [1, R] as in the paper.

    draws: float64 (children,), 0 to below 1; lines: int64 (children,), 1 to R
    """
    return 1 + (draws * rows).astype(np.int64)


def cut_crossover(first, second, line, child):
    """
    Write the child that has the rows above a horizontal line from one parent, the rest from two.

    Any array with a row per row of the image is inherited alike. At line R the child is its
    first parent.

    first, second: (R, ...); line: 1 to R; child: (R, ...), written
    """
    child[:line] = first[:line]
    child[line:] = second[line:]


def patch_numbers(cells, neighbourhood, draws):
    """
    Return how many patches are thrown at each child: the paper's "one or several".

    From one to as many as could cover the image once, each order of magnitude as likely as the
    next: coarse search at first, fine search once large changes have ceased to pay.

    cells: R * C; draws: float64 (children,), 0 to below 1; numbers: int64 (children,)
    """
    most = max(cells // neighbourhood**2, 1)
    return (float(most)**draws).astype(np.int64)


def mutate(key, rate, patches, neighbourhood, disparities, chosen, chromosome):
    """
    Mutate a chromosome by uniform patches of the size of N on its least possible cells.

    `patches` are thrown anywhere; a patch whose middle is not one of the `rate` least possible
    cells of the chromosome misses.

    key: uint64; chosen: uint8 (R, C), 255ths, possibility of each cell before the mutation
    chromosome: uint16 (R, C), index of a disparity, changed
    """
    level, share_of_ties = least_possible_level(chosen, rate)
    throw_patches(key, patches, neighbourhood, disparities, chosen, level, share_of_ties,
                  chromosome)
