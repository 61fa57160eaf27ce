# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The seed of the profile `quality`: a dense map of each view, crossed from scanline optima.

Not in the paper. The parent is the map of the previous frame, or of the profile `realtime`. Its
children are scanline optima that are biased towards it everywhere, only where texture is weak, or
not at all. Partition crossover gives the first child the fitter regions of the others, by the
fitness of surface.py.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Budget
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.quality.possibility import Model, moved
from fuzzy_stereo_ros.matching.quality.scanlines import pixel_costs, ScanlineStrips, Smoothness
from fuzzy_stereo_ros.matching.quality.surface import DenseSurface, Steps, SurfaceFitness
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
import numpy as np

SHARP = Model(census=12, colour=43, slope=2, gradient=30, blurs=(0.4,), longest=8, near=4,
              rounds=2)
LEVEL = 0.4              # px of a parent's surface that supports may span
PARENT_RADIUS, PARENT_LIMIT = 6, 1.5     # of the local planes that make a parent's surface, px
OUTPUT_RADIUS, OUTPUT_LIMIT = 4, 0.6     # and of those of the result
DEAD_ZONE, CUT = 1.0, 4.0    # px from the parent where a child's bias begins to cost, and its most
WEAK_TEXTURE = 6.0       # mean step of grey at which the weakness of texture falls to 1 / e
SMOOTHNESS_STEPS = Steps(slope=0.16, free=0.25, jump=4.0, apart=0.5)


class DifferingRegions(NamedTuple):
    """Which regions of two maps differ."""

    distance: float          # px by which all of their pixels differ
    square_side: int         # px, of the squares that they are made of
    least_size: int          # px


WHOLE, PARTIAL = DifferingRegions(1.0, 9, 1600), DifferingRegions(0.5, 5, 100)


class ChildSettings(NamedTuple):
    """The settings of the search of a child, given its parent."""

    strong: float            # bias towards the parent, cost per px, where texture is strong
    weak: float              # the same where texture is weak
    smoothness: Smoothness
    steepest: int            # steepest slope of the parent, px a pixel, that paths follow; 0: none


LOOSE = Smoothness(jump=3.0, small=0.1, at_edge=0.1, edge=20.0)
CHILDREN = {
    'biased': ChildSettings(20, 60, LOOSE, 0),
    'biased_where_weak': ChildSettings(0, 60, LOOSE, 2),
    'independent': ChildSettings(0, 0, LOOSE._replace(small=0.05), 0),
}
UNBIASED = 'independent'     # the child of the data alone


class Seed(NamedTuple):
    """
    A dense map of a view, before planes evolve.

    surface: float32 (R, C), px from 0, dense; labels, margins: int16 and uint16 (R, C), the
    labels of the data alone, and by how much the best label elsewhere is worse, in parts of FULL
    """

    surface: np.ndarray
    labels: np.ndarray
    margins: np.ndarray


class ViewStart(NamedTuple):
    """
    The initial chromosome of a view.

    seed: a `Seed`; complete: whether there was time for the whole seed; else it is the parent
    colour: uint8 (R, C, 3); weak: float32 (R, C), how weak the texture is, 0 to 1
    """

    seed: Seed
    colour: np.ndarray
    weak: np.ndarray
    complete: bool


