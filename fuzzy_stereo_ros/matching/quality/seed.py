# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The seed of the profile `quality`: a dense map of each view, crossed from scanline optima.

Not in the paper. The parent is the map of the previous frame, or of the profile `realtime`. Its
children are scanline optima that are biased towards it everywhere, only where texture is weak, or
not at all. Partition crossover gives the first child the fitter regions of the others: the
fitness is the possibility of matches over supports that keep to the parent's surface, and steps of
disparity, free as far as a slanted surface makes them, cheaper at edges of grey.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.crossover import Exchange, PartitionCrossover
from fuzzy_stereo_ros.matching.evolution import Budget
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.planes import fits
from fuzzy_stereo_ros.matching.kernels.refinement import consistency, filling
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.quality.planes import LIMIT, neighbours, PLANE_RADIUS
from fuzzy_stereo_ros.matching.quality.possibility import moved
from fuzzy_stereo_ros.matching.quality.scanlines import pixel_costs, ScanlineStrips, WEIGHTS
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
import numpy as np

PARENT_RADIUS, PARENT_LIMIT = 6, 1.5     # of the local planes that make a parent's surface, px
DEAD_ZONE, CUT = 1.0, 4.0    # px from the parent where a child's bias begins to cost, and its most
WEAK_TEXTURE = 6.0       # mean step of grey at which the weakness of texture falls to 1 / e
UNTRUSTED_SHARE = 0.1    # share of a match that counts where the two views disagree
# Of medians, by the difference of colours summed over channels, and by rows or columns from -9 on.
MEDIAN_WEIGHTS = tuple(np.exp(-power).astype(np.float32) for power in (
    np.arange(766) / 20.0, np.arange(-9, 10)**2 / (2 * 9.0**2)))
_HALF = 1                # genes are measured in 8 bits: costs divided by 2**_HALF
_TOGETHER = 16           # rows that are divided at a time


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
    small: float             # what a step of 1 px costs, as a share of a jump
    steepest: int            # steepest slope of the parent, px a pixel, that paths follow; 0: none


CHILDREN = (        # biased, biased where texture is weak, and of the data alone
    ChildSettings(20, 60, 0.1, 0),
    ChildSettings(0, 60, 0.1, 2),
    ChildSettings(0, 0, 0.05, 0),
)


class Seed(NamedTuple):
    """
    A view before planes evolve: a dense map, and what its fitness needs.

    surface: float32 (R, C), px from 0; labels, margins: int16 and uint16 (R, C), the labels of the
    data alone, and by how much the best label elsewhere is worse, in parts of FULL; colour: uint8
    (R, C, 3); weak: float32 (R, C), how weak the texture is, 0 to 1; complete: whether children
    were crossed; else the surface is the parent
    """

    surface: np.ndarray
    labels: np.ndarray
    margins: np.ndarray
    colour: np.ndarray
    weak: np.ndarray
    complete: bool = False


def uncrossed(view, parent):
    """Return the `Seed` of a view, (colour, luminance), that is its parent, float32 (R, C)."""
    return Seed(parent, np.zeros(parent.shape, np.int16), np.zeros(parent.shape, np.uint16),
                view[0], weak_texture(view[1]))


