# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an exchange of genes changes in the fitness of the uniform reading."""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_fitness import (
    EQUAL, fill_fitness, ONE_APART)
import numpy as np


@inlined
def _smooth(first, second):
    """Return the smoothness of two genes, without a branch."""
    step = first - second
    return EQUAL * np.int64(step == 0) + ONE_APART * np.int64(step * step == 1)


@inlined
def _at(array, place):
    """Return an element as int64; the place is uint64: no check for negative ones."""
    return np.int64(array[place])


@inlined
def _change_beside(genes, chosen, weights, cell, side, offset):
    """
    Return what a cell and one neighbour lose if the cell takes its gene, and both together.

    genes, chosen: pairs of flat framed maps, of both parents; weights: flat (8, plane)
    side: number of the neighbour; offset: of the neighbour
    """
    plane = genes[0].size
    other = np.uint64(cell + offset)
    here = np.uint64(cell)
    weight = _at(weights, np.uint64(side * plane + cell))
    back = _at(weights, np.uint64((side + 4 & 7) * plane + cell + offset))
    own, taken = _at(genes[0], here), _at(genes[1], here)
    beside, new = _at(genes[0], other), _at(genes[1], other)
    own_share, taken_share = _at(chosen[0], here) * weight, _at(chosen[1], here) * weight
    beside_share, new_share = _at(chosen[0], other) * back, _at(chosen[1], other) * back
    only_this = (taken_share + beside_share) * _smooth(taken, beside)
    change = (own_share + beside_share) * _smooth(own, beside) - only_this
    # 0 where the neighbour has the same gene in both parents
    together = (own_share + new_share) * _smooth(own, new) - (
        taken_share + new_share) * _smooth(taken, new) - change
    return change, together


@kernel
def fill_exchange(cells, first_genes, first_chosen, second_genes, second_chosen, weights,
                  alone, pairs):
    """
    Write what taking the second parent's genes changes, as a cost: fitness lost, 65280ths.

    Two neighbours share (a_p w_pq + a_q w_qp) * smoothness of their genes, a the possibility that
    each chose; the sum over all pairs of neighbours is the fitness.

    cells: int32 (n,), row * W + column of a framed map, where the parents differ
    genes: uint16, chosen: uint8, framed maps; weights: uint8 (8, R + 2, W)
    alone: int32 (n,), pairs: int32 (n, 4), written; see crossover.Exchange
    """
    width = first_genes.shape[1]
    genes = first_genes.reshape(-1), second_genes.reshape(-1)
    chosen = first_chosen.reshape(-1), second_chosen.reshape(-1)
    flat_weights = weights.reshape(-1)
    for index in range(cells.size):
        cell = np.int64(cells[index])
        left, with_left = _change_beside(genes, chosen, flat_weights, cell, 0, -1)
        up_left, with_up_left = _change_beside(
            genes, chosen, flat_weights, cell, 1, -width - 1)
        up, with_up = _change_beside(genes, chosen, flat_weights, cell, 2, -width)
        up_right, with_up_right = _change_beside(
            genes, chosen, flat_weights, cell, 3, 1 - width)
        right, _ = _change_beside(genes, chosen, flat_weights, cell, 4, 1)
        down_right, _ = _change_beside(genes, chosen, flat_weights, cell, 5, width + 1)
        down, _ = _change_beside(genes, chosen, flat_weights, cell, 6, width)
        down_left, _ = _change_beside(genes, chosen, flat_weights, cell, 7, width - 1)
        alone[index] = (left + up_left + up + up_right
                        + right + down_right + down + down_left)
        pairs[index, 0], pairs[index, 1] = with_left, with_up_left
        pairs[index, 2], pairs[index, 3] = with_up, with_up_right


@kernel
def take_genes(cells, taken, other_genes, other_chosen, weights, columns, genes, chosen, fitness):
    """
    Take genes of the second parent, and write the fitness of the rows around them.

    cells: int32 (n,), ascending, taken: bool (n,), see crossover.Exchange; columns: of the image
    other_genes: uint16, other_chosen: uint8, of the second parent; weights: uint8 (8, R + 2, W)
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
