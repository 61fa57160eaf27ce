# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The chromosome at half size: the cold parent of every frame, and what it tells the full search.

Not in the paper. It is made anew for each pair, so that it bears witness against a stale previous
best; its labels narrow the windows of the full search and carry it over weak texture.
"""
import cv2
from fuzzy_stereo_ros.matching.kernels.refinement import filling
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    check_consistency, refuse_speckles)
from fuzzy_stereo_ros.matching.kernels.scanlines import narrowing
from fuzzy_stereo_ros.matching.realtime.possibility import CensusPossibility, HALF_SIZE
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type, prior_of, ScanlineGuess
import numpy as np

TILE = 64               # half-size pixels that are searched at a time
SPECKLE = 20            # half-size pixels; smaller components of the half map are refused
DEAD_ZONE, CUT = 1, 2   # the prior is silent within 1 px and says no more beyond 3
WEAK_TEXTURE = 72       # sum of 18 grey steps below which texture is weak: 4 on average
CLEAR = 4               # summed cost by which a label of the half map is the only one to lean on
FLAT = 1                # largest range of labels in 3 x 3 pixels that a prior leans on
GROW, MARGIN = 8, 4     # pixels around a tile, and labels around its own, that it searches too


class CoarseGuess:
    """A half-size chromosome and its memory."""

    def __init__(self, rows, columns, disparities, extra=0):
        """
        Allocate for full images of a size and a number of disparities.

        extra: columns of the full target before column 0, even.
        """
        half_rows, half_columns = rows // 2, columns // 2
        self.possibility = CensusPossibility(
            half_rows, half_columns, -(-disparities // 2), HALF_SIZE, extra // 2)
        self._guess = ScanlineGuess(self.possibility, TILE)
        self.verdict = np.zeros((half_rows, half_columns), np.uint8)
        self.labels, self._filled = (np.zeros_like(self._guess.chosen.labels) for _ in range(2))
        self._runs = [np.zeros(self.verdict.size, np.int32) for _ in range(4)]
        self._steps = np.zeros((half_rows, half_columns), np.uint16)
        self._weak, self._smooth = (np.zeros_like(self.verdict) for _ in range(2))
        self.prior = prior_of(np.zeros((rows, columns), gene_type(disparities)),
                              np.zeros((rows, columns), np.uint8), disparities, (DEAD_ZONE, CUT))

    @property
    def bands(self):
        """The bands of rows of the half-size image."""
        return self._guess.bands

    def search(self, crew, inside):
        """
        Find the half-size chromosome: `labels`, dense, and the `verdict` on its pixels.

        inside: the first and the last column of the full target that exist.
        """
        self._guess.search(crew)
        chosen, columns = self._guess.chosen, self.labels.shape[1]
        half_inside = inside[0] // 2, inside[1] // 2
        crew.each(lambda band: check_consistency(
            chosen.labels, chosen.target, self.possibility.disparities, half_inside,
            self.verdict, band[1], band[2]), self._guess.bands)
        refuse_speckles(chosen.labels.reshape(-1), self.verdict.reshape(-1), columns, 1, SPECKLE,
                        *self._runs)
        crew.each(lambda band: filling.fill_rows(
            chosen.labels, self.verdict, self._filled, band[1], band[2]), self._guess.bands)
        cv2.medianBlur(self._filled, 5, dst=self.labels)

    def guide(self, grey):
        """Make the prior of the full search from the half map; grey: uint8, the full left one."""
        narrowing.weak_texture(grey, *self.labels.shape, WEAK_TEXTURE, self._steps, self._weak)
        narrowing.flat(self.labels, FLAT, self._smooth)
        chosen = self._guess.chosen
        narrowing.lean_on_half(
            self.labels, (chosen.labels, chosen.offsets, chosen.margins), self.verdict,
            self._weak, self._smooth, CLEAR, self.prior.labels, self.prior.weights)

    def narrow(self, guess, disparities):
        """Let each tile of the full guess search what the half map says."""
        windows = guess.windows
        narrowing.tile_windows(self.labels, disparities, guess.tile, GROW, MARGIN,
                               windows.low, windows.blocks)
        guess.pack()
