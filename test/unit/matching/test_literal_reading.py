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


possibilities = arrays.arrays(
    np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 255))


def test_keys_differ_by_each_word_its_place_and_the_number_of_words():
    keys = [key_of(*given_words) for given_words in (
        (), (0,), (1,), (0, 0), (0, 1), (1, 0), (-1,), (2**63,), (1, 2, 3), (3, 2, 1))]
    assert len({int(key) for key in keys}) == len(keys)


@given(st.integers(1, 9), st.integers(1, 11), st.integers(1, 4096), st.integers(0, 99),
       st.sampled_from([0.0, 0.3, 1.0]))
def test_a_random_chromosome_is_that_of_the_twin(rows, columns, disparities, word, share):
    genes, key = np.full((rows, columns), 9999, np.uint16), key_of(5, word)
    expected = reference.random_genes(int(key), disparities, share, genes)
    scatter_random_genes(key, disparities, share, genes)
    np.testing.assert_array_equal(genes, expected)


@given(st.integers(2, 500), st.sampled_from([1, 3, 5, 31]), st.integers(0, 2**20))
def test_selection_crossover_and_mutation_draw_what_the_paper_allows(number, side, seed):
    draws, fitness, survival = np.random.default_rng(seed).random((3, number))
    survival[0] = draws[0]      # is not exceeded
    order = operators.fittest_first(np.floor(9 * fitness))      # equals stay in order
    assert order.tolist() == sorted(range(number), key=lambda one: -int(9 * fitness[one]))
    elite = operators.elite_size(number)
    assert abs(elite - operators.ELITE * number) <= 0.5
    lucky, chosen = np.flatnonzero(survival > draws), operators.survivors(survival, draws)
    assert chosen.tolist() == (lucky.tolist() if lucky.size >= 2 else [0, 1])
    parents = operators.parent_pairs(chosen, draws, fitness)
    assert np.isin(parents, chosen).all() and (parents[:, 0] != parents[:, 1]).all()
    draws[:2] = 0, 1 - 2**-53
    lines = operators.crossover_lines(number, draws)
    assert (lines.min(), lines.max()) == (1, number)
    patches = operators.patch_numbers(99 * number, side, draws)
    assert patches.min() == 1 and patches.max() <= max(99 * number // side**2, 1)


@given(possibilities, st.floats(0, 1))
def test_the_least_possible_cells_are_those_of_the_twin(chosen, share):
    level, ties = operators.least_possible_level(chosen, share)
    counts = np.bincount(chosen.ravel(), minlength=256).astype(float)
    counts[level] *= ties
    counts[level + 1:] = 0
    assert 0 <= ties <= 1 + 1e-9
    assert counts.tolist() == pytest.approx(
        reference.least_possible_cells(chosen, share), abs=1e-6)


@settings(max_examples=60)
@given(possibilities, st.integers(0, 2**64 - 1), st.integers(1, 20), st.sampled_from([1, 3, 5]))
def test_patches_fall_as_those_of_the_twin(chosen, key, patches, neighbourhood):
    parent = np.full(chosen.shape, 777, np.uint16)
    level, ties = operators.least_possible_level(chosen, 0.4)
    expected = reference.thrown_patches(
        key, patches, neighbourhood, 60, chosen, level, ties, parent)
    mutant = parent.copy()
    place_patches(np.uint64(key), patches, neighbourhood, 60, chosen, level, ties, mutant)
    np.testing.assert_array_equal(mutant, expected)
