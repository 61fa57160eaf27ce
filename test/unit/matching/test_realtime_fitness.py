# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fitness of the profile `realtime`, and what an exchange of genes changes of it."""
from functools import partial

from bench.variants import Line
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Cut, Exchange, PartitionCrossover
from fuzzy_stereo_ros.matching.evolution import Random
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import copy_taken, differing_cells
from fuzzy_stereo_ros.matching.kernels.genetic.gene_cost import (
    add_jump_changes, CONTRADICTED, HIDDEN, match_changes, SMOOTHNESS)
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import Penalties
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness, SAMPLE_STEP
from fuzzy_stereo_ros.matching.realtime.generation import gene_type
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_crossover
import reference_search as twins

POOL = ThreadPool(1)
RANDOM = Random((7,))
sizes = st.integers(1, 9)


# ---- what genes cost ----


def scene_of(shape, disparities, min_disparity, seed=0):
    """Return a scene of random validity for gene_costs, and the twin's cost of chromosomes."""
    left, right = small_pair(*shape, seed=seed)
    dtype = gene_type(disparities)
    possibility = seen(left, right, disparities, min_disparity)
    validity, target = random_map(shape, 3, seed + 1), random_map(
        (shape[0], possibility.right.columns), min(disparities + 3, 256), seed + 2)
    target_range = min_disparity, min_disparity + shape[1] - 1
    views = [(view.census, view.slopes) for view in (possibility.left, possibility.right)]
    volume = twin_costs(left, right, disparities, min_disparity)
    return (*views, (validity, target, min_disparity)), dtype, lambda chromosome: twins.gene_costs(
        volume, chromosome, validity, target, target_range, HIDDEN, CONTRADICTED)


# ---- an exchange of genes ----


def smoothness(chromosome, penalties):
    """Return what jumps cost each gene: int64 (R, C)."""
    return twins.jump_costs(chromosome, *(number // SMOOTHNESS for number in penalties))


@settings(max_examples=80, deadline=None)
@given(sizes, sizes, st.sampled_from([2, 3, 12, 40, 300]), st.sampled_from([0, 3, 6, 9]),
       st.integers(0, 9), st.integers(0, 10**6))
def test_an_exchange_has_the_change_of_cost_from_the_first_parent_to_the_child(
        rows, columns, disparities, alike, small, seed):
    scene, dtype, twin = scene_of((rows, columns), disparities, 0, seed)
    first, second = (random_map((rows, columns), disparities, seed + k, dtype) for k in range(2))
    agree = random_map((rows, columns), 10, seed + 2) < alike
    second[agree] = first[agree]
    penalties = Penalties(
        SMOOTHNESS * small, *(random_map((rows, columns), 120, seed + k) for k in (3, 4)))
    exchange = Exchange(rows, columns, 4)
    exchange.set_size(differing_cells(first, second, exchange.all_cells))
    np.testing.assert_array_equal(exchange.cells, np.flatnonzero(first != second))
    exchange.pairs[:] = 99
    match_changes(*scene, first, second, exchange.cells, exchange.alone)
    add_jump_changes(*penalties, first, second, exchange.changes())

    def cost(chromosome):
        return int(twin(chromosome).sum() + smoothness(chromosome, penalties).sum())
    for share in (2, 5, 10):
        exchange.taken[:] = random_map((exchange.cells.size,), 10, share) < share
        child = first.copy()
        copy_taken(exchange.cells, exchange.taken, child, second)
        expected = first.copy()
        taken = exchange.cells[exchange.taken]
        expected.flat[taken] = second.flat[taken]
        np.testing.assert_array_equal(child, expected)
        assert reference_crossover.change_of(exchange, exchange.taken) == cost(child) - cost(first)


# ---- the fitness of whole chromosomes ----


def fitness_of(shape, disparities, min_disparity=0, seed=0):
    """Return a CensusFitness on a pair with a random validity, and twins of genes and fitness."""
    left, right = small_pair(*shape, seed=seed)
    possibility = seen(left, right, disparities, min_disparity)
    validity, target = random_map(shape, 3, seed + 1), random_map(
        (shape[0], possibility.right.columns), min(disparities, 256), seed + 2)
    measured = CensusFitness(possibility, validity, target)
    volume = twin_costs(left, right, disparities, min_disparity)

    def gene_costs_of(chromosome):
        return twins.gene_costs(
            volume, chromosome, validity, target, possibility.target_range, HIDDEN, CONTRADICTED)

    def fitness(chromosome, every=1):
        costs = gene_costs_of(chromosome) + smoothness(chromosome, possibility.penalties)
        return 1 - costs[::every].mean() / possibility.model.largest
    return measured, fitness, gene_costs_of


@pytest.mark.parametrize('min_disparity', [-200, -20, -3, 0, 4])
@pytest.mark.parametrize('shape', [(1, 1), (1, 20), (2, 2), (9, 21), (130, 5)])
def test_fitness_is_1_less_what_a_sample_costs_and_gains_are_those_of_all_genes(
        shape, min_disparity):
    measured, twin, _ = fitness_of(shape, 17, min_disparity)
    first, second = (random_map(shape, 17, seed) for seed in (3, 4))
    assert measured.measure(POOL, first)[0] == pytest.approx(twin(first, SAMPLE_STEP), abs=1e-12)
    before, other = twin(first), twin(second)
    gained = measured.cross(POOL, PartitionCrossover(*shape), RANDOM, first, second)
    assert before + gained == pytest.approx(twin(first), abs=1e-12)
    assert twin(first) >= max(before, other) - 1e-12


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 12), st.integers(2, 24), st.integers(1, 40), st.integers(0, 999),
       st.sampled_from([PartitionCrossover, partial(PartitionCrossover, advantage=2),
                        lambda rows, columns: Cut(rows, columns, 4), lambda *size: Line()]))
def test_crossing_again_and_again_never_loses_fitness(
        rows, columns, disparities, seed, crossover):
    measured, twin, _ = fitness_of((rows, columns), disparities, seed=seed)
    first, choose = random_map((rows, columns), disparities, seed), crossover(rows, columns)
    fitness = twin(first)
    for number in range(3):
        second = random_map((rows, columns), disparities, seed + 10 + number)
        gained = measured.cross(POOL, choose, RANDOM.child(number), first, second)
        assert gained >= 0
        fitness += gained
        assert fitness == pytest.approx(twin(first), abs=1e-12)


@pytest.mark.parametrize('shape', [(1, 1), (1, 40), (5, 1), (4, 40), (130, 5)])
@pytest.mark.parametrize('disparities', [1, 33, 256, 300])
@pytest.mark.parametrize('min_disparity', [-2048, -200, -20, -3, 0, 3])
def test_possibility_is_1_less_the_share_of_the_largest_cost(shape, disparities, min_disparity):
    measured, _, gene_costs_of = fitness_of(shape, disparities, min_disparity)
    for spread in {disparities, min(disparities, 20)}:
        asked = random_map(shape, spread, 5, gene_type(disparities))
        found = measured.possibility_of(POOL, asked)
        assert found.dtype == np.float32
        np.testing.assert_allclose(
            found, 1 - gene_costs_of(asked) / measured.largest_cost, atol=1e-6)