class ScanlineSeed:
    """Finds the seeds of pairs of one image size."""

    def __init__(self, config, pool, rows, columns):
        """Allocate for the disparities of a MatcherConfig; pool: the `ThreadPool` that works."""
        self._config, self._pool = config, pool
        self._scanlines = ScanlineStrips(rows, columns, config.disparities, SHARP)
        self._fitness = SurfaceFitness(rows, columns, config.disparities)
        self._dense = DenseSurface(rows, columns, config.disparities)
        self._parent = np.zeros((rows, columns), np.float32)

    def find(self, left, right, parent, in_time, searched=True):
        """
        Return the `ViewStart` of a pair.

        left, right: (colour, luminance), see over_frames.Inheritance; parent: float32 (R, C), px
        from 0, the map of the previous frame or of `realtime`; in_time: returns whether the
        deadline is still ahead; searched: whether children are searched, else the seed is the
        parent
        """
        lowest, (self._colour, luminance) = self._config.min_disparity, left
        self._inside = lowest, lowest + luminance.shape[1] - 1
        seed = Seed(parent.copy(), np.zeros(parent.shape, np.int16),
                    np.zeros(parent.shape, np.uint16))
        start = ViewStart(seed, self._colour, weak_texture(luminance), True)
        if not searched:
            return start
        self._scanlines.set_pair(left, moved(right, lowest), max(lowest, 0))
        return start._replace(complete=self._cross_children(start, parent, in_time))

    def _cross_children(self, start, parent, in_time):
        """
        Write the first child into the seed, then the fitter regions of the others.

        Returns whether there was time for all of them.
        """
        found, dense, fitness = self._scanlines, self._dense, self._fitness
        seed = start.seed
        self._parent[:] = parent
        surface = dense.smooth(self._pool, self._parent, self._colour, PARENT_RADIUS,
                               PARENT_LIMIT).copy()
        children = []
        for name, child in CHILDREN.items():
            if not self._search(child, surface, start.weak, in_time):
                break
            dense.check(self._pool, found.labels, found.target, self._inside)
            if not children:
                fitness.trust(dense.validity == INVALID)
            if name == UNBIASED:
                seed.labels[:], seed.margins[:] = found.labels, found.margins
            children.append(np.empty_like(surface))
            dense.fill(self._pool, found.labels, found.offsets, self._colour, children[-1])
        if children:
            seed.surface[:] = children[0]
            costs = self._costs_of(children, surface)
            for other, its_costs in zip(children[1:], costs[1:]):
                fitness.cross(seed.surface, costs[0], other, its_costs, SMOOTHNESS_STEPS)
        seed.surface[:] = dense.smooth(self._pool, seed.surface, self._colour, OUTPUT_RADIUS,
                                       OUTPUT_LIMIT)
        return len(children) == len(CHILDREN)

    def _search(self, child, surface, weak, in_time):
        """
        Choose the labels of a child; return whether there was time for all of it.

        surface: float32 (R, C), px, of the parent; weak: float32 (R, C), how weak the texture is
        """
        scanlines, pool = self._scanlines, self._pool
        weights = np.float32(child.strong) + np.float32(child.weak - child.strong) * weak
        whole = np.rint(surface).astype(np.int16)
        for strip in scanlines.strips:
            if not in_time():
                return False
            scanlines.fill(pool, strip, SHARP, surface, LEVEL)
            scanlines.search(pool, strip, (self._parent, weights, DEAD_ZONE, CUT),
                             child.smoothness, whole, child.steepest)
        return True

    def _costs_of(self, maps, surface):
        """Return the costs of the genes of maps, float32 (R, C); surface: of their parent."""
        results = [np.empty_like(surface) for _ in maps]
        for strip in self._scanlines.strips:
            costs = self._scanlines.fill(self._pool, strip, SHARP, surface, LEVEL)
            self._fitness.measure(self._pool, costs[strip.here], strip.first, maps, results)
        self._fitness.set_weights(LOOSE.weights()[self._scanlines.steps])
        return results


def costs_of_pixels(config, pool, left, right):
    """Return the costs of the matches of a pair, without supports: uint8 (R, C, labels)."""
    lowest = config.min_disparity
    return pixel_costs(pool, left, moved(right, lowest), config.disparities, SHARP,
                       max(lowest, 0))


def parent_of(inherited, fresh, noisy):
    """
    Return the map of the previous frame, but the one of this frame where regions differ.

    A plain region can be wrong as a whole, and then no plane around it is the right one. Noise is
    less in the average of one more frame: there smaller regions and differences count. Elsewhere
    what has evolved is better.

    inherited, fresh: float32 (R, C), px, of the previous frame and of `realtime`; noisy: whether
    the pictures are noisy
    """
    differing = PARTIAL if noisy else WHOLE
    apart = (abs(inherited - fresh) > differing.distance).astype(np.uint8)
    wide = cv2.morphologyEx(apart, cv2.MORPH_OPEN, np.ones((differing.square_side,) * 2, np.uint8))
    _, regions, measures, _ = cv2.connectedComponentsWithStats(wide, connectivity=4)
    large = measures[:, cv2.CC_STAT_AREA] >= differing.least_size
    large[0] = False        # where they do not differ
    return np.where(large[regions], fresh, inherited)


def realtime_matches(config, pairs, random):
    """Return the `Match` of the profile `realtime` for each pair, filled."""
    matcher = RealtimeMatcher(MatcherConfig.from_profile(
        'realtime', disparities=config.disparities, min_disparity=config.min_disparity,
        threads=config.threads, fill=True, warm_start=False), *pairs[0][0][1].shape)
    return [matcher.match(left[0], right[0], None, random, Budget(1, 0, 0))[0]
            for left, right in pairs]


def weak_texture(luminance):
    """Return how weak the texture around each pixel of luminance is: float32 (R, C), 0 to 1."""
    steps = np.zeros_like(luminance)
    np.abs(luminance[:, 1:] - luminance[:, :-1], out=steps[:, 1:])
    return np.exp(cv2.blur(steps, (6, 3)) / np.float32(-4 * WEAK_TEXTURE))
