# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The genetic algorithm of the paper: H. Ghazouani, Genetic stereo matching with fuzzy fitness.

A chromosome is a disparity map; a generation is selection, crossover and mutation, and in the
uniform reading fusion. The fittest map is the result as it is, without any refinement.
"""
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.evolution import evolve, Stopwatch
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import scatter_random_genes
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.over_frames.inheritance import Inheritance
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.fitness import (
    inside, LiteralFitness, Population, SAME_MATCH, UniformFitness)
from fuzzy_stereo_ros.matching.paper.possibility import FULL, slopes_of
import numpy as np

SCATTERED = 0.1     # share of random genes in copies of the most possible map
AROUND = 9          # side of the square whose mean certainty is a pixel's confidence
# Share of right pixels by tenths of certainty, from every other Middlebury scene, with noise of 0
# and 1.5 grey levels; `python -m bench paper` prints how true it is on other scenes.
CALIBRATION = 0, 0.65, 0.77, 0.82, 0.87, 0.91, 0.95, 0.98, 0.994, 0.999, 1

UNSEEN_RESEEDED = 0.02  # share of unseen cells from which the most possible map is a chromosome
UNSETTLED = 8.0     # share of confidence lost per share of growth of the fitness


class PaperState(NamedTuple):
    """What the profile adds to a `FrameState`; genes: uint16 (P, R, C), the fittest first."""

    genes: np.ndarray

    @property
    def labels(self):
        """The fittest map: uint16 (R, C)."""
        return self.genes[0]

    @property
    def maps(self):
        """The maps that are moved to find where cells were: (1, R, C), of the left view."""
        return self.genes[:1]

    def after(self, gap_ns):
        """Return it for a frame that comes so much later."""
        return self

    def layout(self, shape, labels, known):
        """Return {name: (dtype, shape)} of the arrays; shape: of images; known: if a camera is."""
        return {'genes': (np.uint16, (len(self.genes), *shape))}

    def check(self, labels):
        """Raise ValueError for a number that kernels, which check no index, cannot use."""
        if not self.genes.size or (self.genes >= labels).any():
            raise ValueError('the state has genes out of range')


class Stages(NamedTuple):
    """
    The operators of a generation, in order, each called as in operators.py, None for none.

    slopes: no operator, but called with the inherited map and the side of N, returns how N rises,
    see slopes_of; None: it never does
    """

    selection: Callable = operators.select
    crossover: Callable = operators.cross_regions
    mutation: Callable = operators.mutate_by_uniform_patches
    fusion: Callable | None = operators.fuse_retained
    slopes: Callable | None = slopes_of

    @property
    def operators(self):
        """The operators by name, in order."""
        return {name: stage for name, stage in self._asdict().items()
                if name != 'slopes' and stage is not None}


LITERAL_STAGES = Stages(operators.select, operators.cross_at_lines,
                        operators.mutate_least_possible, None, slopes=None)


class PaperMatcher:
    """Matches by a population of maps of one image size; population: that of the last pair."""

    state_type = PaperState

    def __init__(self, config, rows, columns, stages=None):
        """Allocate all that pairs of one size need."""
        literal = config.reading == 'literal'
        self._config, self.pool = config, ThreadPool(config.threads)
        self._fitness = (LiteralFitness if literal else UniformFitness)(config, rows, columns)
        stages = stages or (LITERAL_STAGES if literal else Stages())
        self._inheritance = Inheritance(config, rows, columns)
        self._slopes_of = stages.slopes
        self.population = Population(config, rows, columns, self._fitness)
        self._most_possible = np.zeros(self.population.framed.shape[1:], np.uint16)
        self._tools = operators.OperatorTools(config, self.pool, self._fitness,
                                              self.population.framed.shape[1:])
        self._operators = {name: partial(operator, self._tools)
                           for name, operator in stages.operators.items()}

    def match(self, left, right, previous, random, budget, observe=None, camera=None):
        """Match a pair with what `evolve` takes; return its `Match` and `FrameState`."""
        watch, inheritance, inherited = Stopwatch(), self._inheritance, False
        inheritance.read(self.pool, left, right, previous)
        if self._config.warm_start:
            inherited = inheritance.average(self.pool, previous, camera)
        watch.lap('pictures')
        slopes = self._slopes(previous.own.labels) if inherited and self._slopes_of else None
        self._fitness.set_pair(self.pool, inheritance.luminances, inheritance.greys,
                               *inheritance.colours, slopes)
        watch.lap('possibility')
        self._initialise(random.child(0), previous.own.genes if inherited else None)
        watch.lap('seeds')
        history = evolve(self.population, self._operators, random, budget, observe)
        watch.lap('generations')
        disparity, confidence = self._result(_growth(history))
        watch.lap('refinement')
        state = None
        if self._config.warm_start:
            order = operators.fittest_first(self.population.totals)
            genes = self.population.genes[order]
            state = inheritance.next_state(genes[0], confidence, PaperState(genes), self._config)
            watch.lap('handing_on')
        return Match(disparity, confidence, history, watch.times, inherited,
                     inheritance.motion), state

    def possibility_of(self, chromosome):
        """Return the possibility of a chromosome's matches: float32 (R, C), 0 to 1."""
        return self._fitness.possibility_of(chromosome) / np.float32(FULL)

    def certainty_of(self, chromosome):
        """
        Return by what share a match is more possible than all others: float32 (R, C), 0 to 1.

        It is 0 in columns that have no other match whose neighbourhood both images see.
        """
        possible = self.possibility_of(chromosome)
        others = self._fitness.largest_elsewhere(self.pool, chromosome) / np.float32(FULL)
        columns, half = np.arange(chromosome.shape[1]), self._config.neighbourhood // 2
        targets = columns - self._config.min_disparity - np.arange(
            self._config.disparities)[:, None]
        seen = (targets >= half) & (targets < columns.size - half)
        comparable = seen.sum(axis=0) > 2 * SAME_MATCH + 1
        return np.maximum(possible - others, 0) * comparable / np.maximum(
            possible, np.float32(1 / FULL))

    def _slopes(self, before):
        """Return how N rises: float32 (2, R, C); before: (R, C), the fittest map inherited."""
        labels = np.empty(before.shape, np.float32)     # moved maps keep fractions of a label
        self._inheritance.inherit(before.astype(np.float32), np.full_like(labels, np.nan), labels)
        return self._slopes_of(labels, self._config.neighbourhood)

    def _initialise(self, random, before):
        """
        Write the initial population: inherited, random maps, or the most possible one.

        Where the previous frame did not show much of this one, the most possible map takes the
        place of the least fit chromosome: crossover takes its regions where they are fitter.

        before: uint16 (P, R, C), the population of the previous frame, the fittest first, where a
        smaller one counts again and again; None where nothing is inherited
        """
        population, config, inheritance = self.population, self._config, self._inheritance
        population.reset()
        inherited, at_random = before is not None, config.initial_population == 'random'
        unseen = inheritance.unseen if inherited else 0.0
        if unseen > 0 or not (inherited or at_random):
            self._fitness.most_possible(self._most_possible)
        most_possible = inside(self._most_possible)
        heirs = config.population - (unseen > UNSEEN_RESEEDED and config.population > 1)

        def initialise(slot, thread):
            genes, key = population.genes[slot], random.child(slot).key
            if inherited and slot < heirs:
                inheritance.inherit(before[slot % len(before)], most_possible, genes)
            elif at_random and not inherited:
                scatter_random_genes(key, config.disparities, 1.0, genes)
            else:
                genes[:] = most_possible
                if slot and not inherited:
                    scatter_random_genes(key, config.disparities, SCATTERED, genes)
            population.evaluate(slot, 0, genes.shape[0])

        self._tools.each(config.population, initialise)

    def _result(self, growth):
        """Return disparity and confidence of the fittest map: float32 (R, C); growth: a share."""
        best = self.population.genes[self.population.best]
        confidence = np.interp(10 * cv2.blur(self.certainty_of(best), (AROUND, AROUND)),
                               range(11), CALIBRATION)
        confidence = (confidence * np.exp(-UNSETTLED * growth)
                      * self._inheritance.seen(best)).astype(np.float32)
        disparity = best + np.float32(self._config.min_disparity)
        if not self._config.fill:
            disparity[self._config.rejects(confidence)] = np.nan
        return disparity, confidence


def _growth(history):
    """Return by what share the best fitness rose in one of the last two generations, at most."""
    # of two, as a deadline may have cut the last one short
    rises = [(sum(one.gains.values()), one.best_fitness) for one in history[-2:]]
    return max([0.0, *(gain / (best - gain) for gain, best in rises if best > gain)])
