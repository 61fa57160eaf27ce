# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fitness of the guided search, partition crossover and aimed mutation."""
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.kernels.genetic.aimed_mutation import count_costs, mutate_patches
from fuzzy_stereo_ros.matching.kernels.genetic.gene_cost import cell_costs, gene_costs, Scene
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import key_of
from fuzzy_stereo_ros.matching.kernels.partition import differing_cells, partition_crossover
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import CONSISTENT, REFUSED
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import Penalties
from fuzzy_stereo_ros.matching.realtime.fitness import (
    ADVANTAGE, CensusFitness, CONTRADICTED, HIDDEN, SAMPLE_STEP, SMOOTHNESS)
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_search as twins

CREW = Crew(1)
sizes = st.integers(1, 9)


# ---- what genes cost ----


def scene_of(shape, disparities, min_disparity, seed=0):
    """Return a possibility and a Scene of random verdict, and the twin's cost of chromosomes."""
    left, right = small_pair(*shape, seed=seed)
    dtype = gene_type(disparities)
    possibility = seen(left, right, disparities, min_disparity)
    verdict, target = random_map(shape, 3, seed + 1), random_map(
        (shape[0], possibility.right.columns), 256, seed + 2)
    inside = min_disparity, min_disparity + shape[1] - 1
    scene = Scene(verdict, target, inside, HIDDEN, CONTRADICTED)
    volume = twin_costs(left, right, disparities, min_disparity)
    return (possibility, scene), dtype, lambda chromosome: twins.gene_costs(
        volume, chromosome, verdict, target, inside, HIDDEN, CONTRADICTED)


def fields(scene):
    """Return the features of a possibility and a Scene, as kernels take them."""
    return tuple(scene[0].features), tuple(scene[1])


@pytest.mark.parametrize('shape', [(1, 1), (1, 40), (5, 1), (2, 2), (4, 40)])
@pytest.mark.parametrize('disparities', [1, 33, 256, 300])
@pytest.mark.parametrize('min_disparity', [-2048, -200, -20, -3, 0, 3])
def test_genes_cost_what_the_twin_says(shape, disparities, min_disparity):
    scene, dtype, twin = scene_of(shape, disparities, min_disparity)
    for seed, spread in enumerate((disparities, min(disparities, 20))):
        chromosome = random_map(shape, spread, seed, dtype)
        costs = np.full(shape, 99, np.uint8)
        gene_costs(*fields(scene), chromosome, costs, 1, 0, shape[0])
        np.testing.assert_array_equal(costs, twin(chromosome))


def test_the_genes_of_some_cells_cost_what_they_do_among_all():
    scene, dtype, twin = scene_of((6, 30), 25, 0)
    mother, father = (random_map((6, 30), 3, seed, dtype) for seed in (1, 2))
    cells, costs = np.zeros(181, np.int32), np.full((6, 30), 99, np.uint8)
    number = differing_cells(mother, father, cells)
    cell_costs(*fields(scene), father, cells[:number], costs)
    np.testing.assert_array_equal(costs, np.where(mother == father, 99, twin(father)))


@pytest.mark.parametrize('first, last, looked_at', [(0, 9, [0, 4, 8]), (1, 8, [4]), (5, 8, [])])
def test_a_sample_of_rows_is_that_of_the_image_not_of_the_band(first, last, looked_at):
    scene, dtype, twin = scene_of((9, 30), 25, 0)
    chromosome = random_map((9, 30), 9, 1, dtype)
    costs = np.full((9, 30), 99, np.uint8)
    gene_costs(*fields(scene), chromosome, costs, 4, first, last)
    expected = np.full((9, 30), 99)
    expected[looked_at] = twin(chromosome)[looked_at]
    np.testing.assert_array_equal(costs, expected)


@pytest.mark.parametrize('disparities, nearer, cost', [
    (64, 2, HIDDEN), (64, -2, CONTRADICTED), (300, 2, HIDDEN), (300, -2, CONTRADICTED)])
def test_a_refused_gene_is_hidden_behind_what_is_nearer_and_contradicts_what_is_farther(
        disparities, nearer, cost):
    label = disparities - 10
    scene, dtype, _ = scene_of((1, 320), disparities, 0)
    scene[1].verdict[:], scene[1].target[:] = REFUSED, (label + nearer) % 256
    costs = np.zeros((1, 320), np.uint8)
    gene_costs(*fields(scene), np.full((1, 320), label, dtype), costs, 1, 0, 1)
    assert np.all(costs[0, label:] == cost)
    assert np.all(costs[0, :label] == HIDDEN)       # outside of the target


# ---- partition crossover, with costs made up ----


