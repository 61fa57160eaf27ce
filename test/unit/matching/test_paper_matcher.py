# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile `paper` as a whole, in its readings."""
import cv2
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Budget, Random
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.matcher import (
    CALIBRATION, LITERAL_STAGES, PaperMatcher, Stages)
from made_scenes import shifted_pair
import numpy as np
import pytest
import reference

ROWS, COLUMNS, DISPARITIES = 21, 33, 6
READINGS = ['literal', 'uniform']
INITIAL = ['random', 'winner_takes_all']


def pair(seed=0, shape=(ROWS, COLUMNS)):
    """Return a textured wall, seen with one disparity."""
    return shifted_pair(3, *shape, seed)


def config_for(**changes):
    settings = {'disparities': DISPARITIES, 'population': 20, 'generations': 8, 'threads': 1,
                'neighbourhood': 5, 'warm_start': False}
    return MatcherConfig.from_profile('paper', **{**settings, **changes})


def evolved(images=None, words=(0, 0), observe=None, stages=None, **changes):
    """Return the matcher and what it returned."""
    left, right = images or pair()
    config = config_for(**changes)
    matcher = PaperMatcher(config, *left.shape[:2], stages)
    match, state = matcher.match(left, right, None, Random(words),
                                 Budget(config.generations, 0, 0), observe)
    assert state is None
    return matcher, match


@pytest.mark.parametrize('shape, disparities, min_disparity', [
    ((9, 14), 5, 0), ((1, 12), 4, -2), ((12, 1), 3, 0), ((8, 6), 20, -3), ((5, 7), 3, 30)])
@pytest.mark.parametrize('neighbourhood', [1, 3, 31])
def test_every_fitness_of_every_literal_generation_is_eq_3(
        shape, disparities, min_disparity, neighbourhood):
    """Also for the elite, which is not evaluated again, and beside the crossover line."""
    left, right = pair(shape=shape)
    volume = np.rint(255 * reference.possibility_volume(
        left, right, disparities, min_disparity, 54.0)).astype(np.int64)
    norms = reference.sobel_norm(left), reference.sobel_norm(right)
    seen = []

    def check(number, population):
        for chromosome, fitness in zip(population, matcher.population.fitness):
            assert chromosome.max() < disparities
            assert fitness * 255 == pytest.approx(reference.fitness(
                volume, chromosome, *norms, min_disparity, neighbourhood), abs=1e-6)
        seen.append(number)

    config = config_for(reading='literal', disparities=disparities, min_disparity=min_disparity,
                        population=6, neighbourhood=neighbourhood)
    matcher = PaperMatcher(config, *shape)
    matcher.match(left, right, None, Random((0, 0)), Budget(3, 0, 0), check)
    assert seen == [1, 2, 3]


@pytest.mark.parametrize('initial', INITIAL)
@pytest.mark.parametrize('shape, disparities, min_disparity', [
    ((9, 14), 5, 0), ((1, 12), 4, -2), ((12, 1), 3, 0), ((8, 40), 20, -3), ((5, 7), 3, 30)])
def test_every_fitness_of_every_uniform_generation_is_that_of_the_twin(
        shape, disparities, min_disparity, initial):
    """Also where regions were taken over and the retained were fused."""
    numbers = []

    def check(number, population):
        measure = matcher._fitness
        planes, weights = (memory[:, 1:-1, 1:shape[1] + 1]
                           for memory in (measure.planes, measure.weights))
        for chromosome, fitness in zip(population, matcher.population.fitness):
            assert chromosome.max() < disparities
            expected = reference.cell_fitness(
                chromosome, reference.chosen_of(planes, chromosome), weights)
            assert fitness == expected.sum() / (255 * 32 * 8)
        numbers.append(number)

    config = config_for(disparities=disparities, min_disparity=min_disparity, generations=6,
                        initial_population=initial)
    matcher = PaperMatcher(config, *shape)
    matcher.match(*pair(shape=shape), None, Random((0, 0)), Budget(6, 0, 0), check)
    assert len(numbers) == 6


@pytest.mark.parametrize('reading', READINGS)
def test_the_initial_population_is_random_and_diverse(reading):
    genes = evolved(reading=reading, generations=0)[0].population.genes
    assert not np.array_equal(genes[0], genes[1])
    counts = np.bincount(genes.ravel(), minlength=DISPARITIES)
    expected = genes.size / DISPARITIES
    assert counts.size == DISPARITIES
    assert np.abs(counts - expected).max() < 5 * np.sqrt(expected)


