# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop, its budget, its history."""
from fuzzy_stereo_ros.matching import evolution
from fuzzy_stereo_ros.matching.evolution import Budget, diversity, evolve, Generation
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest


class Climber:
    """A search whose best gains 1 a generation, and that settles when told."""

    def __init__(self, settles_after=None):
        self.population = np.zeros((3, 4, 5), np.uint16)
        self.fitness = np.array([1.0, 5.0, 3.0])
        self.best = 1
        self.numbers = []
        self.settles_after = settles_after

    @property
    def settled(self):
        return self.settles_after is not None and len(self.numbers) >= self.settles_after

    def generation(self, number, in_time):
        self.numbers.append(number)
        self.fitness[self.best] += 1
        return {'step': 1.0}


@pytest.fixture
def clock(monkeypatch):
    """Return a clock in milliseconds that moves only when told."""
    class Clock:
        now_ms = 1000.0

        def perf_counter_ns(self):
            return int(self.now_ms * 1e6)

    clock = Clock()
    monkeypatch.setattr(evolution, 'time', clock)
    return clock


def test_generations_are_counted_from_one_to_the_budget():
    search = Climber()
    history = evolve(search, Budget(4, 0, 0))
    assert search.numbers == [1, 2, 3, 4]
    assert [row.number for row in history] == [1, 2, 3, 4]


def test_no_generations_leave_the_search_alone():
    search = Climber()
    assert evolve(search, Budget(0, 0, 0)) == []
    assert search.numbers == []


def test_a_settled_search_stops_at_once():
    search = Climber(settles_after=2)
    assert len(evolve(search, Budget(10, 0, 0))) == 2
    assert evolve(search, Budget(10, 0, 0)) == []


def test_nothing_starts_at_or_after_the_deadline(clock):
    search = Climber()
    step = search.generation

    def slow(number, in_time):
        clock.now_ms += 40
        return step(number, in_time)

    search.generation = slow
    history = evolve(search, Budget(1000, 80, int(1000e6)))
    assert search.numbers == [1, 2]
    assert [row.milliseconds for row in history] == [40, 40]


def test_a_deadline_of_0_is_none(clock):
    budget = Budget(3, 0, int(1000e6))
    clock.now_ms += 1e9
    assert budget.allows(3)
    assert budget.in_time()
    assert not budget.allows(4)


def test_time_spent_before_the_loop_counts(clock):
    budget = Budget(3, 5, int(1000e6))
    assert budget.allows(1)
    clock.now_ms += 5
    assert not budget.allows(1)
    assert not budget.in_time()
    assert not Budget(3, 5, int(1000e6)).allows(1)


def test_a_row_of_history_says_what_the_generation_reached():
    row = evolve(Climber(), Budget(2, 0, 0))[-1]
    assert isinstance(row, Generation)
    assert row.best_fitness == 7
    assert row.mean_fitness == pytest.approx((1 + 7 + 3) / 3)
    assert row.gains == {'step': 1.0}
    assert row.diversity == 0
    assert row.milliseconds >= 0


def test_the_observer_sees_each_generation_with_its_population():
    search, seen = Climber(), []
    evolve(search, Budget(3, 0, 0), lambda number, population: seen.append((number, population)))
    assert [number for number, _ in seen] == [1, 2, 3]
    assert all(population is search.population for _, population in seen)


@given(arrays.arrays(np.uint16, st.tuples(st.integers(1, 5), st.integers(1, 6),
                                          st.integers(1, 6)), elements=st.integers(0, 2)),
       st.data())
def test_diversity_is_the_mean_share_of_cells_unlike_the_best(population, data):
    best = data.draw(st.integers(0, len(population) - 1))
    others = [np.mean(member != population[best])
              for index, member in enumerate(population) if index != best]
    expected = np.mean(others) if others else 0
    assert diversity(population, best, step=1) == pytest.approx(expected)


def test_diversity_looks_at_a_sample_of_the_cells():
    population = np.zeros((2, 17, 9), np.uint16)
    population[1, ::8, ::8] = 1
    assert diversity(population, 0) == 1
    population[1] = 1 - population[1]
    assert diversity(population, 0) == 0
