# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop, its budget, its history; and the deadline in each profile, by a clock of its own."""
from dataclasses import replace
import sys
from unittest.mock import patch

from fuzzy_stereo_ros.matching import (
    evolution, matcher as matcher_module, MatcherConfig, StereoMatcher)
from fuzzy_stereo_ros.matching.evolution import Budget, Durations, evolve, Generation, Random
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, strategies as st
from made_scenes import bits
import numpy as np
import pytest


class Climbers:
    """A population whose best gains 1 by the operator `climb`, and that converges when told."""

    def __init__(self, converges_after):
        self.genes, self.fitness, self.best = np.zeros((3, 4, 5)), np.array([1.0, 5.0, 3.0]), 1
        self.randoms, self.converges_after = [], converges_after

    @property
    def converged(self):
        return len(self.randoms) >= self.converges_after


def climb(population, random):
    population.randoms.append(random)
    population.fitness[population.best] += 1


@given(st.integers(0, 9), st.integers(0, 9))
def test_generations_are_counted_and_told_up_to_the_budget_or_until_all_are_alike(most, alike):
    population, operators = Climbers(alike), {'step': climb, 'rest': lambda *_: None}
    history = evolve(population, operators, Random((7, 8)), Budget(most, 0, 0))
    numbers = [*range(1, min(most, alike) + 1)]
    assert population.randoms == [Random((7, 8, number)) for number in numbers]
    assert [row.number for row in history] == numbers
    for row in history:
        assert isinstance(row, Generation) and row.milliseconds >= 0
        assert row.best_fitness == 5 + row.number
        assert row.mean_fitness == pytest.approx((1 + 5 + row.number + 3) / 3)
        assert row.gains == {'step': 1.0, 'rest': 0.0}


@given(st.integers(1, 60), st.integers(61, 900), st.integers(1, 9))
def test_an_operator_left_out_ends_a_run_and_is_tried_again_after_some_frames(usual, slow, most):
    """A frame takes up to 60 ms, and one of all frames far more."""
    clock, durations, starts = Clock(), Durations(), []

    def operator(population, _):
        starts.append(clock.now_ms)
        clock.now_ms += slow if len(starts) == 1 else usual

    with patch.object(evolution, 'time', clock):
        for frame in range(40):
            begun, before = clock.now_ms, len(starts)
            history = evolve(Climbers(1), {'step': operator}, Random((1,)),
                             Budget(most, 61, clock.perf_counter_ns()), durations=durations)
            run = len(starts) - before
            assert len(history) <= run + 1 and (frame == 0 or clock.now_ms - begun <= 61)
    assert run >= 1


COMMON = {'disparities': 24, 'threads': 1, 'generations': 2, 'reference': 'left'}
CONFIGS = {
    'realtime': MatcherConfig(**COMMON),
    'quality': MatcherConfig.from_profile('quality', **COMMON),
    **{reading: MatcherConfig.from_profile('paper', **COMMON, population=8, reading=reading)
       for reading in ('uniform', 'literal')}}
SCENE = make_pair(40, 60, 24, seed=2, noise=2.0)


class Clock:
    """A clock that stands but for the operators, of which each takes 1 ms, and when told."""

    def __init__(self):
        self.now_ms, self.started, self.seeding_ms = 0, [], 0

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

    def evolve_slowly(population, operators, *others):
        clock.now_ms += clock.seeding_ms
        return evolve(population, {name: clock.slow(operator)
                                   for name, operator in operators.items()}, *others)

    for module in (evolution, matcher_module):
        monkeypatch.setattr(module, 'time', clock)
    module = sys.modules[ALGORITHMS[config.algorithm].__module__]
    monkeypatch.setattr(module, 'evolve', evolve_slowly)
    return clock


def matched(config, clock, **changes):
    """Return the match of the scene and its matcher; the clock starts anew."""
    clock.now_ms, clock.started = 0, []
    matcher = StereoMatcher(replace(config, **changes))
    return matcher.match(SCENE.left, SCENE.right), matcher


def test_no_operator_starts_at_or_after_the_deadline_and_the_best_gained_what_is_told(
        clock, config):
    matcher = matched(config, clock, generations=0)[1]
    population = matcher.algorithm.population
    seed = population.fitness[population.best]
    matched(config, clock)
    in_all = len(clock.started)
    assert in_all >= 1
    for deadline in range(1, in_all + 2):
        match, matcher = matched(config, clock, deadline_ms=deadline - 0.5)
        assert clock.started == [*range(min(deadline, in_all))]
        assert match.generations == len(match.history) <= config.generations
        population, row = matcher.algorithm.population, match.history[-1]
        assert len(population.genes) == len(population.fitness) >= 1
        assert row.best_fitness == population.fitness[population.best] == population.fitness.max()
        assert row.mean_fitness == population.fitness.mean()
        assert all(one.gains for one in match.history)
        gains = [gain for one in match.history for gain in one.gains.items()]
        assert len(gains) == len(clock.started) == sum(one.milliseconds for one in match.history)
        # `trust` measures by what the views say of each other now: the same map may be less fit.
        assert all(gain >= 0 for name, gain in gains if name != 'trust')
        assert row.best_fitness == pytest.approx(
            seed + sum(gain for _, gain in gains), rel=1e-12)


def test_without_operators_one_generation_is_enough_however_many_are_allowed():
    match = StereoMatcher('fast', disparities=24, generations=1_000_000).match(
        SCENE.left, SCENE.right)
    assert match.generations == 1 and match.gains == {}


def test_a_deadline_before_the_first_generation_leaves_the_seeds_and_another_changes_no_bit(
        clock, config):
    free, _ = matched(config, clock)
    assert bits(matched(config, clock, deadline_ms=1e3)[0]) == bits(free)
    _, matcher = matched(config, clock, deadline_ms=0.5)
    matcher.config = config         # which has no deadline
    matcher.reset()
    assert bits(matcher.match(SCENE.left, SCENE.right)) == bits(free)
    seeds, _ = matched(config, clock, generations=0)
    clock.seeding_ms = 5
    match, _ = matched(config, clock, deadline_ms=5.0)
    assert clock.started == [] and bits(match) == bits(seeds)