@pytest.mark.parametrize('reading', READINGS)
def test_the_first_map_is_the_most_possible_and_the_others_have_some_random_genes(reading):
    matcher, _ = evolved(reading=reading, generations=0, initial_population='winner_takes_all')
    genes = matcher.population.genes
    most = matcher.possibility_of(genes[0])
    for index in range(DISPARITIES):
        assert np.all(matcher.possibility_of(np.full((ROWS, COLUMNS), index, np.uint16)) <= most)
    for other in genes[1:]:
        assert 0 < np.mean(other != genes[0]) < 0.2


@pytest.mark.parametrize('reading', READINGS)
def test_the_retained_survive_and_are_all_parents(reading):
    config = config_for(reading=reading, mutation_rate=1.0)
    matcher, _ = evolved(reading=reading, generations=0)
    population, tools = matcher.population, matcher._tools
    fitness, former = population.fitness.copy(), population.genes.copy()
    stages = LITERAL_STAGES if reading == 'literal' else Stages()
    for number, name in enumerate(('selection', 'crossover', 'mutation')):
        getattr(stages, name)(tools, population, Random((3, number)))
    kept = np.setdiff1d(np.arange(config.population), population.lineage.children)
    fittest = operators.fittest_first(fitness)[:operators.elite_size(len(fitness))]
    assert set(fittest) == set(kept)
    assert np.isin(population.lineage.parents, fittest).all()
    np.testing.assert_array_equal(population.genes[kept], former[kept])
    assert population.best in kept or population.fitness.max() >= fitness.max()


@pytest.mark.parametrize('reading', READINGS)
def test_line_crossover_takes_rows_above_a_line_from_one_parent_and_the_rest_from_the_other(
        reading):
    matcher, _ = evolved(reading=reading, generations=0)
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
        before = population.totals[child]
        population.evaluate(child, 0, ROWS)
        assert population.totals[child] == before
    assert len(set(lines)) > 3


def alike(matcher):
    """Let the chromosomes of a population differ in small wrong patches, of one winner."""
    population = matcher.population
    generator = np.random.default_rng(1)
    for slot in range(len(population.genes)):
        population.copy(slot, 0)
        row, column = generator.integers(0, (ROWS - 3, COLUMNS - 3))
        population.genes[slot, row:row + 3, column:column + 3] = (0, 1, 2, 4, 5)[slot % 5]
        population.evaluate(slot, 0, ROWS)


def test_a_child_of_regions_is_at_least_as_fit_as_both_parents_who_are_alike():
    matcher, _ = evolved(generations=0, initial_population='winner_takes_all')
    alike(matcher)
    population, tools = matcher.population, matcher._tools
    operators.select(tools, population, Random((1,)))
    former, fitness = population.genes.copy(), population.fitness.copy()
    operators.cross_regions(tools, population, Random((2,)))
    children, parents = population.lineage
    assert np.all(population.fitness[children] >= fitness[parents].max(axis=1))
    assert np.any(population.fitness[children] > fitness[parents].max(axis=1))
    for child, (first, second) in zip(children, parents):
        genes = population.genes[child]
        assert np.all((genes == former[first]) | (genes == former[second]))


@pytest.mark.parametrize('reading', READINGS)
def test_gains_add_up_to_the_rise_of_the_best_which_never_declines(reading):
    matcher, _ = evolved(reading=reading, generations=0)
    best = matcher.population.fitness.max()
    start = best
    for row in evolved(reading=reading, generations=30)[1].history:
        assert sum(row.gains.values()) == pytest.approx(row.best_fitness - best, abs=1e-6)
        assert row.best_fitness >= best
        best = row.best_fitness
    assert best > 1.2 * start


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
    *_, before, last = match.history
    growth = last.best_fitness / before.best_fitness - 1
    np.testing.assert_allclose(match.confidence, np.exp(-8 * growth) * np.interp(
        10 * cv2.blur(certainty, (9, 9)), range(11), CALIBRATION)
        * matcher._inheritance.seen(best), atol=1e-6)
    assert list(match.times) == ['pictures', 'possibility', 'seeds', 'generations', 'refinement']
