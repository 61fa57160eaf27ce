# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of a gene: its match where it is visible, a constant where it is hidden, and its jumps.

A rejected pixel has no match. Its label is compared with that of the target pixel it points at: if
that is nearer, the label is hidden, as it should be; if it is farther, the label would hide what
the target shows, which is a contradiction.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import row_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Features, match_cost
from fuzzy_stereo_ros.matching.kernels.units import INVALID
import numpy as np


class Scene(NamedTuple):
    """What the fitness of a chromosome is measured against."""

    validity: np.ndarray       # uint8 (R, C), which pixels are rejected
    target: np.ndarray        # uint8 (R, extra + C), the target's labels modulo 256
    target_range: tuple       # first and last column of the target that exist, from -extra on
    hidden: int               # cost of a gene that something nearer hides, or that points outside
    contradicted: int         # cost of a gene that hides what can be seen


SMOOTHNESS = 4       # divides the penalties of the scanlines, which sum four paths


@called
def jump_cost(one, other, small, jump):
    """Return what a change of labels costs: 0, P1 for one, P2 beyond, of Penalties."""
    difference = abs(one - other)
    if difference == 0:
        return 0
    return (np.int64(small) if difference == 1 else np.int64(jump)) // SMOOTHNESS


@inlined
def _gene_cost(features, scene, label, row, column):
    """Return the data cost of one gene."""
    pointed = column - label
    if pointed < scene.target_range[0] or pointed > scene.target_range[1]:
        return scene.hidden
    if scene.validity[row, column] == INVALID:
        extra = scene.target.shape[1] - scene.validity.shape[1]
        nearer = np.int64(scene.target[row, pointed + extra]) - label
        if features.disparities > 256:
            nearer = ((nearer + 128) & 255) - 128
        if nearer > 1:
            return scene.hidden
        if nearer < -1:
            return scene.contradicted
    return match_cost(features, row, column, label)


@kernel
def gene_costs(features, scene, chromosome, costs, every, first, last):
    """Write the data cost of all genes of each row that `every` divides: uint8 (R, C)."""
    features, scene = Features(*features), Scene(*scene)
    for row in range(first + -first % every, last, every):
        for column in range(chromosome.shape[1]):
            costs[row, column] = _gene_cost(
                features, scene, np.int64(chromosome[row, column]), row, column)


@kernel
def exchange_changes(features, scene, small, across, down, first, second, changes):
    """
    Write the changes of cost where cells take the second parent's genes: see crossover.Exchange.

    changes: cells are some of those where the parents, (R, C) labels, differ
    """
    cells, alone, pairs = changes
    features, scene = Features(*features), Scene(*scene)
    rows, columns = first.shape
    row = 0
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        column = np.int64(cells[index]) - row * columns
        old, new = np.int64(first[row, column]), np.int64(second[row, column])
        change = (np.int64(_gene_cost(features, scene, new, row, column))
                  - np.int64(_gene_cost(features, scene, old, row, column)))
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
        alone[index] = change


@kernel
def row_costs(small, across, down, chromosome, costs, every, first, last):
    """
    Return the cost of the genes of every `every`-th row, and the number of these genes.

    costs: uint8 (R, C), their data costs; the jumps to the left and up are added
    """
    total = number = 0
    for row in range(first + -first % every, last, every):
        for column in range(chromosome.shape[1]):
            label = np.int64(chromosome[row, column])
            total += np.int64(costs[row, column])
            if column > 0:
                total += jump_cost(label, np.int64(chromosome[row, column - 1]), small,
                                   across[row, column])
            if row > 0:
                total += jump_cost(label, np.int64(chromosome[row - 1, column]), small,
                                   down[row, column])
        number += chromosome.shape[1]
    return total, number
