# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The profile `quality`: genes are planes, and both views of a pair evolve.

One pair: scanlines give each view a dense seed; planes fitted around its pixels are the first
chromosome, those of the profile `realtime` the second if there is one. Mutants are planes of
segments and tiles; fusion by a minimum cut takes what is fitter, where the images do not speak
against it. The views judge each other: where they disagree, a match counts little.
"""
from collections.abc import Callable
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Cut
from fuzzy_stereo_ros.matching.evolution import evolve, Stopwatch
from fuzzy_stereo_ros.matching.kernels.planes.costs import UNIT
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.quality.fitness import PlaneFitness
from fuzzy_stereo_ros.matching.quality.operators import Evidence, OPERATORS
from fuzzy_stereo_ros.matching.quality.planes import local_planes, segments_of
from fuzzy_stereo_ros.matching.quality.population import Population, Tools, View
from fuzzy_stereo_ros.matching.quality.result import consistent, refine
from fuzzy_stereo_ros.matching.quality.seed import costs_of_pixels, realtime_maps, ScanlineSeed
import numpy as np

ROOT = 16        # colours are seen as so many times their root, as their noise grows with it


class Stages(NamedTuple):
    """
    The stages that can be exchanged for others, as the ablation does.

    crossover: called with rows, columns and 4 neighbours, returns a crossover of an `Exchange`
    operators: {name: operator}, in the order in which they are called
    evidence: called with rows and columns, rejects what the images speak against
    trusted: where matches count in full: see result.consistent
    flat: whether disparities have to be smooth, not planes
    """

    crossover: Callable = Cut
    operators: dict = OPERATORS
    evidence: Callable = Evidence
    trusted: Callable = consistent
    flat: bool = False


class QualityMatcher:
    """
    The stages of one image size.

    population: the `Population` of the last pair
    """

    def __init__(self, config, rows, columns, stages=None):
        """Take no memory: a pair does, and gives most of it back with the next one."""
        self._config, self._shape = config, (rows, columns)
        self._stages, self.pool = stages or Stages(), ThreadPool(config.threads)
        self.population = None

    def match(self, left, right, previous, random, budget, observe=None, camera=None):
        """
        Match a pair; return the `Match`, and None: no frame starts from the previous one.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); previous, camera: not used;
        random, budget, observe: as `evolve` takes them
        """
        watch = Stopwatch()
        self.population = None
        starts, volume = self._starts(left, right, random, budget)
        watch.lap('seeds')
        self.population = self._initial_population(starts, volume)
        seed = starts[0].seed
        del starts, volume       # what the refinement does not need
        watch.lap('views')
        history = evolve(self.population, self._stages.operators, random, budget, observe)
        self.population.tools.give_back()
        watch.lap('generations')
        disparity, confidence = refine(self.pool, self._config, self.population, seed,
                                       random.child(0))
        watch.lap('refinement')
        return Match(disparity, confidence, history, watch.times, False), None

    def possibility_of(self, chromosome):
        """Return how possible the matches of a map of labels are: float32 (R, C), 0 to 1."""
        view = self.population.views[0]
        costs = view.fitness.match_costs(self.pool, self._planes_of(chromosome))
        return 1 - costs.astype(np.float32) / UNIT

    def fitness_of(self, chromosome):
        """Return the fitness of a map of labels, or of px from 0, on the last pair."""
        view = self.population.views[0]
        planes = local_planes(self.pool, np.float32(chromosome), view.colour)
        return 1 - view.total(view.measured(planes)) / view.fitness.largest

    def fittest(self):
        """Return the fittest left map, before refinement: float32 (R, C), px from 0."""
        left = self.population.views[0]
        return left.disparities(left.members[self.population.best])

    def evolved_from(self, disparity, random, budget):
        """
        Return where evolution ends on the last pair if the left map starts from another one.

        disparity: float32 (R, C), px from 0, and so is what is returned; the right map starts
        from where it is
        """
        left, right = self.population.views
        start = local_planes(self.pool, np.float32(disparity), left.colour)
        self.population.initialise([[start], [right.members[0].planes.copy()]])
        evolve(self.population, self._stages.operators, random, budget)
        self.population.tools.give_back()
        return self.fittest()

    def _starts(self, left, right, random, budget):
        """Return the `Start`s of both views, and the costs of all matches of the left pixels."""
        pairs = (left, right), (_mirrored(right), _mirrored(left))
        maps = realtime_maps(self._config, pairs, random)
        scanlines = ScanlineSeed(self._config, *self._shape)
        starts = [scanlines.find(*pair, found, budget.in_time) for pair, found in zip(pairs, maps)]
        del scanlines       # its memory
        return starts, costs_of_pixels(self._config, self.pool, left, right)

    def _initial_population(self, starts, volume):
        """Return the population of a pair: planes around the pixels of both seeds."""
        stages, lowest, columns = self._stages, self._config.min_disparity, self._shape[1]
        tools, views, maps = Tools(self._shape, stages.crossover, stages.evidence), [], []
        for start, origin in zip(starts, (None, columns - 1 + lowest)):
            colour = start.colour
            seen = ROOT * np.sqrt(colour.astype(np.float32))
            fitness = PlaneFitness(*self._shape, self._config.disparities, stages.flat)
            fitness.look(self.pool, volume, origin, colour, seen, start.weak)
            views.append(View(self.pool, fitness, colour, segments_of(seen), tools))
            maps.append([local_planes(self.pool, (start.seed.surface, start.realtime)[place % 2],
                                      colour) for place in range(self._config.population)])
        population = Population(views, tools, lowest, stages.trusted)
        population.judge([start.seed.surface for start in starts])
        population.initialise(maps)
        return population

    def _planes_of(self, chromosome):
        """Return whole labels as planes."""
        planes = np.zeros((*self._shape, 3), np.float32)
        planes[..., 2] = chromosome
        return planes


def _mirrored(image):
    return np.ascontiguousarray(image[:, ::-1])
