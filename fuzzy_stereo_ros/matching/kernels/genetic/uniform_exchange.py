# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an exchange of genes changes in the fitness of the uniform reading."""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_fitness import (
    EQUAL, fill_fitness, ONE_APART)
import numpy as np


@inlined
def _smooth(first, second):
    """Return the smoothness of two genes."""
    if first == second:
        return np.int64(EQUAL)
    return np.int64(ONE_APART) if abs(first - second) == 1 else np.int64(0)


@inlined
def _differ(genes, others, place):
    return genes[place] != others[place]


@kernel
def fill_exchange(cells, first_genes, first_chosen, second_genes, second_chosen, weights,
                  alone, pairs):
    """
    Write what taking the second parent's genes changes, as a cost: fitness lost, 65280ths.

    Two neighbours share (a_p w_pq + a_q w_qp) * smoothness of their genes, a the possibility that
    each chose; the sum over all pairs of neighbours is the fitness.

    cells: int32 (n,), row * W + column of a framed map, where the parents differ
    genes: uint16, chosen: uint8, framed maps; weights: uint16 (8, R + 2, W)
    alone: int32 (n,), pairs: int32 (n, 4), written; see crossover.Exchange
    """
    width, plane = first_genes.shape[1], first_genes.size
    ours, our_chosen = first_genes.reshape(-1), first_chosen.reshape(-1)
    theirs, their_chosen = second_genes.reshape(-1), second_chosen.reshape(-1)
    flat_weights = weights.reshape(-1)
    offsets = (-1, -width - 1, -width, -width + 1, 1, width + 1, width, width - 1)
    for index in range(cells.size):
        cell = np.int64(cells[index])
        own, taken = np.int64(ours[cell]), np.int64(theirs[cell])
        own_chosen, taken_chosen = np.int64(our_chosen[cell]), np.int64(their_chosen[cell])
        change = np.int64(0)
        for side in range(8):
            other = cell + offsets[side]
            beside, beside_chosen = np.int64(ours[other]), np.int64(our_chosen[other])
            weight = np.int64(flat_weights[side * plane + cell])
            back = np.int64(flat_weights[((side + 4) & 7) * plane + other])
            both_own = (own_chosen * weight + beside_chosen * back) * _smooth(own, beside)
            only_this = (taken_chosen * weight + beside_chosen * back) * _smooth(taken, beside)
            change += both_own - only_this
            if side < 4:
                pairs[index, side] = 0
                if _differ(ours, theirs, other):
                    new, new_chosen = np.int64(theirs[other]), np.int64(their_chosen[other])
                    only_other = (own_chosen * weight + new_chosen * back) * _smooth(own, new)
                    both = (taken_chosen * weight + new_chosen * back) * _smooth(taken, new)
                    pairs[index, side] = only_this + only_other - both - both_own
        alone[index] = change


@kernel
def take_genes(cells, taken, other_genes, other_chosen, weights, columns, genes, chosen, fitness):
    """
    Take genes of the second parent, and write the fitness of the rows around them.

    cells: int32 (n,), ascending, taken: bool (n,), see crossover.Exchange; columns: of the image
    other_genes: uint16, other_chosen: uint8, of the second parent; weights: uint16 (8, R + 2, W)
    genes: uint16, chosen: uint8, fitness: uint16 (R + 2, W), framed, changed
    """
    rows, width = genes.shape[0] - 2, genes.shape[1]
    ours, our_chosen = genes.reshape(-1), chosen.reshape(-1)
    theirs, their_chosen = other_genes.reshape(-1), other_chosen.reshape(-1)
    for index in range(cells.size):
        if taken[index]:
            cell = cells[index]
            ours[cell], our_chosen[cell] = theirs[cell], their_chosen[cell]
    first = last = 0        # rows of the image that are to be written
    for index in range(cells.size):
        if taken[index]:
            row = cells[index] // width - 1
            if row > last:
                fill_fitness(genes, chosen, weights, columns, first, last, fitness)
                first = row - 1
            first, last = max(first, 0), min(row + 2, rows)
    fill_fitness(genes, chosen, weights, columns, first, last, fitness)
