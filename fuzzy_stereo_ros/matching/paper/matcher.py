# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The genetic algorithm of the paper: H. Ghazouani, Genetic stereo matching with fuzzy fitness.

A chromosome is a disparity map; a generation is selection, crossover and mutation, and in the
uniform reading migration. The fittest map is the result as it is, without any refinement.
"""
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.evolution import evolve, Stopwatch
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import (
    fill_random_genes, scatter_random_genes)
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.fitness import LiteralFitness, NEAR, UniformFitness
from fuzzy_stereo_ros.matching.paper.population import Population
from fuzzy_stereo_ros.matching.paper.possibility import FULL
import numpy as np

SCATTERED = 0.1     # share of random genes in copies of the most possible map
AROUND = 9          # side of the square whose mean certainty is a pixel's confidence
# Share of right pixels by tenths of certainty, from every other Middlebury scene, with noise of 0
# and 1.5 grey levels; `benchmark paper` prints how true it is on other scenes.
RIGHT = 0, 0.65, 0.77, 0.82, 0.87, 0.91, 0.95, 0.98, 0.994, 0.999, 1


class Stages(NamedTuple):
    """The operators of a generation, in order; each is called as in operators.py."""

    selection: Callable = operators.select
    crossover: Callable = operators.cross_regions
    mutation: Callable = operators.mutate_by_uniform_patches
    migration: Callable | None = operators.migrate


LITERAL_STAGES = Stages(operators.select, operators.cross_at_lines,
                        operators.mutate_least_possible, None)


class PaperMatcher:
    """
    A population of disparity maps of one image size.

    population: the `Population` of the last pair; state_type: frames hand on nothing
    """

    state_type = None

    def __init__(self, config, rows, columns, stages=None):
        """Allocate all that pairs of one size need."""
        literal = config.reading == 'literal'
        self._config, self.pool = config, ThreadPool(config.threads)
        self._fitness = (LiteralFitness if literal else UniformFitness)(config, rows, columns)
        self.population = Population(config, rows, columns, self._fitness)
        self._tools = operators.Tools(config, self.pool, self._fitness,
                                      self.population.framed.shape[1:])
        stages = stages or (LITERAL_STAGES if literal else Stages())
        self._operators = {name: partial(stage, self._tools)
                           for name, stage in stages._asdict().items() if stage is not None}

    def match(self, left, right, previous, random, budget, observe=None, camera=None):
        """
        Match a pair; return the `Match`, and None: no frame starts from the previous one.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR; previous, camera: not used;
        random, budget, observe: as `evolve` takes them
        """
        watch = Stopwatch()
        self._fitness.set_pair(self.pool, left, right)
        watch.lap('possibility')
        self._initialise(random.child(0))
        watch.lap('seeds')
        history = evolve(self.population, self._operators, random, budget, observe)
        watch.lap('generations')
        disparity, confidence = self._result()
        watch.lap('refinement')
        return Match(disparity, confidence, history, watch.times, False), None

    def possibility_of(self, chromosome):
        """Return the possibility of a chromosome's matches: float32 (R, C), 0 to 1."""
        chosen = np.zeros(chromosome.shape, np.uint8)
        self._fitness.fill_possibility(chromosome, chosen)
        return chosen / np.float32(FULL)

    def certainty_of(self, chromosome):
        """
        Return by what share a match is more possible than all others: float32 (R, C), 0 to 1.

        It is 0 in columns that have no other match whose neighbourhood both images see.
        """
        possible = self.possibility_of(chromosome)
        others = self._fitness.largest_elsewhere(chromosome) / np.float32(FULL)
        columns, half = np.arange(chromosome.shape[1]), self._config.neighbourhood // 2
        targets = columns - self._config.min_disparity - np.arange(
            self._config.disparities)[:, None]
        seen = (targets >= half) & (targets < columns.size - half)
        comparable = seen.sum(axis=0) > 2 * NEAR + 1
        return np.maximum(possible - others, 0) * comparable / np.maximum(
            possible, np.float32(1 / FULL))

    def _initialise(self, random):
        """Write the initial population: random maps, or the most possible one."""
        population, config = self.population, self._config
        population.reset()
        if config.initial_population == 'winner_takes_all':
            self._fitness.most_possible(population.framed[0])

        def initialise(slot, thread):
            genes = population.genes[slot]
            if config.initial_population == 'random':
                fill_random_genes(random.child(slot).key, config.disparities, genes)
            elif slot:
                genes[:] = population.genes[0]
                scatter_random_genes(random.child(slot).key, config.disparities, SCATTERED, genes)
            population.evaluate(slot, 0, genes.shape[0])

        self._tools.each(config.population, initialise)

    def _result(self):
        """Return the disparities of the fittest map and their confidence: float32 (R, C)."""
        best = self.population.genes[self.population.best]
        confidence = np.interp(10 * cv2.blur(self.certainty_of(best), (AROUND, AROUND)),
                               range(11), RIGHT).astype(np.float32)
        disparity = best + np.float32(self._config.min_disparity)
        if not self._config.fill:
            disparity[(confidence == 0)
                      | (confidence < self._config.confidence_threshold)] = np.nan
        return disparity, confidence