class ScanlineSeed:
    """Finds the seeds of pairs of one image size."""

    def __init__(self, config, pool, rows, columns):
        """Allocate for the disparities of a MatcherConfig; pool: the `ThreadPool` that works."""
        self._config, self._pool = config, pool
        self._scanlines = ScanlineStrips(
            rows, columns, config.disparities, config.min_disparity)

    def find(self, left, right, parent, in_time):
        """Return the `Seed` of a pair, its first child with fitter regions, else the parent."""
        pool, found, lowest = self._pool, self._scanlines, self._config.min_disparity
        labels, start, children = self._config.disparities, uncrossed(left, parent), []
        inside = lowest, lowest + parent.shape[1] - 1
        surface = smooth(pool, parent, start.colour, labels, PARENT_RADIUS, PARENT_LIMIT)
        found.set_pair(left, moved(right, lowest, labels), surface)
        for child in CHILDREN:
            if not self._search(child, parent, surface, start.weak, in_time):
                return start
            validity = consistency_of(pool, found.labels, found.target, inside)
            if not children:
                trust = np.where(validity == INVALID, np.float32(UNTRUSTED_SHARE), np.float32(1))
            children.append(dense(pool, np.clip(
                found.labels + found.offsets, 0, labels - 1), validity, start.colour))
        costs = [np.empty_like(surface) for _ in children]
        for strip in found.strips:
            measure(pool, found.fill(pool, strip)[strip.here], strip.rows.start, labels, trust,
                    children, costs)
        weights = WEIGHTS[found.steps]
        for other, its_costs in zip(children[1:], costs[1:]):
            cross(children[0], costs[0], other, its_costs, weights)
        return start._replace(
            surface=smooth(pool, children[0], start.colour, labels), complete=True,
            labels=found.labels.copy(), margins=found.margins.copy())

    def _search(self, child, parent, surface, weak, in_time):
        """Choose a child's labels by the parent's surface, px; return whether time was left."""
        weights = np.float32(child.strong) + np.float32(child.weak - child.strong) * weak
        whole = np.rint(surface).astype(np.int16)
        for strip in self._scanlines.strips:
            if not in_time():
                return False
            self._scanlines.fill(self._pool, strip)
            self._scanlines.search(self._pool, strip, (parent, weights, DEAD_ZONE, CUT),
                                   child.small, whole, child.steepest)
        return True


def costs_of_pixels(config, pool, left, right):
    """Return the costs of the matches of a pair, without supports: uint8 (R, C, labels)."""
    disparities, lowest = config.disparities, config.min_disparity
    return pixel_costs(pool, left, moved(right, lowest, disparities), disparities, lowest)


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


def consistency_of(pool, labels, target, target_range):
    """Return the validity of labels, int16 (R, C), by the target; target_range: its columns."""
    validity = np.empty(labels.shape, np.uint8)
    pool.each(lambda band: consistency.check_consistency(
        labels, target, target_range, validity, *band[1:]), cut_bands(len(labels)))
    return validity


def dense(pool, fitted, validity, colour):
    """Return a map, float32 (R, C), whose rejected pixels get the background's, then medians."""
    filled, median = np.empty_like(fitted), np.empty_like(fitted)
    rejected, bands = validity == INVALID, cut_bands(len(fitted))
    pool.each(lambda band: filling.fill_rows(fitted, validity, filled, *band[1:]), bands)
    pool.each(lambda band: fits.weighted_median(
        filled, rejected, colour, *MEDIAN_WEIGHTS, median, *band[1:]), bands)
    return cv2.medianBlur(median, 5)


def smooth(pool, surface, colour, labels, radius=PLANE_RADIUS, limit=LIMIT):
    """Return a map as the planes around its pixels say: float32 (R, C), px, up to labels - 1."""
    result, around = np.empty_like(surface), neighbours(radius, limit)
    pool.each(lambda band: fits.smooth(
        surface, colour, around, result, *band[1:]), cut_bands(len(surface)))
    return np.clip(result, 0, labels - 1, out=result)


def measure(pool, costs, first, disparities, trust, maps, results):
    """Write half the costs of genes of maps from row first on; costs: uint16 (rows, C, labels)."""
    def measure_rows(begin):
        # Half of FULL becomes 0 in a byte: a fully impossible match is no evidence.
        half = (costs[begin:begin + _TOGETHER] >> _HALF).astype(np.uint8)
        rows = slice(first + begin, first + begin + len(half))
        for surface, result in zip(maps, results):
            surface_cost.gene_costs(half, disparities, surface[rows], trust[rows], result[rows])
    pool.each(measure_rows, range(0, len(costs), _TOGETHER))


def cross(first, first_costs, second, second_costs, weights):
    """
    Give the first parent the second one's fitter regions, and their costs.

    first, second: float32 (R, C), px; first_costs, second_costs: float32 (R, C), see measure;
    weights: float32 (2, R, C), of steps to the left and up. Returns what it saved, in parts of
    surface_cost.COST_PARTS.
    """
    exchange = Exchange(*first.shape, 4)
    exchange.set_cells(abs(first - second) > surface_cost.APART)
    surface_cost.exchange_changes(
        first, first_costs, second, second_costs, weights, exchange.changes())
    cost = PartitionCrossover(*first.shape)(exchange)
    exchange.take(first, second)
    exchange.take(first_costs, second_costs)
    return -cost
