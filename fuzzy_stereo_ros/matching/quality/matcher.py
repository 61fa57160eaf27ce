# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The profile `quality`: `QualityMatcher.match` is one pair, a line a stage.

Genes are planes, and both views of a pair evolve. Scanlines give each view a dense seed, whose
parent is the map of the previous frame, moved, or that of `realtime`; planes fitted around its
pixels are the chromosome. Colours count as the left camera would have exposed them. Mutants are
planes of segments; fusion by a minimum cut takes those that are fitter, unless the
images are evidence against them. Where the views disagree, a match counts little.
"""
from collections.abc import Callable
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Cut, Exchange
from fuzzy_stereo_ros.matching.evolution import evolve, Stopwatch
from fuzzy_stereo_ros.matching.kernels.planes.costs import reject_unfounded, UNIT
from fuzzy_stereo_ros.matching.match import Match, mirrored
from fuzzy_stereo_ros.matching.over_frames.inheritance import Inheritance
from fuzzy_stereo_ros.matching.quality.exposure import exposed_alike
from fuzzy_stereo_ros.matching.quality.fitness import PlaneFitness
from fuzzy_stereo_ros.matching.quality.operators import OPERATORS
from fuzzy_stereo_ros.matching.quality.planes import local_planes, segments_of
from fuzzy_stereo_ros.matching.quality.population import EvolvingView, Population
from fuzzy_stereo_ros.matching.quality.result import refine, without_uncertain
from fuzzy_stereo_ros.matching.quality.seed import (
    costs_of_pixels, parent_of, realtime_matches, ScanlineSeed, uncrossed)
import numpy as np

BRIGHTNESS = np.float32(1 / 64)      # of luminance, 16 bits, to the sum of four grey levels
LEAST_AGE = 5        # frames averaged from which a map of noisy pictures is a parent
LITTLE = 0.1         # share of unseen cells up to which the right map is not searched
UNSEEN_ANEW = 0.25   # share of unseen cells from which a frame begins anew
ROOT = 16        # edges are measured in 16 * root of a colour, whose noise is the same everywhere


class QualityState(NamedTuple):
    """
    What the profile adds to a `FrameState`.

    disparities: float32 (2, R, C), px from 0, the fittest map of the left and of the mirrored
    right view
    """

    disparities: np.ndarray

    @property
    def labels(self):
        """The left map in whole px: uint16 (R, C)."""
        return np.rint(self.disparities[0]).astype(np.uint16)

    @property
    def maps(self):
        """The maps that are moved to find where cells were: (2, R, C)."""
        return self.disparities

    def after(self, gap_ns):
        """Return it for a frame that comes so much later."""
        return self

    def layout(self, shape, labels, known):
        """Return {name: (dtype, shape)} of the arrays; shape: of images; known: if a camera is."""
        return {'disparities': (np.float32, (2, *shape))}

    def check(self, labels):
        """Raise ValueError for a number that kernels, which check no index, cannot use."""
        if not ((self.disparities >= 0) & (self.disparities <= labels - 1)).all():
            raise ValueError('the state has disparities out of range')


class Stages(NamedTuple):
    """
    The stages that can be exchanged, as the ablation does (bench/variants.py).

    crossover: called with rows, columns and 4 neighbours, returns a crossover of an `Exchange`
    operators: {name: operator}, in the order in which they are called
    evidence: a check of proposals, called as reject_unfounded
    """

    crossover: Callable = Cut
    operators: dict = OPERATORS
    evidence: Callable = reject_unfounded


class QualityMatcher:
    """The stages of one image size; population: of the last pair, None if its time ran out."""

    state_type = QualityState

    def __init__(self, config, rows, columns, stages=None):
        """Allocate nothing yet: each pair allocates its memory, and frees that of the last."""
        self._config, self._shape = config, (rows, columns)
        self._stages, self.pool = stages or Stages(), ThreadPool(config.threads)
        self._inheritance = Inheritance(config, rows, columns, seen=2, least_age=LEAST_AGE)
        self.population = None

    def match(self, left, right, previous, random, budget, observe=None, camera=None):
        """Match a pair with what `evolve` takes; return its `Match` and `FrameState`."""
        watch, inheritance, inherited = Stopwatch(), self._inheritance, False
        self.population = None
        inheritance.read(self.pool, left, right, previous)
        if self._config.warm_start:
            inherited = (inheritance.average(self.pool, previous, camera)
                         and inheritance.unseen < UNSEEN_ANEW)
        watch.lap('pictures')
        left, right = zip(inheritance.colours, (
            luminance * BRIGHTNESS for luminance in inheritance.luminances))
        found = realtime_matches(self._config, _of_both_views(left, right), random)
        right = exposed_alike(left[0], right[0], found[0]), right[1]
        maps = [match.disparity - np.float32(self._config.min_disparity) for match in found]
        if inherited:
            budget = budget.of_one_generation()
            for side, (before, fresh) in enumerate(zip(previous.own.disparities, maps)):
                moved = np.empty_like(fresh)
                inheritance.inherit(before, fresh, moved, side)
                maps[side] = parent_of(moved, fresh, inheritance.noisy)
        starts = self._starts(_of_both_views(left, right), maps, budget,
                              inherited and inheritance.unseen < LITTLE)
        watch.lap('seeds')
        if not starts[0].complete:      # the deadline is past: the best so far
            return Match(*without_uncertain(self._config, found[0].disparity,
                                            found[0].confidence), [], watch.times, False), None
        volume = costs_of_pixels(self._config, self.pool, left, right)
        self.population = self._initial_population(starts, volume)
        seed = starts[0]
        del starts, volume       # frees their memory
        watch.lap('views')
        history = evolve(self.population, self._stages.operators, random, budget, observe)
        watch.lap('generations')
        disparity, confidence = refine(self.pool, self._config, self.population, seed,
                                       random.child(0))
        watch.lap('refinement')
        state = None
        if self._config.warm_start:
            disparities = np.stack([view.disparities for view in self.population.views])
            state = inheritance.next_state(disparities[0], confidence, QualityState(disparities),
                                           self._config)
            watch.lap('handing_on')
        return Match(disparity, confidence, history, watch.times, inherited,
                     inheritance.motion), state

    def possibility_of(self, chromosome):
        """Return how possible the matches of a map of labels are: float32 (R, C), 0 to 1."""
        view = self.population.views[0]
        planes = np.zeros(view.planes.shape, np.float32)
        planes[:, 2] = chromosome
        return 1 - view.fitness.match_costs(self.pool, planes).astype(np.float32) / UNIT

    def _starts(self, pairs, maps, budget, known):
        """Return both `Seed`s of maps, px from 0; known: the right map is taken as it is."""
        scanlines = ScanlineSeed(self._config, self.pool, *self._shape)
        return [uncrossed(pair[0], parent) if side and known
                else scanlines.find(*pair, parent, budget.in_time)
                for side, (pair, parent) in enumerate(zip(pairs, maps))]

    def _initial_population(self, starts, volume):
        """Return the population of a pair: planes around the pixels of both seeds."""
        stages, lowest, columns = self._stages, self._config.min_disparity, self._shape[1]
        tools = (stages.crossover(*self._shape, 4), Exchange(*self._shape, 4), stages.evidence)
        views = []
        for start, origin in zip(starts, (None, columns - 1 + lowest)):
            colour = start.colour
            roots = ROOT * np.sqrt(colour.astype(np.float32))
            fitness = PlaneFitness(*self._shape, self._config.disparities)
            fitness.set_view(self.pool, volume, origin, colour, roots, start.weak)
            views.append(EvolvingView(self.pool, fitness, segments_of(roots), tools,
                                      local_planes(self.pool, start.surface, colour)))
        population = Population(views, lowest)
        population.update_trust([start.surface for start in starts])
        return population


def _of_both_views(left, right):
    """Return a pair and, mirrored, that of the right view; each image: (colour, luminance)."""
    return (left, right), tuple(tuple(map(mirrored, image)) for image in (right, left))
