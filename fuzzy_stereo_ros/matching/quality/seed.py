# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The seed of the profile `quality`: scanline optima under one fitness.

Not in the paper. The parent is what the profile `realtime` finds. The children are scanline optima
that rely on it everywhere, only where texture is weak, or not at all. The first one takes its
place; partition crossover gives it the fitter regions of the others. One measure serves all: the
possibility of maps in parts of a pixel over supports that keep to the parent's surface, and steps
of disparity, which are free as long as a slanted surface makes them and cost less at grey edges.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.crossover import Exchange, Regions
from fuzzy_stereo_ros.matching.evolution import Budget
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import copy_taken
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import INVALID
from fuzzy_stereo_ros.matching.quality.possibility import (
    colour_and_fine_grey, eight_bit_scale, Model)
from fuzzy_stereo_ros.matching.quality.scanlines import Smoothness
from fuzzy_stereo_ros.matching.quality.strips import pixel_costs, ScanlineStrips
from fuzzy_stereo_ros.matching.quality.surface import DenseSurface
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
import numpy as np

_HALF = 1                # genes are measured in 8 bits: costs divided by 2**_HALF
_TOGETHER = 16           # rows that are divided at a time
UNTRUSTED = 0.1          # share of a match that counts where the two views disagree


class Steps(NamedTuple):
    """What steps of disparity cost, and from what difference on genes count as different."""

    slope: float         # cost of a px beyond the free ones, in parts of FULL
    free: float          # px that cost nothing
    jump: float          # the most that a step costs, in parts of FULL
    apart: float         # px by which two genes differ


class SurfaceFitness:
    """Measures genes of maps of one image size and joins maps."""

    def __init__(self, rows, columns, disparities):
        """disparities: how many labels exist."""
        self._disparities = disparities
        self._across, self._down = (np.zeros((rows, columns), np.float32) for _ in range(2))
        self._trust = np.ones((rows, columns), np.float32)

    def trust(self, rejected):
        """Let matches count little where the two views disagree: bool (R, C)."""
        self._trust[:] = np.where(rejected, np.float32(UNTRUSTED), np.float32(1))

    def look(self, across, down):
        """Take the weights of steps to the left and up: float32 (R, C)."""
        self._across[:], self._down[:] = across, down

    def price(self, pool, costs, first, maps, results):
        """
        Write what the genes of maps cost in some rows, in halves of the costs' unit.

        costs: uint16 (rows, C, labels), 0 to FULL, from row `first` of the frame on; maps,
        results: of float32 (R, C)
        """
        def price(begin):
            # Half of FULL is 0 in a byte: a fully impossible match says nothing.
            half = (costs[begin:begin + _TOGETHER] >> _HALF).astype(np.uint8)
            rows = slice(first + begin, first + begin + len(half))
            for surface, result in zip(maps, results):
                surface_cost.gene_costs(half, self._disparities, surface[rows], self._trust[rows],
                                        result[rows], 0, len(half))
        pool.each(price, range(0, len(costs), _TOGETHER))

    def join(self, first, first_costs, second, second_costs, steps):
        """
        Give the first parent the second one's fitter regions, and what they cost.

        first, second: float32 (R, C), px; first_costs, second_costs: float32 (R, C), see price.
        Returns what it saved, in parts of surface_cost.PARTS.
        """
        exchange, apart = Exchange(*first.shape, 4), np.float32(steps.apart)
        exchange.hold(surface_cost.cells_apart(first, second, apart, exchange.all_cells))
        full = FULL >> _HALF
        surface_cost.exchange_changes(
            first, first_costs, second, second_costs, self._across, self._down,
            np.float32(steps.slope * full), np.float32(steps.free), np.float32(steps.jump * full),
            apart, exchange.cells, exchange.alone, exchange.pairs)
        cost = Regions(*first.shape)(exchange)
        copy_taken(exchange.cells, exchange.taken, first, second)
        copy_taken(exchange.cells, exchange.taken, first_costs, second_costs)
        return -cost


SHARP = Model(census=12, colour=43, slope=2, gradient=30, blurs=(0.4,), longest=8, near=4,
              rounds=2)
LEVEL = 0.4              # px of a parent's surface that supports may span
PARENT_RADIUS, PARENT_LIMIT = 6, 1.5     # of the local planes that make a parent's surface, px
OUTPUT_RADIUS, OUTPUT_LIMIT = 4, 0.6     # and of those of the result
DEAD_ZONE, CUT = 1.0, 4.0    # px: a child's leaning on its parent begins, and ends, that far
WEAK_TEXTURE = 6.0       # mean grey step at which texture is not weak any more
STEPS = Steps(slope=0.16, free=0.25, jump=4.0, apart=0.5)


class Child(NamedTuple):
    """How a child is made of its parent."""

    strong: float            # what leaning on the parent costs a px where texture is strong
    weak: float              # and where it is weak
    smoothness: Smoothness
    steepest: int            # px a pixel that paths follow the parent's surface; 0, they do not


