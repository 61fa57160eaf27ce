# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop, its budget, its history."""
from fuzzy_stereo_ros.matching import evolution
from fuzzy_stereo_ros.matching.evolution import Budget, diversity, evolve, Generation, Random
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
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
        return [random.words[-1] for random in self.randoms]


def climb(population, random):
    population.randoms.append(random)
    population.fitness[population.best] += 1


def rest(population, random):
    pass


OPERATORS = {'step': climb, 'rest': rest}
SOURCE = Random((7, 8))


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
    population = Climbers()
    history = evolve(population, OPERATORS, SOURCE, Budget(4, 0, 0))
    assert population.numbers == [1, 2, 3, 4]
    assert [row.number for row in history] == [1, 2, 3, 4]


def test_each_generation_has_a_random_source_of_its_own():
    population = Climbers()
    evolve(population, OPERATORS, SOURCE, Budget(3, 0, 0))
    assert population.randoms == [Random((7, 8, number)) for number in (1, 2, 3)]


def test_no_generations_leave_the_population_alone():
    population = Climbers()
    assert evolve(population, OPERATORS, SOURCE, Budget(0, 0, 0)) == []
    assert population.numbers == []


def test_a_population_that_has_converged_stops_at_once():
    population = Climbers(converges_after=2)
    assert len(evolve(population, OPERATORS, SOURCE, Budget(10, 0, 0))) == 2
    assert evolve(population, OPERATORS, SOURCE, Budget(10, 0, 0)) == []


def test_no_generation_starts_at_or_after_the_deadline(clock):
    def slow(population, random):
        clock.now_ms += 40
        climb(population, random)

    population = Climbers()
    history = evolve(population, {'step': slow}, SOURCE, Budget(1000, 80, int(1000e6)))
    assert population.numbers == [1, 2]
    assert [row.milliseconds for row in history] == [40, 40]


def test_no_operator_starts_at_or_after_the_deadline(clock):
    def slow(population, random):
        clock.now_ms += 40
        climb(population, random)

    operators = dict.fromkeys('abc', slow)
    history = evolve(Climbers(), operators, SOURCE, Budget(1000, 160, int(1000e6)))
    assert [list(row.gains) for row in history] == [['a', 'b', 'c'], ['a']]


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
    row = evolve(Climbers(), OPERATORS, SOURCE, Budget(2, 0, 0))[-1]
    assert isinstance(row, Generation)
    assert row.best_fitness == 7
    assert row.mean_fitness == pytest.approx((1 + 7 + 3) / 3)
    assert row.gains == {'step': 1.0, 'rest': 0.0}
    assert row.diversity == 0
    assert row.milliseconds >= 0


def test_the_observer_sees_each_generation_with_its_genes():
    population, seen = Climbers(), []
    evolve(population, OPERATORS, SOURCE, Budget(3, 0, 0),
           lambda number, genes: seen.append((number, genes)))
    assert [number for number, _ in seen] == [1, 2, 3]
    assert all(genes is population.genes for _, genes in seen)


@settings(deadline=None)
@given(st.lists(st.integers(-2**70, 2**70), max_size=4), st.integers(0, 40))
def test_equal_words_give_equal_numbers_from_0_to_below_1(words, number):
    draws = Random(tuple(words)).uniform(number)
    np.testing.assert_array_equal(draws, Random(tuple(words)).uniform(number))
    assert draws.shape == (number,)
    assert ((draws >= 0) & (draws < 1)).all()


def test_a_child_of_a_random_source_draws_other_numbers():
    draws = {Random(words).uniform(1)[0] for words in ((), (0,), (1,), (0, 0), (0, 1), (1, 0))}
    assert len(draws) == 6
    assert Random((1,)).child(2, 3) == Random((1, 2, 3))


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