@st.composite
def crossings(draw):
    """Return mother, father, what their genes cost, and the penalties of jumps."""
    shape, seed = (draw(sizes), draw(sizes)), draw(st.integers(0, 10**6))
    values = draw(st.sampled_from([2, 3, 6]))
    dtype = draw(st.sampled_from([np.uint8, np.uint16]))
    mother, father = (random_map(shape, values, seed + k, dtype) for k in range(2))
    agree = random_map(shape, 10, seed + 2) < draw(st.sampled_from([0, 3, 6, 9]))
    father[agree] = mother[agree]
    costs = [random_map(shape, draw(st.sampled_from([1, 16, 200])), seed + k) for k in (3, 4)]
    across, down = (random_map(shape, 30, seed + k) for k in (5, 6))
    return mother, father, *costs, Penalties(draw(st.integers(0, 9)), across, down)


def cost_of(crossing):
    """Return a function: the cost of a chromosome made of genes of both parents."""
    mother, _, mother_costs, father_costs, penalties = crossing

    def cost(chromosome):
        genes = np.where(chromosome == mother, mother_costs, father_costs)
        return int(genes.sum(dtype=np.int64)) + int(twins.jump_costs(chromosome, *penalties).sum())
    return cost


def crossed(crossing, advantage=0):
    mother, father, mother_costs, father_costs, penalties = crossing
    child, costs = mother.copy(), mother_costs.copy()
    parent, change, size = (np.full(mother.size // 2 + 2, -7, np.int32) for _ in range(3))
    cells, regions = np.zeros(mother.size + 1, np.int32), np.zeros(mother.shape, np.int32)
    number = differing_cells(mother, father, cells)
    np.testing.assert_array_equal(cells[:number], np.flatnonzero(mother != father))
    saved, dearer = partition_crossover(
        *penalties, child, costs, father, father_costs, cells[:number], advantage, regions,
        parent, change, size)
    assert not regions.any()
    return child, costs, saved, dearer


@settings(max_examples=200, deadline=None)
@given(crossings(), st.sampled_from([0, 1, 3]))
def test_each_region_is_that_of_the_fitter_parent_as_found_by_trying_them_all(
        crossing, advantage):
    mother, father = crossing[:2]
    cost = cost_of(crossing)
    child, costs, saved, dearer = crossed(crossing, advantage)
    np.testing.assert_array_equal(
        child, twins.partition_crossover(cost, mother, father, advantage))
    np.testing.assert_array_equal(costs, np.where(child == mother, *crossing[2:4]))
    assert saved == cost(mother) - cost(child)
    assert dearer == cost(father) - cost(mother)


@settings(max_examples=100, deadline=None)
@given(crossings())
def test_a_child_is_at_least_as_fit_as_both_parents(crossing):
    cost = cost_of(crossing)
    child = crossed(crossing)[0]
    assert cost(child) <= min(cost(crossing[0]), cost(crossing[1]))


@pytest.mark.parametrize('shape', [(1, 1), (1, 2), (2, 1), (3, 3), (7, 9), (8, 8)])
def test_the_memory_is_enough_for_a_chessboard_of_differences(shape):
    mother = np.zeros(shape, np.uint8)
    father = (np.indices(shape).sum(axis=0) % 2 == 0).astype(np.uint8)
    nothing = np.zeros(shape, np.uint8)
    crossing = (mother, father, np.full(shape, 5, np.uint8), nothing,
                Penalties(0, nothing, nothing))
    child, _, saved, _ = crossed(crossing)
    np.testing.assert_array_equal(child, father)
    assert saved == 5 * father.sum()


# ---- the fitness of whole chromosomes ----


def fitness_of(shape, disparities, min_disparity=0, seed=0):
    """Return a CensusFitness on a pair with a random verdict, and twins of genes and fitness."""
    left, right = small_pair(*shape, seed=seed)
    possibility = seen(left, right, disparities, min_disparity)
    verdict, target = random_map(shape, 3, seed + 1), random_map(
        (shape[0], possibility.right.columns), disparities, seed + 2)
    measured = CensusFitness(possibility, verdict, target)
    inside = min_disparity, min_disparity + shape[1] - 1
    measured.look(CREW, inside)
    volume = twin_costs(left, right, disparities, min_disparity)
    penalties = possibility.penalties

    def gene_costs_of(chromosome):
        return twins.gene_costs(volume, chromosome, verdict, target, inside, HIDDEN, CONTRADICTED)

    def fitness(chromosome, every=1):
        costs = gene_costs_of(chromosome) + twins.jump_costs(
            chromosome, penalties.small // SMOOTHNESS, penalties.across // SMOOTHNESS,
            penalties.down // SMOOTHNESS)
        return 1 - costs[::every].mean() / possibility.model.largest
    return measured, fitness, gene_costs_of


@pytest.mark.parametrize('min_disparity', [-200, -20, -3, 0, 4])
@pytest.mark.parametrize('shape', [(1, 1), (1, 20), (2, 2), (9, 21), (130, 5)])
def test_fitness_is_1_less_what_a_sample_costs_and_gains_are_those_of_all_genes(
        shape, min_disparity):
    measured, twin, _ = fitness_of(shape, 17, min_disparity)
    mother, father = (random_map(shape, 17, seed) for seed in (3, 4))
    assert measured.adopt(CREW, mother) == pytest.approx(
        twin(mother, SAMPLE_STEP), abs=1e-12)
    before, father_fitness = twin(mother), twin(father)
    gained, ahead = measured.join(CREW, mother, father)
    assert gained >= 0
    assert before + gained == pytest.approx(twin(mother), abs=1e-12)
    assert before + ahead == pytest.approx(father_fitness, abs=1e-12)
    least = father_fitness - ADVANTAGE / measured.dearest      # all cells differ at the most
    assert twin(mother) >= max(before, least) - 1e-12


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 12), st.integers(2, 24), st.integers(1, 40), st.integers(0, 999))
def test_crossing_again_and_again_never_loses_fitness(rows, columns, disparities, seed):
    measured, twin, _ = fitness_of((rows, columns), disparities, seed=seed)
    mother = random_map((rows, columns), disparities, seed)
    measured.adopt(CREW, mother)
    fitness = twin(mother)
    for father_seed in range(3):
        father = random_map((rows, columns), disparities, seed + 10 + father_seed)
        gained, ahead = measured.join(CREW, mother, father)
        assert gained >= max(ahead - ADVANTAGE / measured.dearest, 0)
        fitness += gained
        assert fitness == pytest.approx(twin(mother), abs=1e-12)


def test_an_equal_pair_seen_as_it_is_has_fitness_1():
    left, _ = small_pair(12, 20)
    nothing = np.zeros((12, 20), np.uint8)
    measured = CensusFitness(seen(left, left, 8), nothing + CONSISTENT, nothing)
    measured.look(CREW, (0, 19))
    assert measured.adopt(CREW, nothing.copy()) == 1


@pytest.mark.parametrize('shape', [(1, 1), (9, 21), (130, 5)])
def test_possibility_is_1_less_the_share_of_the_dearest_and_asking_leaves_no_trace(shape):
    measured, twin, gene_costs_of = fitness_of(shape, 17)
    mother, father, asked = (random_map(shape, 17, seed) for seed in (3, 4, 5))
    before, father_fitness = twin(mother), twin(father)
    measured.adopt(CREW, mother)
    measured.aim(CREW, mother, 0.4)         # from now on the costs of the mother are known
    found = measured.possibility_of(CREW, asked)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, 1 - gene_costs_of(asked) / measured.dearest, atol=1e-6)
    assert before + measured.join(CREW, mother, father)[1] == pytest.approx(
        father_fitness, abs=1e-12)


