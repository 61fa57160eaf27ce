# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The genetic engine: one loop over named operators, its random source, its budget, its history.

A profile is an initial population and an ordered dict of operators. The population has

    genes: (P, R, C), a view of the chromosomes alive
    fitness: float64 (P,), higher is fitter
    best: index of the fittest
    converged: whether more generations can change nothing

An operator, such as selection, crossover, mutation or survival, is called as
`operator(population, random)` and changes the population in place; an operator that is not called,
as the time is up, leaves a population that is valid. The ablation exchanges single operators.
"""
from dataclasses import dataclass
import time

from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import fill_uniform, key_of
import numpy as np


@dataclass(frozen=True)
class Random:
    """
    The source of all random numbers: equal words give equal numbers, whatever threads do.

    words: whole numbers, of any size and sign: seed, stamp, generation and so on
    """

    words: tuple

    def child(self, *words):
        """Return the source whose words are these and some more."""
        return Random((*self.words, *words))

    @property
    def key(self):
        """The key of kernels that hash counters: uint64."""
        return key_of(*self.words)

    def uniform(self, number):
        """Return random numbers from 0 up to but not including 1: float64 (number,)."""
        draws = np.zeros(number)
        fill_uniform(self.key, draws)
        return draws


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


@dataclass(frozen=True)
class Generation:
    """
    A row of the history; one that the deadline cut short is there as far as it came.

    number: from 1; best_fitness, mean_fitness: after the generation, higher is fitter
    diversity: mean share of cells in which a chromosome differs from the fittest, 0 to 1
    milliseconds: how long the generation took
    gains: by how much the best fitness rose, by name of operator
    """

    number: int
    best_fitness: float
    mean_fitness: float
    diversity: float
    milliseconds: float
    gains: dict


def evolve(population, operators, random, budget, observe=None):
    """
    Run generations until the population has converged or the budget is spent.

    Returns the history: a `Generation` for each that ran.

    population, operators: see above; random: a `Random`, of which each generation has a child
    budget: says whether a generation, and within it an operator, may start
    observe: called with the number and the genes (P, R, C) after each generation, a view that
    the next one overwrites
    """
    history, number = [], 1
    while budget.allows(number) and not population.converged:
        started = time.perf_counter_ns()
        gains = {}
        for name, operator in operators.items():
            if not budget.in_time():
                break
            before = population.fitness[population.best]
            operator(population, random.child(number))
            gains[name] = float(population.fitness[population.best] - before)
        milliseconds = (time.perf_counter_ns() - started) / 1e6
        history.append(Generation(
            number, float(population.fitness[population.best]), float(population.fitness.mean()),
            diversity(population.genes, population.best), milliseconds, gains))
        if observe is not None:
            observe(number, population.genes)
        number += 1
    return history


def diversity(genes, best, step=8):
    """
    Return the mean share of cells in which the other chromosomes differ from the best, 0 to 1.

    Only every `step`-th row and column is looked at: a share needs no more.

    genes: any numbers (P, R, C); best: index of the fittest
    """
    if len(genes) < 2:
        return 0.0
    sample = genes[:, ::step, ::step]
    different = np.mean(sample != sample[best])
    return float(different * len(genes) / (len(genes) - 1))
