# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The search of the profile `quality`: members of several models under one fitness.

The first member is what the profile `realtime` finds: the parent. Each generation makes a child,
scanline optima that lean on the parent everywhere, only where texture is weak, or not at all, or
that know no parent. Partition crossover gives the fittest the child's fitter regions. After a
round of all children the fittest is the parent of the next.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import always
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import CONSISTENT, REFUSED
from fuzzy_stereo_ros.matching.quality.fitness import Steps, SurfaceFitness
from fuzzy_stereo_ros.matching.quality.possibility import (
    colour_and_fine_grey, eight_bit_scale, Model, SupportPossibility)
from fuzzy_stereo_ros.matching.quality.scanlines import Smoothness, SurfaceGuess
from fuzzy_stereo_ros.matching.quality.surface import DenseSurface
from fuzzy_stereo_ros.matching.realtime.matcher import GuidedSearch
from fuzzy_stereo_ros.matching.realtime.refinement import AROUND
from fuzzy_stereo_ros.matching.stopwatch import Stopwatch
import numpy as np

SHARP = Model(census=12, colour=43, slope=2, gradient=30, blurs=(0.4,), longest=8, near=4,
              rounds=2)
WIDE = Model(census=14, colour=43, slope=2, gradient=12, blurs=(0.5, 0.9), longest=9, near=3,
             rounds=3)
LEVEL = 0.4              # px of a parent's surface that supports may span
PARENT_RADIUS, PARENT_LIMIT = 6, 1.5     # of the local planes that make a parent's surface, px
OUTPUT_RADIUS, OUTPUT_LIMIT = 4, 0.6     # and of those of the result
DEAD_ZONE, CUT = 1.0, 4.0    # px: a child's leaning on its parent begins, and ends, that far
WEAK_TEXTURE = 6.0       # mean grey step at which texture is not weak any more
STEPS = Steps(slope=0.16, free=0.25, jump=4.0, apart=0.5)
CLEAR_MARGIN = 0.4       # summed cost, parts of FULL, by which the best label elsewhere is worse


class Child(NamedTuple):
    """How a child is made of its parent."""

    strong: float            # what leaning on the parent costs a px where texture is strong
    weak: float              # and where it is weak
    smoothness: Smoothness
    steepest: int            # px a pixel that paths follow the parent's surface; 0, they do not
    cold: Model | None = None    # made without a parent, under a model of its own


FIRM = Smoothness(jump=4.0, small=0.1, at_edge=0.1, edge=20.0)
LOOSE = FIRM._replace(jump=3.0)
CHILDREN = {
    'leaning': Child(20, 60, LOOSE, 0),
    'leaning_where_weak': Child(0, 60, LOOSE, 2),
    'independent': Child(0, 0, LOOSE._replace(small=0.05), 0),
    'cold': Child(0, 0, FIRM, 0, cold=WIDE),
}
PLAN = tuple(CHILDREN)


