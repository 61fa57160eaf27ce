# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The profile `realtime`: chromosomes from scanlines and the previous frame, joined by crossover.

One frame: the half-size chromosome tells where to look; the scanline chromosome is the best that
the data give; its inconsistent cells take background genes in two ways, which makes the initial
population. Crossover gives the fittest the fitter regions of the other.
"""
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.crossover import Regions
from fuzzy_stereo_ros.matching.evolution import evolve, Random
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness
from fuzzy_stereo_ros.matching.realtime.half_size import HalfSize, TILE as HALF_TILE
from fuzzy_stereo_ros.matching.realtime.population import cross, Population
from fuzzy_stereo_ros.matching.realtime.possibility import View
from fuzzy_stereo_ros.matching.realtime.refinement import Refinement
from fuzzy_stereo_ros.matching.realtime.scanlines import Scanlines
from fuzzy_stereo_ros.matching.realtime.views import Views
from fuzzy_stereo_ros.matching.realtime.warm_start import WarmStart
from fuzzy_stereo_ros.matching.stopwatch import Stopwatch

TILE = HALF_TILE    # pixels of a side of the tiles that search labels of their own
ADVANTAGE = 1       # cost a cell by which a region must be fitter to be taken over


class Stages(NamedTuple):
    """
    The stages that can be exchanged for others, as the ablation does.

    describe: called with a `View` and a range of rows, writes what matches are judged by
    previous_best: called as `WarmStart.prior_of_previous`, returns the prior of the previous best
    crossover: called with rows and columns, returns a crossover, see matching/crossover.py
    """

    describe: Callable = View.describe
    previous_best: Callable = WarmStart.prior_of_previous
    crossover: Callable = partial(Regions, advantage=ADVANTAGE)


class RealtimeMatcher:
    """
    The stages of one image size.

    population: the `Population` of the last pair
    """

    def __init__(self, config, rows, columns, stages=None):
        """Allocate all that pairs of one size need."""
        self._config, self._stages = config, stages or Stages()
        self._crew = Crew(config.threads)
        self._views = Views(config, rows, columns, TILE)
        self._half_size = HalfSize(self._views.half, rows, columns, config.disparities)
        self._scanlines = Scanlines(self._views.full, TILE)
        self._warm_start = WarmStart(rows, columns, config.disparities)
        self._refinement = Refinement(
            rows, columns, config.disparities, self._scanlines.chosen.labels.dtype)
        self._fitness = CensusFitness(
            self._views.full, self._refinement.verdict, self._scanlines.chosen.target)
        self.population = Population(config.population, self._fitness, self._scanlines.bands)
        self._crossover = self._stages.crossover(rows, columns)
        self._operators = {'crossover': partial(cross, self._crew, self._crossover)}

    def match(self, left, right, previous, random, budget, observe=None):
        """
        Match a pair; return the `Match`, and the `FrameState` for the next one.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); previous: the previous frame's
        FrameState or None; random, budget, observe: as `evolve` takes them
        """
        config, crew, watch = self._config, self._crew, Stopwatch()
        self._views.read(crew, left, right, partial(self._average, previous),
                         self._stages.describe)
        watch.took('possibility')
        half = self._half_size.search(crew, self._views.inside)
        texture_prior = self._half_size.prior(half, self._views.full.left.grey)
        previous_prior = self._stages.previous_best(self._warm_start, crew, previous, half)
        watch.took('coarse')
        ranges = self._half_size.disparity_ranges(half, self._scanlines.windows, TILE)
        chosen = self._scanlines.search(crew, ranges, texture_prior, previous_prior)
        watch.took('scanlines')
        verdict = self._refinement.check(crew, chosen, self._views.inside, config)
        self._fitness.look(crew, self._views.inside)
        self.population.initialise(crew, chosen.labels, verdict)
        watch.took('seeds')
        history = evolve(self.population, self._operators, random, budget, observe)
        watch.took('generations')
        labels = self._refinement.smooth(
            crew, self.population.genes[self.population.best], self._views.full.left.grey)
        disparity, confidence = self._refinement.express(crew, labels, chosen, config)
        watch.took('refinement')
        state = None
        if config.warm_start:
            state = self._warm_start.hand_on(labels, verdict, config)
            watch.took('handing_on')
        return Match(disparity, confidence, history, watch.times, previous is not None), state

    def possibility_of(self, chromosome):
        """Return how possible the matches of a chromosome are: float32 (R, C), 0 to 1."""
        return self._fitness.possibility_of(self._crew, chromosome)

    def fitness_of(self, chromosome):
        """Return the fitness of a chromosome on the last pair, measured on every row."""
        return self._fitness.measure(self._crew, chromosome, every=1)

    def child_of(self, first, second):
        """Return the child of two chromosomes on the last pair."""
        child = first.copy()
        self._fitness.cross(self._crew, self._crossover, Random((0,)), child, second)
        return child

    def _average(self, previous, *views):
        """Average the views of a pair with those of the previous frame."""
        if self._config.warm_start:
            self._warm_start.average(self._crew, previous, *views)
