# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The deadline in each profile, by a clock that only operators move."""
from dataclasses import replace
import sys

from fuzzy_stereo_ros.matching import (
    evolution, matcher as matcher_module, MatcherConfig, StereoMatcher)
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.synthetic.scenes import made_pair
import numpy as np
import pytest

COMMON = {'disparities': 24, 'threads': 1, 'generations': 3, 'reference': 'left'}
CONFIGS = {
    'realtime': MatcherConfig(**COMMON),
    'quality': MatcherConfig.from_profile('quality', **COMMON),
    'paper': MatcherConfig.from_profile('paper', **COMMON, population=8)}
SCENE = made_pair(40, 60, 24, seed=2, noise=2.0)


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


def bits(match):
    return (match.disparity.tobytes(), match.confidence.tobytes(),
            [(row.best_fitness, row.mean_fitness, row.gains) for row in match.history])


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


@pytest.mark.parametrize('config', [replace(CONFIGS['realtime'], population=2)])
def test_the_fitness_that_is_told_is_that_of_each_chromosome(clock, config):
    """From a common zero: a sample of the rows is measured, and all that crossover gains."""
    algorithm = matched(config, clock)[1].algorithm
    fitness = algorithm.population.fitness
    again = [algorithm.fitness_of(member) for member in algorithm.population.genes]
    assert fitness[1] < fitness[0]
    assert fitness - fitness[0] == pytest.approx(np.subtract(again, again[0]), abs=1e-9)


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


def test_threads_that_share_the_work_stop_alike(clock, config):
    in_all = operators_in_all(config, clock)
    for deadline in range(1, in_all + 1):
        one, three = (matched(config, clock, threads=threads, deadline_ms=deadline - 0.5)[0]
                      for threads in (1, 3))
        assert bits(one) == bits(three)
