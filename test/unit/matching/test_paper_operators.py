# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Who lives, who mates, crossover and mutation; random chromosomes and their chance."""
from fuzzy_stereo_ros.matching.kernels.genetic.literal_reading import (
    least_possible_level, place_patches)
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import (
    below, fill_random_genes, fill_uniform, key_of, mixed, scatter_random_genes)
from fuzzy_stereo_ros.matching.paper import operators
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
import reference

words = st.integers(0, 2**64 - 1)
fitnesses = arrays.arrays(np.float64, st.integers(2, 30), elements=st.integers(0, 2**40))
units = st.floats(0, 1, exclude_max=True)
possibilities = arrays.arrays(
    np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 255))


def draws_for(data, number):
    return data.draw(arrays.arrays(np.float64, number, elements=units))


# ---- chance ----


@settings(deadline=None)
@given(words, words)
def test_mixed_is_split_mix_64(key, counter):
    assert int(mixed(np.uint64(key), np.uint64(counter))) == reference.mixed(key, counter)


def test_split_mix_64_starts_as_its_authors_say():
    assert reference.mixed(0, 0) == 0xE220A8397B1DCDAF
    assert reference.mixed(0, 1) == 0x6E789E6AA1B965F4


@settings(deadline=None)
@given(words, st.integers(1, 2**32))
def test_below_stays_below_its_limit(bits, limit):
    assert 0 <= below(np.uint64(bits), np.uint64(limit)) < limit


def test_keys_differ_by_each_word_its_place_and_the_number_of_words():
    keys = [key_of(*given_words) for given_words in (
        (), (0,), (1,), (0, 0), (0, 1), (1, 0), (-1,), (2**63,), (1, 2, 3), (3, 2, 1))]
    assert len({int(key) for key in keys}) == len(keys)


def test_the_numbers_of_a_key_are_no_keys():
    assert int(mixed(key_of(1, 2), np.uint64(3))) != int(key_of(1, 2, 3))


def test_uniform_numbers_fill_the_unit_interval_evenly():
    draws = np.zeros(20000)
    fill_uniform(key_of(7), draws)
    assert 0 <= draws.min() < 0.001 < 0.999 < draws.max() < 1
    counts = np.histogram(draws, 10, (0, 1))[0]
    assert np.abs(counts - 2000).max() < 5 * np.sqrt(2000)


@pytest.mark.parametrize('shape', [(7, 11), (1, 9), (9, 1)])
@pytest.mark.parametrize('disparities', [1, 2, 60, 4096])
def test_a_random_chromosome_is_that_of_the_twin(shape, disparities):
    genes = np.zeros(shape, np.uint16)
    key = key_of(5, 6)
    fill_random_genes(key, disparities, genes)
    np.testing.assert_array_equal(
        genes, reference.random_genes(int(key), disparities, *shape))


def test_random_genes_are_uniform():
    genes = np.zeros((100, 100), np.uint16)
    fill_random_genes(key_of(1), 10, genes)
    counts = np.bincount(genes.ravel(), minlength=10)
    assert counts.size == 10
    assert np.abs(counts - 1000).max() < 5 * np.sqrt(1000)


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


@given(st.integers(2, 1000), st.floats(0, 1))
def test_the_elite_is_the_share_rounded_and_at_least_the_fittest(population, share):
    size = operators.elite_size(population, share)
    assert 1 <= size <= population
    assert abs(size - share * population) <= 0.5 or size == 1


def test_the_elite_of_the_paper_is_28_of_70():
    assert operators.elite_size(70, 0.4) == 28


def test_survival_by_rank_falls_evenly_from_one():
    assert operators.rank_survival(4).tolist() == [1, .75, .5, .25]


@given(st.integers(1, 30), st.data())
def test_who_survives_had_more_probability_than_its_random_number(number, data):
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


def test_every_couple_is_equally_likely():
    draws = np.zeros((2, 12000))
    fill_uniform(key_of(3), draws.reshape(-1))
    parents = operators.parent_pairs(np.arange(4), *draws)
    counts = np.bincount(parents[:, 0] * 4 + parents[:, 1], minlength=16).reshape(4, 4)
    assert np.all(np.diag(counts) == 0)
    assert np.abs(counts[~np.eye(4, dtype=bool)] - 1000).max() < 5 * np.sqrt(1000)


