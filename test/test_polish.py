# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Memetic sweeps: every row to its exact optimum beside its neighbours."""
import gc
import weakref

from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import Penalties
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.fitness import SMOOTHNESS
from fuzzy_stereo_ros.matching.realtime.possibility import FULL_SIZE, HALF_SIZE
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type, prior_of, ScanlineGuess
import numpy as np
import pytest
import reference_census as twins

RULES = (1, 4), (0, 4)


def least_row_cost(own, neighbours, small, across, closed=None):
    """
    Return the cost of the best path along a row: dynamic programming, no window, no cut.

    closed: bool (C, D), labels to and from which even a change by one costs a jump.
    """
    labels = np.arange(own.shape[1])
    away = abs(labels[:, None] - labels)
    beside = sum(np.where(abs(labels - near[:, None]) == 0, 0, np.where(
        abs(labels - near[:, None]) == 1, small, jump[:, None])) for near, jump in neighbours)
    total = own + beside
    best = total[0]
    for column in range(1, len(own)):
        near = away == 1
        if closed is not None:
            near &= ~closed[column][:, None] & ~closed[column - 1]
        jump = np.where(away == 0, 0, np.where(near, small, int(across[column])))
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


class Polished:
    """
    A random chromosome before and after a sweep, and what its rows are measured by.

    low, blocks: of the windows, all or each of them; blocks: None for all labels.
    """

    def __init__(self, shape, disparities, tile=64, low=0, blocks=None, priors=False,
                 model=FULL_SIZE, threads=1):
        left, right = small_pair(*shape)
        guess = ScanlineGuess(seen(left, right, disparities, model=model), tile)
        guess.windows.low[:] = low
        guess.windows.blocks[:] = guess.most_blocks if blocks is None else blocks
        guess.pack()
        crew, kind = Crew(threads), gene_type(disparities)
        leant_on = [prior_of(random_map(shape, disparities, seed, kind),
                             random_map(shape, 3, seed), disparities, *RULES)
                    for seed in range(2 * priors)]
        guess.search(crew, *leant_on)
        full = guess.possibility.penalties
        self.penalties = Penalties(full.small // SMOOTHNESS, full.across // SMOOTHNESS,
                                   full.down // SMOOTHNESS)
        self.costs = twin_costs(left, right, disparities, model=model)
        if model.box:
            self.costs = twins.box_costs(self.costs, model.box)
        for prior in leant_on:
            self.costs = self.costs + twins.prior_costs(
                prior.labels, prior.weights, RULES, disparities)
        windows = guess.windows
        self.closed = twins.outside_windows(self.costs.shape, windows.low, np.minimum(
            windows.low + LANES * windows.blocks, disparities), tile)
        self.chromosome = random_map(shape, disparities, 5, kind)
        self.before = self.chromosome.astype(np.int64)
        del leant_on
        guess.polish(crew, self.penalties, self.chromosome)
        crew.close()


def check(polished, carried=False):
    """
    Check that each row is as good as can be with labels of its tiles' windows.

    carried: windows differ, and what is not in both of them is reached by a jump.
    """
    penalties, closed = polished.penalties, polished.closed
    genes, costs = polished.chromosome.astype(np.int64), polished.costs + 10**6 * closed
    assert not np.take_along_axis(closed, genes[..., None], axis=2).any()
    mixed = polished.before.copy()
    for parity in (0, 1):        # odd rows are swept beside the even ones as they then are
        for row in range(parity, len(genes), 2):
            neighbours = [(mixed[near], penalties.down[max(row, near)].astype(np.int64))
                          for near in (row - 1, row + 1) if 0 <= near < len(genes)]
            given_row = costs[row], neighbours, penalties.small, penalties.across[row]
            cost, least = row_cost(genes[row], *given_row), least_row_cost(*given_row)
            assert least <= cost
            assert cost <= (least_row_cost(*given_row, closed[row]) if carried else least)
        mixed[parity::2] = genes[parity::2]


@pytest.mark.parametrize('shape', [(1, 1), (1, 30), (2, 2), (7, 40), (6, 33), (130, 6)])
@pytest.mark.parametrize('disparities', [1, 2, 20, 70])
def test_a_sweep_gives_each_row_its_exact_optimum_beside_the_others(shape, disparities):
    check(Polished(shape, disparities))


@pytest.mark.parametrize('tile, disparities', [(1, 20), (5, 70), (16, 33), (7, 300)])
def test_a_sweep_passes_from_tile_to_tile_and_leans_on_what_the_search_leant_on(
        tile, disparities):
    check(Polished((7, 40), disparities, tile, priors=True))


@pytest.mark.parametrize('low, blocks', [(0, 1), (13, 1), (36, 2), (68, 1)])
def test_a_sweep_takes_labels_of_the_window_beside_neighbours_that_are_outside(low, blocks):
    check(Polished((6, 25), 100, 9, low, blocks))


@pytest.mark.parametrize('disparities, seed', [(70, 1), (130, 2), (300, 3)])
def test_a_sweep_is_carried_from_window_to_window(disparities, seed):
    chance, most = np.random.default_rng(seed), -(-disparities // LANES)
    blocks = chance.integers(1, most + 1, (2, 5))
    low = chance.integers(0, np.maximum(disparities - LANES * blocks, 0) + 1)
    check(Polished((9, 33), disparities, 7, low, blocks), carried=True)


@pytest.mark.parametrize('tile', [64, 5])
def test_a_sweep_of_box_sums_prices_each_row_anew(tile):
    check(Polished((140, 9), 12, tile, model=HALF_SIZE, threads=3))


def test_the_maps_that_a_search_leant_on_live_until_the_next_search():
    left, right = small_pair(4, 9)
    guess, crew = ScanlineGuess(seen(left, right, 9), 16), Crew(1)
    weights = random_map((4, 9), 3)
    alive = weakref.ref(weights)
    guess.search(crew, prior_of(random_map((4, 9), 9), weights, 9, *RULES))
    del weights
    gc.collect()
    assert alive() is not None
    guess.search(crew)
    gc.collect()
    assert alive() is None
