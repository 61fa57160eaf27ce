# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile `paper` as a whole, in its readings."""
from itertools import pairwise

import cv2
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Budget, Random
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.matcher import CALIBRATION, PaperMatcher
from hypothesis import given, settings, strategies as st
from made_scenes import shifted_pair
import numpy as np
import pytest
import reference

ROWS, COLUMNS, DISPARITIES = 21, 33, 6
READINGS = ['literal', 'uniform']
INITIAL = ['random', 'winner_takes_all']


def config_for(**changes):
    settings = {'disparities': DISPARITIES, 'population': 20, 'generations': 8, 'threads': 1,
                'neighbourhood': 5, 'warm_start': False}
    return MatcherConfig.from_profile('paper', **{**settings, **changes})


def evolved(**changes):
    """Return the matcher of a wall and what it returned."""
    config, matcher = config_for(**changes), PaperMatcher(config_for(**changes), ROWS, COLUMNS)
    match, state = matcher.match(*shifted_pair(3, ROWS, COLUMNS), None, Random((0, 0)),
                                 Budget(config.generations, 0, 0))
    assert state is None
    return matcher, match


@settings(max_examples=40)
@given(st.integers(1, 14), st.integers(2, 40), st.integers(1, 20),
       st.integers(-5, 9) | st.just(30), st.sampled_from([1, 3, 31]),
       st.sampled_from(READINGS), st.sampled_from(INITIAL))
def test_every_fitness_of_every_generation_is_that_of_the_twin(
        rows, columns, disparities, min_disparity, neighbourhood, reading, initial):
    """Also of the elite, beside the line of crossover, and where the retained were fused."""
    left, right = shifted_pair(3, rows, columns)
    volume = np.rint(255 * reference.possibility_volume(
        left, right, disparities, min_disparity, 54.0)).astype(np.int64)
    norms, numbers = (reference.sobel_norm(left), reference.sobel_norm(right)), []
    config = config_for(
        reading=reading, disparities=disparities, min_disparity=min_disparity, generations=4,
        population=8, neighbourhood=neighbourhood, initial_population=initial)
    matcher = PaperMatcher(config, rows, columns)

    def twin(chromosome):
        if reading == 'literal':
            return reference.fitness(
                volume, chromosome, *norms, min_disparity, neighbourhood) / 255
        planes, weights = (memory[:, 1:-1, 1:columns + 1] for memory in (
            matcher._fitness.planes, matcher._fitness.weights))
        chosen = np.take_along_axis(planes, chromosome[np.newaxis].astype(np.int64), axis=0)[0]
        return reference.cell_fitness(chromosome, chosen, weights).sum() / (255 * 32 * 8)

    def check(number, population):
        numbers.append(number)
        for chromosome, fitness in zip(population, matcher.population.fitness):
            assert chromosome.max() < disparities
            assert fitness == pytest.approx(twin(chromosome), rel=1e-12)

    matcher.match(left, right, None, Random((0, 0)), Budget(4, 0, 0), check)
    assert numbers == [1, 2, 3, 4]


@pytest.mark.parametrize('reading', READINGS)
def test_the_initial_population_is_random_or_the_most_possible_map_with_some_random_genes(reading):
    genes = evolved(reading=reading, generations=0)[0].population.genes
    assert not np.array_equal(genes[0], genes[1])
    counts, expected = np.bincount(genes.ravel()), genes.size / DISPARITIES
    assert counts.size == DISPARITIES and np.abs(counts - expected).max() < 5 * np.sqrt(expected)
    matcher, _ = evolved(reading=reading, generations=0, initial_population='winner_takes_all')
    first, *others = matcher.population.genes
    assert np.all(matcher.possibility_of(first) == np.max([matcher.possibility_of(
        np.full_like(first, index)) for index in range(DISPARITIES)], axis=0))
    assert all(0 < np.mean(other != first) < 0.2 for other in others)


@pytest.mark.parametrize('reading', READINGS)
def test_the_retained_survive_and_are_all_parents_and_uniform_mutation_loses_nothing(reading):
    matcher, _ = evolved(reading=reading, generations=0, mutation_rate=1.0)
    population = matcher.population
    fitness, former = population.fitness.copy(), population.genes.copy()
    for number, name in enumerate(('selection', 'crossover', 'mutation')):
        before = population.fitness.copy()
        matcher._operators[name](population, Random((3, number)))
    gained = population.fitness - before
    assert gained.any() and (reading == 'literal' or (gained >= 0).all())
    kept = np.setdiff1d(np.arange(fitness.size), population.lineage.children)
    fittest = operators.fittest_first(fitness)[:operators.elite_size(fitness.size)]
    assert set(fittest) == set(kept)
    assert np.isin(population.lineage.parents, fittest).all()
    np.testing.assert_array_equal(population.genes[kept], former[kept])


def test_line_crossover_takes_rows_above_a_line_from_one_parent_and_the_rest_from_the_other():
    matcher, _ = evolved(reading='literal', generations=0)
    population, tools = matcher.population, matcher._tools
    operators.select(tools, population, Random((1,)))
    former = population.genes.copy()
    operators.cross_at_lines(tools, population, Random((2,)))
    lines = []
    for child, (first, second) in zip(*population.lineage):
        genes = population.genes[child]
        line = next((row for row in range(ROWS)
                     if not np.array_equal(genes[row], former[first][row])), ROWS)
        np.testing.assert_array_equal(genes[line:], former[second][line:])
        lines.append(line)
    assert len(set(lines)) > 3


@pytest.mark.parametrize('reading', READINGS)
def test_the_result_is_the_best_in_pixels_and_by_how_much_its_matches_are_more_possible(reading):
    matcher, match = evolved(reading=reading, min_disparity=-2)
    best = matcher.population.genes[matcher.population.best]
    np.testing.assert_array_equal(
        match.disparity, np.where(match.confidence > 0, best.astype(float) - 2, np.nan))
    possible = matcher.possibility_of(best)
    others = np.max([np.where(abs(best.astype(int) - index) > 1, matcher.possibility_of(
        np.full_like(best, index)), 0) for index in range(DISPARITIES)], axis=0)
    certainty = np.maximum(possible - others, 0) / np.maximum(possible, 1 / 255)
    certainty[:, :3] = certainty[:, -2:] = 0    # at most three disparities from -2 to 3 are seen
    growth = max(after.best_fitness / before.best_fitness - 1
                 for before, after in pairwise(match.history[-3:]))
    np.testing.assert_allclose(match.confidence, np.exp(-8 * growth) * np.interp(
        10 * cv2.blur(certainty, (9, 9)), range(11), CALIBRATION)
        * matcher._inheritance.seen(best), atol=1e-6)
    assert list(match.times) == ['pictures', 'possibility', 'seeds', 'generations', 'refinement']
