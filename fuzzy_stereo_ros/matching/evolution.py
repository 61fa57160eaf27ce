# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The genetic engine: one loop over named operators, its random source, its budget, its history.

A profile is an initial population and an ordered dict of operators. The population has

    genes: (P, R, C), a view of all chromosomes
    fitness: float64 (P,), higher is fitter
    best: index of the fittest
    converged: whether further generations would change nothing

An operator, such as selection, crossover or mutation, is called as `operator(population, random)`
and changes the population in place. The population is valid after each operator, since a deadline
may leave out those that follow.
"""
from copy import copy
from dataclasses import dataclass
import time

from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import fill_uniform, key_of
import numpy as np

DECAY = 0.9                 # of an expected duration, by a shorter one


@dataclass(frozen=True)
class Random:
    """The source of all random numbers: equal seeds, of whole numbers, give equal ones."""

    seed: tuple

    def child(self, *further):
        """Return the source whose seed is this one, followed by further numbers."""
        return Random((*self.seed, *further))

    @property
    def key(self):
        """The key of kernels that hash counters: uint64."""
        return key_of(*self.seed)

    def uniform(self, number):
        """Return random numbers from 0 up to but not including 1: float64 (number,)."""
        draws = np.zeros(number)
        fill_uniform(self.key, draws)
        return draws


class Budget:
    """The generations and the time that a frame may take."""

    def __init__(self, generations, deadline_ms, started_ns):
        """Start; generations: the most; deadline_ms: 0 is none; started_ns: of perf_counter."""
        self._generations = generations
        self._deadline_ns = started_ns + int(deadline_ms * 1e6) if deadline_ms > 0 else None

    def reserving(self, milliseconds):
        """Return this budget with a deadline that is earlier by what later stages take."""
        if self._deadline_ns is None:
            return self
        rest = copy(self)
        rest._deadline_ns -= int(milliseconds * 1e6)
        return rest

    def of_one_generation(self):
        """Return a budget within this one that allows one generation."""
        limited = copy(self)
        limited._generations = min(self._generations, 1)
        return limited

    def allows(self, generation):
        """Return whether the generation of this number, from 1, may start now."""
        return generation <= self._generations and self.in_time()

    def in_time(self, milliseconds=0.0):
        """Return whether an operator that takes some time would end before the deadline."""
        return self._deadline_ns is None or (
            time.perf_counter_ns() + int(milliseconds * 1e6) < self._deadline_ns)


class Durations:
    """
    How long operators take, so that none starts that would end after the deadline.

    One that is left out takes no time: after some frames it is tried again.
    """

    def __init__(self):
        self._expected = {}

    def __getitem__(self, name):
        """Return the milliseconds that an operator or stage is expected to take; 0 at first."""
        return self._expected.get(name, 0.0)

    def record(self, name, milliseconds):
        """Record how long it took: a longer time counts at once, a shorter one over frames."""
        self._expected[name] = max(milliseconds, DECAY * self[name])


@dataclass(frozen=True)
class Generation:
    """
    A row of the history, also of a generation that the deadline cut short.

    number: from 1; best_fitness, mean_fitness: after the generation, higher is fitter
    milliseconds: how long the generation took
    gains: by how much the best fitness rose, by name of operator
    """

    number: int
    best_fitness: float
    mean_fitness: float
    milliseconds: float
    gains: dict


def evolve(population, operators, random, budget, observe=None, durations=None):
    """
    Run generations until the population has converged, the budget is spent or an operator is late.

    Returns the history: a `Generation` for each that ran.

    population, operators: see above; random: a `Random`; each generation has a child of it
    budget: says whether a generation, and within it an operator, may start
    observe: called with the number and the genes (P, R, C) after each generation, a view that
    the next one overwrites
    durations: the `Durations` of earlier runs; with them no operator starts that would end late
    """
    history, number, late = [], 1, False
    # Without operators another generation would be the same.
    while (operators or not history) and budget.allows(number) and not (
            population.converged or late):
        started = time.perf_counter_ns()
        gains = {}
        for name, operator in operators.items():
            late = not budget.in_time(durations[name] if durations is not None else 0.0)
            if late:
                if durations is not None:
                    durations.record(name, 0.0)     # else it would be left out for ever
                break
            before, began = population.fitness[population.best], time.perf_counter_ns()
            operator(population, random.child(number))
            if durations is not None:
                durations.record(name, (time.perf_counter_ns() - began) / 1e6)
            gains[name] = float(population.fitness[population.best] - before)
        if late and not gains:
            break
        milliseconds = (time.perf_counter_ns() - started) / 1e6
        history.append(Generation(
            number, float(population.fitness[population.best]), float(population.fitness.mean()),
            milliseconds, gains))
        if observe is not None:
            observe(number, population.genes)
        number += 1
    return history


class Stopwatch:
    """Measures one stage after the other; times: milliseconds by stage, in their order."""

    def __init__(self):
        self.begin()

    def begin(self):
        """Begin the first stage."""
        self.times, self._since = {}, time.perf_counter_ns()

    def lap(self, stage):
        """Store the milliseconds since the previous lap as those of a stage."""
        now = time.perf_counter_ns()
        self.times[stage] = (now - self._since) / 1e6
        self._since = now