LOOSE = Smoothness(jump=3.0, small=0.1, at_edge=0.1, edge=20.0)
CHILDREN = {
    'leaning': Child(20, 60, LOOSE, 0),
    'leaning_where_weak': Child(0, 60, LOOSE, 2),
    'independent': Child(0, 0, LOOSE._replace(small=0.05), 0),
}
UNBIASED = 'independent'     # the child that tells what the data alone say


class Seed(NamedTuple):
    """
    What is known of a view before planes evolve.

    surface: float32 (R, C), px from 0, dense; labels, margins: int16 and uint16 (R, C), what the
    data alone chose, and by how much the best label elsewhere is worse, in parts of FULL
    """

    surface: np.ndarray
    labels: np.ndarray
    margins: np.ndarray


class Start(NamedTuple):
    """
    What the first chromosomes of a view are made of.

    seed: a `Seed`; realtime: float32 (R, C), px, the map of the profile `realtime`
    colour: uint8 (R, C, 3); weak: float32 (R, C), how weak the texture is, 0 to 1
    """

    seed: Seed
    realtime: np.ndarray
    colour: np.ndarray
    weak: np.ndarray


class ScanlineSeed:
    """The memory that seeds of one image size need."""

    def __init__(self, config, rows, columns):
        """Allocate for the disparities of a MatcherConfig."""
        self._config = config
        self._pool = ThreadPool(config.threads)
        self._scanlines = ScanlineStrips(rows, columns, config.disparities, SHARP)
        self._fitness = SurfaceFitness(rows, columns, config.disparities)
        self._dense = DenseSurface(rows, columns, config.disparities)
        self._parent = np.zeros((rows, columns), np.float32)

    def find(self, left, right, realtime, in_time):
        """
        Return the `Start` of a pair.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); realtime: float32 (R, C), px from 0, the
        map of the profile `realtime`; in_time: says whether more may be done
        """
        lowest = self._config.min_disparity
        self._inside = lowest, lowest + left.shape[1] - 1
        fine = self._look(left, right)
        seed = Seed(realtime.copy(), np.zeros(realtime.shape, np.int16),
                    np.zeros(realtime.shape, np.uint16))
        start = Start(seed, realtime, self._colour, weak_texture(fine))
        self._join_children(start, in_time)
        return start

    def _look(self, left, right):
        """Take in a pair; return its left fine grey."""
        pictures, first_inside = _pictures(self._config, left, right)
        self._colour = pictures[0][0]
        self._scanlines.look(*pictures, first_inside)
        return pictures[0][1]

    def _join_children(self, start, in_time):
        """Give the seed the first child, then the fitter regions of each of the others."""
        found, dense, fitness = self._scanlines, self._dense, self._fitness
        seed = start.seed
        self._parent[:] = start.realtime
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
                fitness.join(seed.surface, costs[0], other, its_costs, STEPS)
        seed.surface[:] = dense.smooth(self._pool, seed.surface, self._colour, OUTPUT_RADIUS,
                                       OUTPUT_LIMIT)

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
        """Return what the genes of maps cost, float32 (R, C); surface: of their parent."""
        results = [np.empty_like(surface) for _ in maps]
        for strip in self._scanlines.strips:
            costs = self._scanlines.fill(self._pool, strip, SHARP, surface, LEVEL)
            self._fitness.price(self._pool, costs[strip.here], strip.first, maps, results)
        self._fitness.look(*LOOSE.weights()[self._scanlines.steps])
        return results


def costs_of_pixels(config, pool, left, right):
    """Return the costs of the matches of a pair, without supports: uint8 (R, C, labels)."""
    pictures, first_inside = _pictures(config, left, right)
    return pixel_costs(pool, *pictures, config.disparities, SHARP, first_inside)


def _pictures(config, left, right):
    """Return (colour, fine grey) of both images, and the first column of the right that exists."""
    lowest, scale = config.min_disparity, eight_bit_scale(left, right)
    return ((colour_and_fine_grey(left, scale, 0), colour_and_fine_grey(right, scale, lowest)),
            max(lowest, 0))


def realtime_maps(config, pairs, random):
    """Return the map of the profile `realtime` for each pair: float32 (R, C), px from 0."""
    matcher = RealtimeMatcher(MatcherConfig.from_profile(
        'realtime', disparities=config.disparities, min_disparity=config.min_disparity,
        threads=config.threads, fill=True, warm_start=False), *pairs[0][0].shape[:2])
    return [matcher.match(*pair, None, random, Budget(1, 0, 0))[0].disparity
            - np.float32(config.min_disparity) for pair in pairs]


def weak_texture(fine):
    """Return how weak the texture around each pixel of fine grey is: float32 (R, C), 0 to 1."""
    steps = np.zeros_like(fine)
    np.abs(fine[:, 1:] - fine[:, :-1], out=steps[:, 1:])
    return np.exp(cv2.blur(steps, (6, 3)) / np.float32(-4 * WEAK_TEXTURE))
