# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of a gene: its match where it is visible, a constant where it is hidden, and its jumps.

A rejected pixel has no match. Its label is compared with that of the target pixel it points at: if
that is nearer, the label is hidden, as it should be; if it is farther, the label would hide what
the target shows, which is a contradiction.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import row_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import match_cost
from fuzzy_stereo_ros.matching.kernels.units import INVALID
import numpy as np

HIDDEN = 6           # cost of a gene that something nearer hides, or that points outside
CONTRADICTED = 15    # cost of a gene that hides what can be seen
SMOOTHNESS = 4       # divides the penalties of the scanlines, which sum four paths


@called
def jump_cost(one, other, small, jump):
    """Return what a change of labels costs: 0, P1 for one, P2 beyond, of Penalties."""
    difference = abs(one - other)
    if difference == 0:
        return 0
    return (np.int64(small) if difference == 1 else np.int64(jump)) // SMOOTHNESS


@inlined
def _gene_cost(left, right, scene, chromosome, row, column):
    """Return the data cost of a gene."""
    (validity, target, lowest), columns = scene, chromosome.shape[1]
    label = np.int64(chromosome[row, column])
    pointed = column - label
    if pointed < lowest or pointed >= lowest + columns:
        return HIDDEN
    if validity[row, column] == INVALID:
        nearer = np.int64(target[row, pointed + target.shape[1] - columns]) - label
        if chromosome.itemsize > 1:
            nearer = ((nearer + 128) & 255) - 128
        if nearer > 1:
            return HIDDEN
        if nearer < -1:
            return CONTRADICTED
    return match_cost(left, right, row, column, columns - 1 - pointed)


@kernel
def gene_costs(left, right, scene, chromosome, every, costs, first, last):
    """
    Write the data costs of the genes of every `every`-th row, from row 0 on: uint8 (..., C).

    left, right: of match_cost; scene: the validity; the target's labels modulo 256, uint8
    (R, extra + C), from column -extra on; the first of its C columns that exist; first, last:
    which of these rows
    """
    for sample in range(first, last):
        for column in range(chromosome.shape[1]):
            costs[sample, column] = _gene_cost(
                left, right, scene, chromosome, sample * every, column)


@kernel
def match_changes(left, right, scene, first, second, cells, changes):
    """Write the changes of data cost, int32 (n,), where cells take the second parent's genes."""
    columns, row = first.shape[1], 0
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        column = np.int64(cells[index]) - row * columns
        changes[index] = (np.int64(_gene_cost(left, right, scene, second, row, column))
                          - np.int64(_gene_cost(left, right, scene, first, row, column)))


@kernel
def add_jump_changes(small, across, down, first, second, changes):
    """
    Add the changes of jumps where cells take the second parent's genes: see crossover.Exchange.

    changes: cells are some of those where the parents, (R, C) labels, differ
    """
    cells, alone, pairs = changes
    rows, columns = first.shape
    row = 0
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        column = np.int64(cells[index]) - row * columns
        old, new = np.int64(first[row, column]), np.int64(second[row, column])
        change = np.int64(0)
        for side in range(2):
            pairs[index, side] = 0
            if (row if side else column) > 0:
                jump = down[row, column] if side else across[row, column]
                place = row - side, column - 1 + side
                its_old, its_new = np.int64(first[place]), np.int64(second[place])
                before, after = (jump_cost(old, its_old, small, jump),
                                 jump_cost(new, its_old, small, jump))
                change += after - before
                if its_old != its_new:
                    pairs[index, side] = before - after + (
                        jump_cost(new, its_new, small, jump)
                        - jump_cost(old, its_new, small, jump))
            if (row + 1 < rows) if side else (column + 1 < columns):
                place = row + side, column + 1 - side
                its_old, jump = np.int64(first[place]), down[place] if side else across[place]
                change += (jump_cost(new, its_old, small, jump)
                           - jump_cost(old, its_old, small, jump))
        alone[index] += change


@kernel
def row_costs(small, across, down, chromosome, costs, every, first, last):
    """
    Return the cost of the genes of every `every`-th row: data, and jumps to the left and up.

    costs: of gene_costs; first, last: which of these rows
    """
    total, columns = np.int64(0), chromosome.shape[1]
    for sample in range(first, last):
        row = sample * every
        for column in range(columns):
            label = np.int64(chromosome[row, column])
            total += np.int64(costs[sample, column])
            if column > 0:
                total += jump_cost(label, np.int64(chromosome[row, column - 1]), small,
                                   across[row, column])
            if row > 0:
                total += jump_cost(label, np.int64(chromosome[row - 1, column]), small,
                                   down[row, column])
    return total
