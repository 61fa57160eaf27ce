# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Memetic sweeps: every row to its exact optimum beside its neighbours."""
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.census_fitness import SMOOTHNESS
from fuzzy_stereo_ros.matching.kernels.sweep import Penalties
from fuzzy_stereo_ros.matching.scanline_guess import ScanlineGuess
import numpy as np
import pytest


def least_row_cost(own, neighbours, small, across):
    """Return the cost of the best path along a row: dynamic programming, no window, no cut."""
    labels = np.arange(own.shape[1])
    away = abs(labels[:, None] - labels)
    beside = sum(np.where(abs(labels - near[:, None]) == 0, 0, np.where(
        abs(labels - near[:, None]) == 1, small, jump[:, None])) for near, jump in neighbours)
    total = own + beside
    best = total[0]
    for column in range(1, len(own)):
        jump = np.where(away == 0, 0, np.where(away == 1, small, int(across[column])))
        best = (best[:, None] + jump).min(axis=0) + total[column]
    return int(best.min())


def row_cost(row, own, neighbours, small, across):
    """Return the cost of a row as it is."""
    genes = row.astype(np.int64)

    def jump(away, cost):
        return 0 if away == 0 else small if away == 1 else int(cost)
    return sum(
        int(own[column, gene]) + sum(jump(abs(gene - near[column]), cost[column])
                                     for near, cost in neighbours)
        + (jump(abs(gene - genes[column - 1]), across[column]) if column else 0)
        for column, gene in enumerate(genes))


@pytest.mark.parametrize('shape', [(1, 1), (1, 30), (2, 2), (7, 40), (6, 33), (130, 6)])
@pytest.mark.parametrize('disparities', [1, 2, 20, 70])
def test_a_sweep_gives_each_row_its_exact_optimum_beside_the_others(shape, disparities):
    left, right = small_pair(*shape)
    guess = ScanlineGuess(seen(left, right, disparities), 0)
    guess.search(Crew(1))
    full = guess.possibility.penalties
    penalties = Penalties(full.small // SMOOTHNESS, full.across // SMOOTHNESS,
                          full.down // SMOOTHNESS)
    chromosome = random_map(shape, disparities, 5)
    before = chromosome.astype(np.int64)
    guess.polish(Crew(1), penalties, chromosome)
    volume = twin_costs(left, right, disparities)
    mixed = before.copy()
    for parity in (0, 1):        # odd rows are swept beside the even ones as they then are
        for row in range(parity, shape[0], 2):
            neighbours = [(mixed[near], penalties.down[max(row, near)].astype(np.int64))
                          for near in (row - 1, row + 1) if 0 <= near < shape[0]]
            given_row = volume[row], neighbours, penalties.small, penalties.across[row]
            assert row_cost(chromosome[row], *given_row) == least_row_cost(*given_row)
        mixed[parity::2] = chromosome[parity::2]
