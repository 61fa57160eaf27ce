# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Both readings of the paper: who lives, crossover, mutation, weights, random numbers."""
from fuzzy_stereo_ros.matching.kernels.genetic.literal_reading import (
    fill_row_fitness, place_patches)
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import key_of, scatter_random_genes
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import (
    fill_chosen, fill_fitness, fill_neighbour_weights, FRAME, larger_halves, mutate_by_patches,
    UNIFORM, WEIGHTS)
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.fitness import inside
from fuzzy_stereo_ros.matching.paper.possibility import uniform_membership
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
def test_the_least_possible_cells_are_a_share_of_all(chosen, share):
    level, ties = operators.least_possible_level(chosen, share)
    counts = np.bincount(chosen.ravel(), minlength=256).astype(float)
    counts[level] *= ties
    counts[level + 1:] = 0
    assert 0 <= ties <= 1 + 1e-9
    until = np.bincount(chosen.ravel(), minlength=256).cumsum()
    assert counts.tolist() == pytest.approx(
        np.diff(np.minimum(until, share * chosen.size), prepend=0), abs=1e-6)


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


def framed(values):
    """Return planes of whole numbers, (n, R, C), in a frame as kernels take them."""
    memory = np.zeros((len(values), values.shape[1] + 2, values.shape[2] + FRAME), np.uint8)
    inside(memory)[:] = values
    return memory


def weights_of(colours):
    """Return the weights of the eight neighbours of framed colours, framed."""
    weights = np.zeros((8, *colours.shape[1:]), np.uint8)
    fill_neighbour_weights(colours, uniform_membership(), 0, colours.shape[1] - 2, weights)
    return weights


@settings(max_examples=20)
@given(st.integers(1, 9), st.integers(1, 12), st.sampled_from([(0, 1), (90, 120), (0, 256)]))
def test_weights_are_whole_parts_by_uniformity_and_none_leads_outside(rows, columns, limits):
    colours = np.random.default_rng(0).integers(*limits, (3, rows, columns))
    weights, similar = inside(weights_of(framed(colours))), uniform_membership()
    np.testing.assert_array_equal(weights.sum(axis=0), WEIGHTS * ((rows, columns) != (1, 1)))
    for row, column in np.ndindex(rows, columns) if rows * columns > 1 else ():
        shares = np.zeros(8)
        for side, (down, right) in enumerate(reference.AROUND):
            if 0 <= row + down < rows and 0 <= column + right < columns:
                apart = colours[:, row, column] - colours[:, row + down, column + right]
                shares[side] = similar[min(np.sum(apart**2) // 4, similar.size - 1)]
        apart = weights[:, row, column] - WEIGHTS * shares / shares.sum()
        heaviest = shares.argmax()
        assert ((apart > -1) & (apart <= 1e-4))[np.arange(8) != heaviest].all()
        assert -1e-4 <= apart[heaviest] < 8


@pytest.mark.parametrize('apart, together', [(UNIFORM, True), (UNIFORM + 1, False)])
def test_a_patch_holds_the_cells_that_are_uniform_with_its_middle(apart, together):
    """Of two walls of different colour a patch strikes one, although all cells would gain."""
    colours = framed(np.array([[[100, 100]], [[100, 100 + apart]], [[100, 100]]]))
    planes = framed(np.where(np.arange(6) == 4, 255, 10).repeat(2).reshape(6, 1, 2))
    mutated = set()
    weights = weights_of(colours)
    for key in range(300):
        genes, chosen, fitness = (np.zeros(planes.shape[1:], kind)
                                  for kind in (np.uint16, np.uint8, np.uint16))
        fill_chosen(planes, genes, 0, 1, chosen)
        fill_fitness(genes, chosen, weights, 2, 0, 1, fitness)
        mutate_by_patches(key_of(key), 1, larger_halves(2), planes, colours, weights,
                          (genes, chosen, fitness))
        mutated.add(tuple(inside(genes)[0].tolist()))
    assert ((4, 4) in mutated) == together
