# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of generations, its budget and its history: the same for every search."""
from dataclasses import dataclass
import time

import numpy as np


class Budget:
    """What a frame may spend: a number of generations, and time."""

    def __init__(self, generations, deadline_ms, started_ns):
        """
        Start a budget.

        generations: the most that may run; deadline_ms: 0 is no deadline
        started_ns: when the frame began, by `time.perf_counter_ns`
        """
        self._generations = generations
        self._deadline_ns = started_ns + int(deadline_ms * 1e6) if deadline_ms > 0 else None

    def allows(self, generation):
        """Return whether the generation of this number, from 1, may start now."""
        return generation <= self._generations and self.in_time()

    def in_time(self):
        """Return whether the deadline is still ahead, so that an operator may start."""
        return self._deadline_ns is None or time.perf_counter_ns() < self._deadline_ns


def always():
    """Return that an operator may start: what `in_time` is without a deadline."""
    return True


@dataclass(frozen=True)
class Generation:
    """
    A row of the history; one that the deadline cut short is there as far as it came.

    number: from 1; best_fitness, mean_fitness: after the generation, higher is fitter
    diversity: mean share of cells in which a chromosome differs from the fittest, 0 to 1
    milliseconds: how long the generation took; gains: fitness gained, by name of operator
    """

    number: int
    best_fitness: float
    mean_fitness: float
    diversity: float
    milliseconds: float
    gains: dict


def diversity(population, best, step=8):
    """
    Return the mean share of cells in which the other chromosomes differ from the best.

    Only every `step`-th row and column is looked at: a share needs no more.

    population: any whole numbers (P, R, C); best: index of the fittest; share: 0 to 1
    """
    if len(population) < 2:
        return 0.0
    sample = population[:, ::step, ::step]
    different = np.mean(sample != sample[best])
    return float(different * len(population) / (len(population) - 1))


def evolve(search, budget, observe=None):
    """
    Run generations until the search has settled or the budget is spent; return the history.

    search: has `population` (P, R, C), `fitness` float64 (P,), `best`, `settled`, and
    `generation(number, in_time)`, which makes the next generation, starts an operator only while
    in_time() is true, and returns its gains
    budget: says whether a generation may start; observe: called with number and population
    after each, a view that the next generation overwrites
    """
    history = []
    number = 1
    while budget.allows(number) and not search.settled:
        started = time.perf_counter_ns()
        gains = search.generation(number, budget.in_time)
        milliseconds = (time.perf_counter_ns() - started) / 1e6
        history.append(Generation(
            number, float(search.fitness[search.best]), float(search.fitness.mean()),
            diversity(search.population, search.best), milliseconds, gains))
        if observe is not None:
            observe(number, search.population)
        number += 1
    return history
