# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The previous frame's best chromosome: when to take it, and where to trust it.

Not in the paper. A fit map is no proof of freshness: where nothing denies it, a stale previous
best would freeze the picture. So it leans on the search of this frame only tile by tile, where it
was consistent on its own frame, costs no more on this one, and agrees with the half map.
"""
from dataclasses import dataclass

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels import narrowing, trust
from fuzzy_stereo_ros.matching.scanline_guess import gene_type, prior_of
import numpy as np

TOLERANCE = 0.5      # cost units that a trusted tile may have become dearer
DISTANCE = 2         # px that a trusted gene may differ from the half map
FLAT = 1             # largest range of trusted labels in 3 x 3 half-size pixels
OF_AGE = 2           # frames after which a gene's prior has no dead zone
RULES = (1, 4), (0, 4)   # dead zone and cut of the prior of a young gene, and of one of age
LONGEST_GAP_NS = 1_000_000_000   # a previous frame older than this is forgotten


@dataclass(frozen=True)
class FrameState:
    """
    What a frame hands on to the next one; plain arrays, so that it can be saved.

    labels: uint8 or uint16 (R, C), the best chromosome; verdict: uint8 (R, C), 0 = consistent;
    age: uint8 (R, C), frames survived; costs: float32 by tile, what the chromosome cost; stamp:
    ns or None; frame: number of the frame; disparities, min_disparity: what labels mean.
    """

    labels: np.ndarray
    verdict: np.ndarray
    age: np.ndarray
    costs: np.ndarray
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
        self._tiles = -(-rows // trust.TILE), -(-columns // trust.TILE)
        self._bands, self._tile_bands = cut_bands(rows), cut_bands(self._tiles[0])
        self._costs = np.zeros(self._tiles, np.float32)
        self._labels = np.zeros(half, gene_type(disparities))
        self._trusted, self._smooth = (np.zeros(half, np.uint8) for _ in range(2))
        self._nothing = np.zeros((rows, columns), self._labels.dtype)
        self._weights = np.zeros((rows, columns), np.uint8)
        self._no_age = np.zeros((rows, columns), np.uint8)
        self._age = self._no_age
        self.prior = prior_of(self._nothing, self._weights, disparities, *RULES)

    def judge(self, crew, state, possibility, first_inside, coarse):
        """Make the prior from the previous frame's state, or an empty one from None."""
        if state is None:
            self._weights[:] = 0
            self._age = self._no_age
            self.prior = self.prior._replace(labels=self._nothing)
            return
        self._age = state.age
        crew.each(lambda band: trust.tile_costs(
            possibility.features, state.labels, first_inside, self._costs, band[1], band[2]),
            self._tile_bands)
        trust.trusted_cells(state.labels, state.verdict, coarse.labels, coarse.verdict,
                            self._costs, state.costs, TOLERANCE, DISTANCE,
                            self._labels, self._trusted)
        narrowing.flat(self._labels, FLAT, self._smooth)
        crew.each(lambda band: trust.lean_on_previous(
            self._trusted, self._smooth, state.age, OF_AGE, self._weights, band[1], band[2]),
            self._bands)
        self.prior = self.prior._replace(labels=state.labels)

    @property
    def trusted(self):
        """Share of the pixels where the previous best is leant on."""
        return np.count_nonzero(self._weights) / self._weights.size

    def hand_on(self, crew, labels, verdict, possibility, first_inside, config, stamp, frame):
        """Return the state of this frame for the next one."""
        age = np.empty_like(verdict)
        trust.grow_older(labels, self.prior.labels, self._weights, self._age, age)
        costs = np.zeros(self._tiles, np.float32)
        crew.each(lambda band: trust.tile_costs(
            possibility.features, labels, first_inside, costs, band[1], band[2]),
            self._tile_bands)
        return FrameState(labels.copy(), verdict.copy(), age, costs, stamp, frame,
                          config.disparities, config.min_disparity)
