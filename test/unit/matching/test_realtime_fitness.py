# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fitness of the profile `realtime`, and what an exchange of genes changes of it."""
from functools import partial

from bench.variants import Line
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Cut, PartitionCrossover
from fuzzy_stereo_ros.matching.evolution import Random
from fuzzy_stereo_ros.matching.kernels.genetic.gene_cost import (
    CONTRADICTED, HIDDEN, SMOOTHNESS)
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import Penalties
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness, SAMPLE_STEP
from fuzzy_stereo_ros.matching.realtime.generation import gene_type
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from reference_crossover import change_of
import reference_search as twins

POOL = ThreadPool(1)
CROSSOVERS = [PartitionCrossover, partial(PartitionCrossover, advantage=2),
              partial(Cut, neighbours=4), lambda *size: Line()]


@settings(max_examples=24)
@given(st.integers(1, 12) | st.just(130), st.integers(1, 24), st.sampled_from(
           [1, 2, 3, 12, 40, 256, 300]), st.sampled_from([-2048, -280, -20, -3, 0, 3]),
       st.sampled_from([0, 3, 6, 9]), st.sampled_from(CROSSOVERS), st.integers(0, 10**6))
def test_fitness_and_what_an_exchange_changes_of_it_are_those_of_the_twins(
        rows, columns, disparities, min_disparity, alike, crossover, seed):
    """Of genes one by one, a sample, and whatever cells a crossover takes: none at a loss."""
    shape, random = (rows, columns), np.random.default_rng(seed)
    left, right = small_pair(*shape, seed=seed)
    possibility = seen(left, right, disparities, min_disparity)
    penalties = possibility.penalties = Penalties(
        SMOOTHNESS * (seed % 10), *(random_map(shape, 120, seed + k) for k in (3, 4)))
    validity, target = random_map(shape, 3, seed + 1), random_map(
        (rows, possibility.right.columns), min(disparities + 3, 256), seed + 2)
    volume = twin_costs(left, right, disparities, min_disparity)
    measured = CensusFitness(possibility, validity, target)

    def gene_costs(chromosome):
        return twins.gene_costs(volume, chromosome, validity, target, possibility.target_range,
                                HIDDEN, CONTRADICTED)

    def costs(chromosome):
        return gene_costs(chromosome) + twins.jump_costs(
            chromosome, *(number // SMOOTHNESS for number in penalties))

    def choose(exchange, source):
        np.testing.assert_array_equal(exchange.cells, np.flatnonzero(first != second))
        for share in (0.2, 0.5, 1):
            taken, child = random.random(exchange.cells.size) < share, first.copy()
            child.flat[exchange.cells[taken]] = second.flat[exchange.cells[taken]]
            assert change_of(exchange, taken) == (costs(child) - costs(first)).sum()
        return crossover(*shape)(exchange, source)

    def genes():
        return random.integers(0, min(disparities, 3 * 10**(alike // 3)), shape).astype(
            gene_type(disparities))

    first, largest = genes(), measured.largest_cost
    np.testing.assert_allclose(
        measured.possibility_of(POOL, first), 1 - gene_costs(first) / largest, atol=1e-6)
    assert measured.measure(POOL, first)[0] == pytest.approx(
        1 - costs(first)[::SAMPLE_STEP].mean() / largest, abs=1e-12)
    for number in range(2):
        second, before = genes(), costs(first).mean()
        same = random.random(shape) < alike / 10
        second[same] = first[same]
        gained = measured.cross(POOL, choose, Random((seed, number)), first, second)
        assert gained >= 0
        assert before - gained * largest == pytest.approx(costs(first).mean(), abs=1e-9)
        assert crossover is not PartitionCrossover or costs(first).mean() <= costs(second).mean()