# ---- mutation ----


def test_costs_are_counted_on_a_grid():
    costs = random_map((13, 22), 40, 1)
    histogram = np.full(256, 99)
    count_costs(costs, histogram, 4)
    np.testing.assert_array_equal(histogram, np.bincount(costs[::4, ::4].ravel(), minlength=256))


@settings(max_examples=40, deadline=None)
@given(sizes, st.integers(1, 30), st.integers(0, 16), st.integers(0, 3), st.integers(0, 20),
       st.integers(0, 12), st.integers(0, 2**63), st.booleans())
def test_mutants_are_those_of_the_twin(rows, columns, dear, radius, reach, patches, word, wide):
    dtype, spread = (np.uint16, 500) if wide else (np.uint8, 200)
    parent, costs = random_map((rows, columns), spread, 1, dtype), random_map(
        (rows, columns), 17, 2)
    key, child = key_of(word), parent.copy()
    mutate_patches(parent, costs, child, dear, radius, reach, patches, key)
    np.testing.assert_array_equal(
        child, twins.mutated(parent, costs, dear, radius, reach, patches, int(key)))


@pytest.mark.parametrize('rate', [0.0, 0.3, 0.7, 1.0])
def test_mutation_strikes_only_its_share_of_the_cells_the_least_possible_ones(rate):
    shape = (64, 80)
    measured, _, gene_costs_of = fitness_of(shape, 17)
    mother = random_map(shape, 17, 3)
    costs = gene_costs_of(mother)
    measured.aim(CREW, mother, rate)
    looked_at = costs[::SAMPLE_STEP, ::SAMPLE_STEP]
    level = next(level for level in range(1, 257) if np.mean(looked_at >= level) <= rate)
    mutants = [mother.copy() for _ in range(2)]
    for word, mutant in enumerate(mutants):
        measured.mutate(mother, mutant, 2, 16, 4000, key_of(word))
    struck = mutants[0] != mother
    assert not struck[costs < level].any()
    if np.any(costs >= level):
        assert struck[costs >= level].mean() > 0.8
        assert not np.array_equal(*mutants)
