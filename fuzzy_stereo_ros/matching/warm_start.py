# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The previous frame's best chromosome: when to take it, and where to trust it.

Not in the paper. A fit map is no proof of freshness: where nothing denies it, a stale previous
best would freeze the picture. So it leans on the search of this frame only tile by tile, where it
was consistent on its own frame, looks the same and costs no more on this one, and agrees with the
half map.
"""
from dataclasses import dataclass

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels import narrowing, trust
from fuzzy_stereo_ros.matching.kernels.consistency import OUTSIDE
from fuzzy_stereo_ros.matching.motion import Motion
from fuzzy_stereo_ros.matching.scanline_guess import gene_type, prior_of
import numpy as np

DEARER, TOLERANCE = 1.3, -0.3   # a trusted tile costs at most DEARER times as then + TOLERANCE
CHANGED = 6          # grey levels by which a tile that is still the same may brighten or darken
CUT_SHARE = 0.7      # share of changed tiles beyond which it is another scene altogether
DISTANCE = 2         # px that a trusted gene may differ from the half map
FLAT = 0             # largest range of trusted labels in 3 x 3 half-size pixels
DEAD_ZONE, CUT = 0, 1   # of the prior: a label that is not the previous one costs 1 more
LONGEST_GAP_NS = 1_000_000_000   # a previous frame older than this is forgotten


@dataclass(frozen=True)
class FrameState:
    """
    What a frame hands on to the next one; plain arrays, so that it can be saved.

    labels: uint8 or uint16 (R, C), the best chromosome; verdict: uint8 (R, C), 0 = consistent;
    costs: float32 by tile, what the chromosome cost; glance: float32, a small picture of the
    frame; stamp: ns or None; frame: its number; disparities, min_disparity: what labels mean.
    """

    labels: np.ndarray
    verdict: np.ndarray
    costs: np.ndarray
    glance: np.ndarray
    stamp: int | None
    frame: int
    disparities: int
    min_disparity: int

    def fits(self, shape, config, stamp):
        """Return whether a pair of a shape, taken at a stamp, may start from this frame."""
        if self.labels.shape != shape or (self.disparities, self.min_disparity) != (
                config.disparities, config.min_disparity):
            return False
        if stamp is None or self.stamp is None:
            return stamp is self.stamp
        return 0 < stamp - self.stamp <= LONGEST_GAP_NS


class WarmStart:
    """The trust in the previous best on this frame, as a prior of the scanline guess."""

    def __init__(self, rows, columns, disparities):
        """Allocate for images of a size and a number of disparities."""
        half = rows // 2, columns // 2
        tiles = -(-rows // trust.TILE), -(-columns // trust.TILE)
        self._bands, self._tile_bands = cut_bands(rows), cut_bands(tiles[0])
        self._motion = Motion(rows, columns)
        self._costs, self._moved_costs, self._costs_then = (
            np.zeros(tiles, np.float32) for _ in range(3))
        self._labels = np.zeros(half, gene_type(disparities))
        self._trusted, self._smooth = (np.zeros(half, np.uint8) for _ in range(2))
        self._nothing = np.zeros((rows, columns), self._labels.dtype)
        self._moved = np.zeros_like(self._nothing), np.zeros((rows, columns), np.uint8)
        self._weights = np.zeros((rows, columns), np.uint8)
        self._glance = np.zeros((0, 0), np.float32)
        self.prior = prior_of(self._nothing, self._weights, disparities, (DEAD_ZONE, CUT))

    def judge(self, crew, state, possibility, first_inside, coarse):
        """Make the prior from the previous frame's state, or an empty one from None."""
        self._glance = self._motion.glance(possibility.left.grey)
        if state is None:
            self._weights[:] = 0
            self.prior = self.prior._replace(labels=self._nothing)
            return
        labels, verdict, costs_then = self._bring_forward(
            crew, state, possibility, first_inside)
        trust.trusted_cells(labels, verdict, coarse.labels, coarse.verdict, self._costs,
                            costs_then * DEARER, TOLERANCE, DISTANCE, self._labels, self._trusted)
        narrowing.flat(self._labels, FLAT, self._smooth)
        crew.each(lambda band: trust.lean_on_previous(
            self._trusted, self._smooth, self._weights, band[1], band[2]), self._bands)
        self.prior = self.prior._replace(labels=labels)

    def _bring_forward(self, crew, state, possibility, first_inside):
        """
        Move the previous best with the picture, tile by tile where that makes it fitter.

        Returns labels, verdict and what the tiles cost then; `_costs` is what they cost now.
        """
        maps, tiles = (state.labels, state.verdict), self._costs.shape
        self._cost(crew, possibility, maps[0], first_inside, self._costs)
        changed = self._motion.change(state.glance, self._glance, 0, 0, tiles)
        costs_then = state.costs
        down, right = self._motion.between(state.glance, self._glance)
        if (down, right) != (0, 0):
            def move(band):
                for source, outside, moved in zip(maps, (0, OUTSIDE), self._moved):
                    trust.move_map(source, down, right, outside, moved, band[1], band[2])
            crew.each(move, self._bands)
            self._cost(crew, possibility, self._moved[0], first_inside, self._moved_costs)
            unmoved = self._costs <= self._moved_costs
            trust.move_tile_costs(state.costs, down, right, self._costs_then)
            costs_then = np.where(unmoved, state.costs, self._costs_then)
            changed = np.where(unmoved, changed, self._motion.change(
                state.glance, self._glance, down, right, tiles))
            trust.keep_unmoved_tiles(self._costs, self._moved_costs, maps, self._moved)
            self._costs[:] = self._moved_costs
            maps = self._moved
        changed = changed > CHANGED
        self._costs[changed | (changed.mean() > CUT_SHARE)] = np.inf
        return *maps, costs_then

    def _cost(self, crew, possibility, labels, first_inside, costs):
        """Fill what the tiles of a map cost on this frame."""
        crew.each(lambda band: trust.tile_costs(
            possibility.features, labels, first_inside, costs, band[1], band[2]),
            self._tile_bands)

    def hand_on(self, crew, labels, verdict, possibility, first_inside, config, stamp, frame):
        """Return the state of this frame for the next one."""
        costs = np.empty_like(self._costs)
        self._cost(crew, possibility, labels, first_inside, costs)
        return FrameState(labels.copy(), verdict.copy(), costs, self._glance, stamp, frame,
                          config.disparities, config.min_disparity)