class ThoroughSearch:
    """
    The population of one image size, evolved on one pair after the other.

    fitness: float64 (P,), higher is fitter; best: index of the fittest; settled: never, the
    budget ends the search; warm: never.
    """

    settled, warm, best = False, False, 0

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        self._config = config
        self._crew = Crew(config.threads)
        self._realtime = GuidedSearch(MatcherConfig.from_profile(
            'realtime', disparities=config.disparities, min_disparity=config.min_disparity,
            threads=config.threads, fill=True, warm_start=False), rows, columns)
        self._possibility = SupportPossibility(rows, columns, config.disparities, [SHARP, WIDE])
        shape = self._possibility.costs.shape
        self._guess = SurfaceGuess(shape)
        self._fitness = SurfaceFitness(shape, config.disparities)
        self._dense = DenseSurface(rows, columns, config.disparities)
        self._members = np.zeros((config.population, rows, columns), np.float32)
        self._parent, self._nothing, self._confidence = (
            np.zeros((rows, columns), np.float32) for _ in range(3))
        self._surface, self._target = (np.zeros((rows, columns), np.int16) for _ in range(2))
        self._margins = np.zeros((rows, columns), np.uint16)
        self.fitness = np.zeros(config.population)
        self.times = {}

    @property
    def population(self):
        """The members alive as labels, the fittest first: int16 (P, R, C)."""
        return np.rint(self._members[:len(self.fitness)]).astype(np.int16)

    def possibility_of(self, chromosome):
        """Return how possible the matches of a member are: float32 (R, C), 0 to 1."""
        return self._fitness.possibility_of(self._crew, chromosome.astype(np.float32))

    def start(self, left, right, state, seed_words):
        """
        Make the first member of a pair, and what all are measured by.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); state: not used; seed_words: whole
        numbers that chance is made of.
        """
        self._watch, self._seed_words = Stopwatch(), seed_words
        self.times = self._watch.times
        lowest = self._config.min_disparity
        self._inside = lowest, lowest + left.shape[1] - 1
        seed = self._members[0]
        self._realtime.start(left, right, None, seed_words)
        self._realtime.generation(1)
        self._realtime.finish(None, 0, seed, self._confidence)
        seed -= lowest
        self._watch.took('realtime')
        scale = eight_bit_scale(left, right)
        pictures = (colour_and_fine_grey(left, scale, 0),
                    colour_and_fine_grey(right, scale, lowest))
        self._colour = pictures[0][0]
        self._possibility.look(*pictures, max(lowest, 0))
        self._guess.look(self._colour)
        self._weak = self._weak_texture(pictures[0][1])
        self._watch.took('look')
        self._parent[:] = seed
        self._fill_along_parent()
        weights = CHILDREN[PLAN[0]].smoothness.weights()
        self._fitness.look(self._crew, self._possibility.costs, weights[self._guess.steps[0]],
                           weights[self._guess.steps[2]])
        self._watch.took('possibility')
        self._search(PLAN[0])
        self._fitness.trust(self._dense.verdict == REFUSED)
        self._target[:], self._margins[:] = self._guess.target, self._guess.margins
        self.fitness = np.full(1, self._fitness.measure(self._crew, seed, STEPS))
        self._watch.took('seeds')

    @staticmethod
    def _weak_texture(fine):
        """Return how weak the texture around each pixel is: float32 (R, C), 0 to 1."""
        steps = np.zeros_like(fine)
        np.abs(fine[:, 1:] - fine[:, :-1], out=steps[:, 1:])
        return np.exp(cv2.blur(steps, (6, 3)) / np.float32(-4 * WEAK_TEXTURE))

    def _fill_along_parent(self):
        """Fill the costs over supports that keep to the parent's surface."""
        surface = self._dense.smooth(self._crew, self._parent, self._colour, PARENT_RADIUS,
                                     PARENT_LIMIT)
        np.rint(surface, out=self._surface, casting='unsafe')
        self._possibility.fill(self._crew, SHARP, surface, LEVEL)

    def _search(self, name):
        """Choose the labels of a child, and check them."""
        possibility, guess, crew, child = (
            self._possibility, self._guess, self._crew, CHILDREN[name])
        if child.cold is not None:
            possibility.fill(crew, child.cold, self._nothing, LEVEL)
        weights = np.float32(child.strong) + np.float32(child.weak - child.strong) * self._weak
        leaning = (crew, self._parent, weights, DEAD_ZONE, CUT)
        possibility.lean_on(*leaning)
        guess.search(crew, possibility.costs, self._config.disparities, child.smoothness,
                     self._surface, child.steepest)
        possibility.lean_on(*leaning, undo=True)
        self._dense.check(crew, guess.labels, guess.target, self._inside)

    def generation(self, number, in_time=always):
        """
        Make a child of the parent and give the fittest its fitter regions, if there is time.

        The first child takes its parent's place: it has seen all that its parent knew. Returns
        the fitness gained.
        """
        if not in_time():
            return {}
        name = PLAN[(number - 1) % len(PLAN)]
        if number > 1:
            if name == PLAN[0]:
                self._parent[:] = self._members[0]
                self._fill_along_parent()
            self._search(name)
        former, places = self.fitness[0], self._config.population - 1
        self.fitness = np.resize(self.fitness, min(number, places) + 1)
        slot = 1 + (number - 1) % places
        if number == 1:
            self._members[slot] = self._members[0]
        child = self._members[0 if number == 1 else slot]
        self._dense.fill(self._crew, self._guess.labels, self._guess.offsets, self._colour, child)
        if number == 1:
            self.fitness[:] = self._fitness.measure(self._crew, child, STEPS), former
        else:
            saved, ahead = self._fitness.join(self._crew, self._members[0], child, STEPS)
            self.fitness[0], self.fitness[slot] = former + saved, former + ahead
        return {name: float(self.fitness[0] - former)}

    def finish(self, stamp, frame, disparity, confidence):
        """
        Write the disparities of the fittest and how sure they are; return no state.

        disparity, confidence: float32 (R, C), written
        """
        self._watch.took('generations')
        config, lowest = self._config, np.float32(self._config.min_disparity)
        surface = self._dense.smooth(self._crew, self._members[0], self._colour, OUTPUT_RADIUS,
                                     OUTPUT_LIMIT)
        labels = np.rint(surface).astype(np.int16)
        self._dense.check(self._crew, labels, self._target, self._inside)
        self._dense.refuse_speckles(labels, config.speckle_size, config.speckle_range)
        consistent = self._dense.verdict == CONSISTENT
        clear = CLEAR_MARGIN * FULL
        certain = consistent * (self._margins / (self._margins + clear))
        confidence[:] = cv2.blur(certain.astype(np.float32), (AROUND, AROUND)) * consistent
        np.add(surface, lowest, out=disparity)
        if not config.fill:
            disparity[~consistent | (confidence < config.confidence_threshold)] = np.nan
        self._watch.took('refinement')
