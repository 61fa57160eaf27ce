# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop, its budget, its history; and the deadline in each profile, by a clock of its own."""
from dataclasses import replace
import sys

from fuzzy_stereo_ros.matching import (
    evolution, matcher as matcher_module, MatcherConfig, StereoMatcher)
from fuzzy_stereo_ros.matching.evolution import Budget, evolve, Generation, Random
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, settings, strategies as st
from made_scenes import bits
import numpy as np
import pytest


class Climbers:
    """A population whose best gains 1 by the operator `climb`, and that converges when told."""

    def __init__(self, converges_after=None):
        self.genes = np.zeros((3, 4, 5), np.uint16)
        self.fitness = np.array([1.0, 5.0, 3.0])
        self.best = 1
        self.randoms = []
        self.converges_after = converges_after

    @property
    def converged(self):
        return self.converges_after is not None and len(self.randoms) >= self.converges_after

    @property
    def numbers(self):
        return [random.seed[-1] for random in self.randoms]


def climb(population, random):
    population.randoms.append(random)
    population.fitness[population.best] += 1


def rest(population, random):
    pass


OPERATORS = {'step': climb, 'rest': rest}
SOURCE = Random((7, 8))


def test_generations_are_counted_from_one_to_the_budget_each_with_a_random_source_of_its_own():
    population = Climbers()
    history = evolve(population, OPERATORS, SOURCE, Budget(4, 0, 0))
    assert population.randoms == [Random((7, 8, number)) for number in (1, 2, 3, 4)]
    assert [row.number for row in history] == [1, 2, 3, 4]


def test_a_population_that_has_converged_stops_at_once():
    population = Climbers(converges_after=2)
    assert len(evolve(population, OPERATORS, SOURCE, Budget(10, 0, 0))) == 2
    assert evolve(population, OPERATORS, SOURCE, Budget(10, 0, 0)) == []


def test_a_row_of_history_says_what_the_generation_reached():
    row = evolve(Climbers(), OPERATORS, SOURCE, Budget(2, 0, 0))[-1]
    assert isinstance(row, Generation)
    assert row.best_fitness == 7
    assert row.mean_fitness == pytest.approx((1 + 7 + 3) / 3)
    assert row.gains == {'step': 1.0, 'rest': 0.0}
    assert row.milliseconds >= 0


@settings(deadline=None)
@given(st.lists(st.integers(-2**70, 2**70), max_size=4), st.integers(0, 40))
def test_equal_words_give_equal_numbers_from_0_to_below_1(words, number):
    draws = Random(tuple(words)).uniform(number)
    np.testing.assert_array_equal(draws, Random(tuple(words)).uniform(number))
    assert draws.shape == (number,)
    assert ((draws >= 0) & (draws < 1)).all()


COMMON = {'disparities': 24, 'threads': 1, 'generations': 2, 'reference': 'left'}
CONFIGS = {
    'realtime': MatcherConfig(**COMMON),
    'quality': MatcherConfig.from_profile('quality', **COMMON),
    'paper': MatcherConfig.from_profile('paper', **COMMON, population=8)}
SCENE = make_pair(40, 60, 24, seed=2, noise=2.0)


class Clock:
    """A clock that stands but for the operators, of which each takes 1 ms, and when told."""

    def __init__(self):
        self.now_ms, self.started = 0, []

    def perf_counter_ns(self):
        return int(1e6 * self.now_ms)

    def slow(self, operator):
        def slowed(population, random):
            self.started.append(self.now_ms)
            operator(population, random)
            self.now_ms += 1
        return slowed


@pytest.fixture(params=CONFIGS.values(), ids=CONFIGS)
def config(request):
    return request.param


@pytest.fixture
def clock(config, monkeypatch):
    """Return the clock of a profile; `clock.seeding_ms` is what each initial population takes."""
    clock, evolve = Clock(), evolution.evolve
    clock.seeding_ms = 0

    def evolve_slowly(population, operators, *others):
        clock.now_ms += clock.seeding_ms
        return evolve(population, {name: clock.slow(operator)
                                   for name, operator in operators.items()}, *others)

    for module in (evolution, matcher_module):
        monkeypatch.setattr(module, 'time', clock)
    kind = ALGORITHMS[config.algorithm]
    monkeypatch.setattr(sys.modules[kind.__module__], 'evolve', evolve_slowly)
    return clock


def matched(config, clock, **changes):
    """Return the match of the scene and its matcher; the clock starts anew."""
    clock.now_ms, clock.started = 0, []
    matcher = StereoMatcher(replace(config, **changes))
    return matcher.match(SCENE.left, SCENE.right), matcher


def operators_in_all(config, clock):
    """Return how many operators run without a deadline."""
    matched(config, clock)
    return len(clock.started)


def test_no_operator_starts_at_or_after_the_deadline_and_all_that_may_do(clock, config):
    in_all = operators_in_all(config, clock)
    assert in_all >= 1
    for deadline in range(1, in_all + 2):
        match, _ = matched(config, clock, deadline_ms=deadline - 0.5)
        assert clock.started == [*range(min(deadline, in_all))]
        assert sum(len(row.gains) for row in match.history) == len(clock.started)
        assert match.generations == len(match.history) <= config.generations


def test_a_generation_cut_short_leaves_a_population_whose_best_gained_what_is_told(clock, config):
    matcher = matched(config, clock, generations=0)[1]
    population = matcher.algorithm.population
    seed = population.fitness[population.best]
    for deadline in range(1, operators_in_all(config, clock) + 1):
        match, matcher = matched(config, clock, deadline_ms=deadline - 0.5)
        population, row = matcher.algorithm.population, match.history[-1]
        assert len(population.genes) == len(population.fitness) >= 1
        assert row.best_fitness == population.fitness[population.best] == population.fitness.max()
        assert row.mean_fitness == population.fitness.mean()
        gains = [gain for one in match.history for gain in one.gains.values()]
        # `trust` measures by what the views say of each other now: the same map may be less fit.
        assert min((gain for one in match.history for name, gain in one.gains.items()
                    if name != 'trust'), default=0) >= 0
        assert row.best_fitness == pytest.approx(seed + sum(gains), rel=1e-12)


def test_a_deadline_that_passes_before_the_first_generation_leaves_the_seeds(clock, config):
    seeds, _ = matched(config, clock, generations=0)
    clock.seeding_ms = 5
    match, _ = matched(config, clock, deadline_ms=5.0)
    assert clock.started == []
    assert bits(match) == bits(seeds)


def test_a_deadline_that_does_not_come_and_one_that_came_before_change_no_bit(clock, config):
    free, _ = matched(config, clock)
    assert bits(matched(config, clock, deadline_ms=1e3)[0]) == bits(free)
    _, matcher = matched(config, clock, deadline_ms=0.5)
    matcher.config = config         # which has no deadline
    matcher.reset()
    assert bits(matcher.match(SCENE.left, SCENE.right)) == bits(free)