# ---- crossover ----


@given(st.integers(1, 500), st.data())
def test_the_line_of_crossover_is_from_1_to_r(rows, data):
    lines = operators.crossover_lines(rows, draws_for(data, 5))
    assert np.all((lines >= 1) & (lines <= rows))
    assert operators.crossover_lines(rows, np.array([0.0, 1 - 2**-53])).tolist() == [1, rows]


# ---- mutation ----


def mutate(key, rate, patches, neighbourhood, disparities, chosen, chromosome):
    level, share_of_ties = least_possible_level(chosen, rate)
    place_patches(key, patches, neighbourhood, disparities, chosen, level, share_of_ties,
                  chromosome)


@given(st.integers(1, 200000), st.sampled_from([1, 3, 5, 31]), st.data())
def test_patches_are_one_to_as_many_as_cover_the_image(cells, neighbourhood, data):
    numbers = operators.patch_numbers(cells, neighbourhood, draws_for(data, 6))
    assert numbers.min() >= 1
    assert numbers.max() == 1 or numbers.max() * neighbourhood**2 <= cells


def test_each_order_of_magnitude_of_patches_is_as_likely_as_the_next():
    numbers = operators.patch_numbers(1000, 1, (np.arange(3000) + 0.5) / 3000)
    for low in (1, 10, 100):
        assert abs(np.sum((numbers >= low) & (numbers < 10 * low)) - 1000) <= 1


@settings(deadline=None)
@given(possibilities, st.floats(0, 1))
def test_the_least_possible_cells_are_those_of_the_twin(chosen, share):
    level, ties = least_possible_level(chosen, share)
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
    level, ties = least_possible_level(chosen, 0.4)
    expected = reference.thrown_patches(
        key, patches, neighbourhood, 60, chosen, level, ties, parent)
    mutant = parent.copy()
    place_patches(np.uint64(key), patches, neighbourhood, 60, chosen, level, ties, mutant)
    np.testing.assert_array_equal(mutant, expected)


def test_mutation_without_a_neighbourhood_strikes_the_least_possible_cells_only():
    chosen = np.arange(100, dtype=np.uint8).reshape(10, 10)
    chromosome = np.full((10, 10), 999, np.uint16)
    for key in range(30):
        mutate(np.uint64(key), 0.4, 100, 1, 60, chosen, chromosome)
    assert np.all(chromosome[4:] == 999)
    assert np.all(chromosome[:4] < 60)


def test_of_equally_possible_cells_mutation_strikes_the_given_share():
    chosen = np.full((100, 100), 50, np.uint8)
    mutated = 0
    for key in range(20):
        chromosome = np.full((100, 100), 999, np.uint16)
        mutate(np.uint64(key), 0.4, 500, 1, 60, chosen, chromosome)
        mutated += np.sum(chromosome < 999)
    # 10000 throws, 4000 of them hits, of which about 1 in 40 twice at the same cell
    assert 3700 < mutated < 4100


def test_a_patch_is_uniform_and_has_the_size_of_n():
    chosen = np.full((20, 20), 50, np.uint8)
    chosen[9, 11] = 0
    chromosome = np.full((20, 20), 999, np.uint16)
    mutate(np.uint64(1), 1 / 400, 5000, 5, 60, chosen, chromosome)
    rows, columns = np.nonzero(chromosome < 999)
    assert set(zip(rows.tolist(), columns.tolist())) == {
        (row, column) for row in range(7, 12) for column in range(9, 14)}
    assert len(set(chromosome[chromosome < 999].tolist())) == 1


def test_mutation_at_rate_0_changes_nothing():
    chosen = np.zeros((6, 6), np.uint8)
    chromosome = np.full((6, 6), 999, np.uint16)
    mutate(np.uint64(1), 0.0, 100, 3, 60, chosen, chromosome)
    assert np.all(chromosome == 999)
