# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The literal reading: Eq. 3 and Eq. 4, who lives, crossover, mutation, and their random."""
from fuzzy_stereo_ros.matching.kernels.genetic.literal_reading import (
    fill_row_fitness, place_patches)
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import (
    key_of, scatter_random_genes)
from fuzzy_stereo_ros.matching.paper import operators
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
import reference


def test_the_largest_sums_do_not_overflow():
    columns, side = 400, 31
    chosen = np.full((side, columns), 255, np.uint8)
    gradient = np.full((side, columns), 1443, np.uint16)
    found = np.zeros(side, np.int64)
    fill_row_fitness(chosen, np.zeros((side, columns), np.uint16), (gradient, gradient), side,
                     0, side, found)
    in_full = 255 * side * side * 1443**2
    missing = 2 * sum(255 * side * 1443**2 * short for short in range(1, side // 2 + 1))
    assert found[side // 2] == in_full * columns - missing


words = st.integers(0, 2**64 - 1)
fitnesses = arrays.arrays(np.float64, st.integers(2, 30), elements=st.integers(0, 2**40))
units = st.floats(0, 1, exclude_max=True)
possibilities = arrays.arrays(
    np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 255))


def draws_for(data, number):
    return data.draw(arrays.arrays(np.float64, number, elements=units))


# ---- random ----


def test_keys_differ_by_each_word_its_place_and_the_number_of_words():
    keys = [key_of(*given_words) for given_words in (
        (), (0,), (1,), (0, 0), (0, 1), (1, 0), (-1,), (2**63,), (1, 2, 3), (3, 2, 1))]
    assert len({int(key) for key in keys}) == len(keys)


@pytest.mark.parametrize('shape', [(7, 11), (1, 9), (9, 1)])
@pytest.mark.parametrize('disparities', [1, 2, 60, 4096])
def test_a_random_chromosome_is_that_of_the_twin(shape, disparities):
    genes = np.zeros(shape, np.uint16)
    key = key_of(5, 6)
    scatter_random_genes(key, disparities, 1.0, genes)
    np.testing.assert_array_equal(
        genes, reference.random_genes(int(key), disparities, *shape))


def test_of_the_genes_of_a_chromosome_the_given_share_is_drawn_anew():
    genes = np.full((100, 100), 999, np.uint16)
    scatter_random_genes(key_of(2), 10, 0.3, genes)
    mutated = genes[genes != 999]
    assert abs(mutated.size - 3000) < 5 * np.sqrt(2100)
    counts = np.bincount(mutated, minlength=10)
    assert counts.size == 10
    assert np.abs(counts - mutated.size / 10).max() < 5 * np.sqrt(mutated.size / 10)


# ---- selection ----


@given(fitnesses)
def test_the_fittest_come_first_and_equals_stay_in_order(fitness):
    order = operators.fittest_first(fitness)
    assert sorted(order) == list(range(fitness.size))
    assert all((-fitness[a], a) < (-fitness[b], b) for a, b in zip(order, order[1:]))


@given(st.integers(2, 1000))
def test_the_elite_is_the_share_rounded_and_at_least_the_fittest(population):
    size = operators.elite_size(population)
    assert 1 <= size <= population
    assert abs(size - operators.ELITE * population) <= 0.5 or size == 1


@given(st.integers(1, 30), st.data())
def test_survivors_have_a_probability_above_their_random_number(number, data):
    survival, draws = (draws_for(data, number) for _ in range(2))
    chosen = operators.survivors(survival, draws)
    lucky = np.flatnonzero(survival > draws)
    expected = lucky if lucky.size >= 2 else np.arange(min(2, number))
    assert chosen.tolist() == expected.tolist()


@given(st.integers(2, 30), st.data())
def test_parents_are_two_different_survivors(number, data):
    chosen = np.arange(100, 100 + number)
    parents = operators.parent_pairs(chosen, draws_for(data, 12), draws_for(data, 12))
    assert parents.shape == (12, 2)
    assert np.isin(parents, chosen).all()
    assert np.all(parents[:, 0] != parents[:, 1])


# ---- crossover ----


@given(st.integers(1, 500), st.data())
def test_the_line_of_crossover_is_from_1_to_r(rows, data):
    lines = operators.crossover_lines(rows, draws_for(data, 5))
    assert np.all((lines >= 1) & (lines <= rows))
    assert operators.crossover_lines(rows, np.array([0.0, 1 - 2**-53])).tolist() == [1, rows]


# ---- mutation ----


@given(st.integers(1, 200000), st.sampled_from([1, 3, 5, 31]), st.data())
def test_patches_are_one_to_as_many_as_cover_the_image(cells, neighbourhood, data):
    numbers = operators.patch_numbers(cells, neighbourhood, draws_for(data, 6))
    assert numbers.min() >= 1
    assert numbers.max() == 1 or numbers.max() * neighbourhood**2 <= cells


@settings(deadline=None)
@given(possibilities, st.floats(0, 1))
def test_the_least_possible_cells_are_those_of_the_twin(chosen, share):
    level, ties = operators.least_possible_level(chosen, share)
    counts = np.bincount(chosen.ravel(), minlength=256).astype(float)
    counts[level] *= ties
    counts[level + 1:] = 0
    assert 0 <= ties <= 1 + 1e-9
    assert counts.tolist() == pytest.approx(
        reference.least_possible_cells(chosen, share), abs=1e-6)


@settings(deadline=None, max_examples=60)
@given(possibilities, words, st.integers(1, 20), st.sampled_from([1, 3, 5]))
def test_patches_fall_as_those_of_the_twin(chosen, key, patches, neighbourhood):
    parent = np.full(chosen.shape, 777, np.uint16)
    level, ties = operators.least_possible_level(chosen, 0.4)
    expected = reference.thrown_patches(
        key, patches, neighbourhood, 60, chosen, level, ties, parent)
    mutant = parent.copy()
    place_patches(np.uint64(key), patches, neighbourhood, 60, chosen, level, ties, mutant)
    np.testing.assert_array_equal(mutant, expected)
