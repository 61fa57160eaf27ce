# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The deadline inside a generation, by a clock that only operators move."""
from fuzzy_stereo_ros.benchmarks.measured_search import MeasuredSearch
from fuzzy_stereo_ros.made_scenes import made_pair
from fuzzy_stereo_ros.matching import (
    evolution, matcher as matcher_module, MatcherConfig, StereoMatcher)
from fuzzy_stereo_ros.matching.fitness import total_fitness
from fuzzy_stereo_ros.matching.paper_population import PaperPopulation
from fuzzy_stereo_ros.matching.paper_search import PaperSearch
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness
from fuzzy_stereo_ros.matching.realtime.scanlines import ScanlineGuess
import numpy as np
import pytest

GUIDED = MatcherConfig(disparities=24, threads=1, generations=3, population=4, sweeps=2)
PAPER = MatcherConfig.from_profile(
    'paper', disparities=24, threads=1, generations=3, population=8, reference='left')
LITTLE = 0.06      # regions that are fitter by less than an advantage are not taken over
CASES = [(GUIDED, MeasuredSearch), (PAPER, PaperSearch)]
OPERATORS = [(CensusFitness, 'join'), (CensusFitness, 'mutate'), (ScanlineGuess, 'polish'),
             (PaperPopulation, 'live_on'), (PaperPopulation, 'be_crossed'),
             (PaperPopulation, 'be_mutated')]
IN_ALL = {GUIDED: 1 + 2 * (3 * 2 + 2 * 2), PAPER: 3 * (3 + 5 * 2)}
SCENE = made_pair(40, 60, 24, seed=2, noise=2.0)


class Clock:
    """A clock that stands at 0 ms but for the operators: each takes 1 ms and is noted."""

    def __init__(self):
        self.started = []

    def perf_counter_ns(self):
        return int(1e6 * len(self.started))

    def slow(self, operator):
        def slowed(*arguments):
            self.started.append(len(self.started))
            return operator(*arguments)
        return slowed


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    for module in (evolution, matcher_module):
        monkeypatch.setattr(module, 'time', clock)
    for kind, name in OPERATORS:
        monkeypatch.setattr(kind, name, clock.slow(getattr(kind, name)))
    return clock


def matched(config, search_type, clock, **changes):
    """Return the match of the scene and its matcher; the clock starts anew."""
    clock.started.clear()
    matcher = StereoMatcher(MatcherConfig(**{**vars(config), **changes}), search_type)
    return matcher.match(SCENE.left, SCENE.right), matcher


def bits(match):
    return (match.disparity.tobytes(), match.confidence.tobytes(),
            [(row.best_fitness, row.mean_fitness, row.gains) for row in match.history])


def measured(search):
    """Return the fitness of each chromosome of a search, measured anew, from a common zero."""
    if isinstance(search, MeasuredSearch):
        return np.array([search.fitness_of(member) for member in search.population])
    found = []
    for genes in search.population:
        chosen, rows = np.zeros(genes.shape, np.uint8), np.zeros(len(genes), np.int64)
        search._measure.choose(genes, chosen)
        search._measure.evaluate(chosen, genes, search._scratches[0], 0, len(genes), rows)
        found.append(total_fitness(rows))
    return np.array(found)


@pytest.mark.parametrize('config, search_type', CASES)
def test_no_operator_starts_at_or_after_the_deadline_and_all_that_may_do(
        clock, config, search_type):
    for deadline in range(1, IN_ALL[config] + 2):
        match, _ = matched(config, search_type, clock, deadline_ms=deadline - 0.5)
        assert len(clock.started) == min(deadline, IN_ALL[config])
        assert all(started < deadline for started in clock.started)
        assert match.generations == len(match.history) <= config.generations


@pytest.mark.parametrize('config, search_type', CASES)
def test_a_generation_cut_short_leaves_a_population_that_is_what_its_fitness_says(
        clock, config, search_type):
    seed = seeds_fitness(config, search_type, clock)
    for deadline in range(1, IN_ALL[config] + 1):
        match, matcher = matched(config, search_type, clock, deadline_ms=deadline - 0.5)
        search, row = matcher.search, match.history[-1]
        assert len(search.population) == len(search.fitness) >= 1
        again = measured(search)
        assert search.fitness - search.fitness[search.best] == pytest.approx(
            again - again[search.best], abs=1e-9)
        assert row.best_fitness == search.fitness[search.best]
        assert row.best_fitness >= search.fitness.max() - LITTLE
        assert row.mean_fitness == search.fitness.mean()
        gains = [gain for one in match.history for gain in one.gains.values()]
        assert row.best_fitness == pytest.approx(seed + sum(gains), abs=1e-3)
        assert all(np.diff([seed, *(one.best_fitness for one in match.history)]) >= 0)


def seeds_fitness(config, search_type, clock):
    search = matched(config, search_type, clock, generations=0)[1].search
    return search.fitness[search.best]


@pytest.mark.parametrize('config, search_type', CASES)
def test_a_deadline_that_has_passed_leaves_the_seed(monkeypatch, clock, config, search_type):
    seed, _ = matched(config, search_type, clock, generations=0)
    start = search_type.start

    def late(self, *arguments):
        start(self, *arguments)
        clock.started += range(5)

    monkeypatch.setattr(search_type, 'start', late)
    match, matcher = matched(config, search_type, clock, deadline_ms=5.0)
    assert bits(match) == bits(seed)
    assert len(clock.started) == 5


@pytest.mark.parametrize('config, search_type', CASES)
def test_a_deadline_that_passes_as_a_generation_starts_leaves_what_there_was(
        config, search_type):
    matcher = StereoMatcher(config, search_type)
    matcher.match(SCENE.left, SCENE.right)
    search = matcher.search
    population, fitness = search.population.copy(), search.fitness.copy()
    for number in (1, 2):
        assert not any(search.generation(number, lambda: False).values())
        np.testing.assert_array_equal(search.population, population)
        np.testing.assert_array_equal(search.fitness, fitness)


@pytest.mark.parametrize('config, search_type', CASES)
def test_a_deadline_that_does_not_come_and_one_that_came_before_change_no_bit(
        clock, config, search_type):
    free, _ = matched(config, search_type, clock)
    assert len(clock.started) == IN_ALL[config]
    assert bits(matched(config, search_type, clock, deadline_ms=1e3)[0]) == bits(free)
    if config is PAPER:
        matcher = StereoMatcher(config, search_type)
        matcher.match(SCENE.left, SCENE.right)
        matcher.search.generation(4, iter([True, True, False]).__next__)
        assert len(matcher.search.population) < config.population
        assert bits(matcher.match(SCENE.left, SCENE.right)) == bits(free)


def test_threads_that_share_a_generation_stop_alike(clock):
    match, matcher = matched(PAPER, PaperSearch, clock, threads=3, deadline_ms=6.5)
    assert len(clock.started) <= 7 + 2          # those that ran as the deadline passed
    assert measured(matcher.search) == pytest.approx(matcher.search.fitness)
    seed, _ = matched(PAPER, PaperSearch, clock, generations=0)
    assert match.history[-1].best_fitness >= seeds_fitness(PAPER, PaperSearch, clock)
    assert match.disparity.shape == seed.disparity.shape
