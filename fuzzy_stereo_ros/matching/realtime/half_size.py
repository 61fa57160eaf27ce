# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The chromosomes at smaller sizes, each a parent of the one at twice its size.

Not in the paper. The one at half size is searched for each pair without the previous frame, so
that it shows where the previous best is outdated; where texture is weak it is a prior as well. Few
labels are all searched there; of many, those that the chromosome at a quarter of the size has.
"""
from math import hypot
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import widened
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.refinement import filling
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import check_consistency
from fuzzy_stereo_ros.matching.kernels.refinement.square_median import square_median
from fuzzy_stereo_ros.matching.kernels.scanlines import half_size_prior
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import SearchResult
from fuzzy_stereo_ros.matching.kernels.units import SURE
from fuzzy_stereo_ros.matching.realtime.generation import AllLabels, gene_type, InheritedGenes
from fuzzy_stereo_ros.matching.realtime.refinement import Speckles
import numpy as np

GROW = 24               # px around a tile whose genes of half the size it inherits
SPECKLE = 20            # pixels; smaller components of the map are rejected
WEAK_TEXTURE = 72       # sum of 18 grey steps below which texture is weak: 4 on average
NOISY_STEPS = 28        # by how much noise of a grey level raises that; its steps sum to 20
FLAT = 1                # largest range of labels in 3 x 3 pixels of the prior


class SmallResult(NamedTuple):
    """
    The chromosome of a smaller size.

    labels: uint8 or uint16 (r, c), dense; validity: uint8, which are consistent; chosen: the
    `SearchResult` before inconsistent labels were filled, whose margins are evidence; disparities:
    number of labels searched; prior: at half size the `Prior` of the full search where texture is
    weak; certainty: at half size uint8 (R, C), of the map that plain regions have, in 1 / 255, 255
    elsewhere
    """

    labels: np.ndarray
    validity: np.ndarray
    chosen: SearchResult
    disparities: int
    prior: Prior | None = None
    certainty: np.ndarray | None = None


class SmallSize:
    """The search of one of the smaller sizes and its memory."""

    def __init__(self, possibilities, squares):
        """possibilities: a `CensusPossibility` of this and smaller sizes; squares: `Squares`."""
        own, *smaller = possibilities
        self._smaller = SmallSize(smaller, squares) if smaller else None
        self._selection = (InheritedGenes(own, squares, grow=GROW) if smaller
                           else AllLabels(own, squares))
        self._target_range, shape = own.target_range, (own.rows, own.columns)
        validity = zeros(shape, np.uint8)
        labels, self._filled = (zeros(shape, gene_type(own.disparities)) for _ in range(2))
        self._speckles = Speckles(*shape)
        self.result = SmallResult(labels, validity, self._selection.chosen, own.disparities)

    def search(self, chain, after=None):
        """Search the labels of the pair that the possibilities were filled with."""
        if self._smaller is None:
            return self._selection.select(chain, after)
        self._smaller.finish(chain, self._smaller.search(chain, after))
        return self._selection.select(chain, self._smaller.result)

    def finish(self, chain, after, fill=lambda band: None, smooth=lambda band: None):
        """
        Complete the `result` of a search; return the mark.

        fill, smooth: called with each band once it is filled, and once it is smoothed
        """
        (labels, validity, chosen), rows = self.result[:3], len(self._filled)

        def check(band):
            check_consistency(
                chosen.labels, chosen.target, self._target_range, validity, band[1], band[2])
            self._speckles.find(chosen.labels, validity, 1, band)

        def fill_band(band):
            filling.fill_rows(chosen.labels, validity, self._filled, band[1], band[2])
            fill(band)

        def smooth_band(band):
            square_median(self._filled, labels, *widened(band, 1, rows))
            smooth(band)
        bands = chain.parts(rows)
        chain.each(check, bands, after)
        chain.each(lambda step: self._speckles.join(chosen.labels, step, bands), [1])
        chain.each(lambda band: self._speckles.reject(validity, SPECKLE, band), bands)
        chain.each(fill_band, bands)
        return chain.each(smooth_band, bands, reach=1)


class HalfSize(SmallSize):
    """
    The search at half size: its chromosome is a prior, too.

    weak: uint8 (R / 2, C / 2), where texture is weak, after a search
    """

    def __init__(self, possibilities, squares, rows, columns, disparities):
        """
        Allocate for full images of a size and a number of disparities.

        possibilities: the `CensusPossibility` of half-size images, and of each smaller size;
        squares: `Squares`
        """
        super().__init__(possibilities, squares)
        self.weak, self._smooth = (zeros(self._filled.shape, np.uint8) for _ in range(2))
        self._steps = zeros(self._filled.shape, np.uint16)
        certainty = zeros((rows, columns), np.uint8)
        certainty[:] = SURE
        self.result = self.result._replace(certainty=certainty, prior=Prior(
            zeros((rows, columns), gene_type(disparities)), zeros((rows, columns), np.uint8)))

    def complete(self, chain, views, after=None):
        """Complete the `result` of a search of `Views`, whose noise is no texture; as `finish`."""
        labels, validity, chosen, _, prior, certainty = self.result

        def measure(band):
            half_size_prior.texture_steps(views.full.left.grey, self._steps, *band[1:])

        def write_limits(band):
            _, first, last = band
            limit = int(hypot(WEAK_TEXTURE, NOISY_STEPS * views.noise))
            certainty[2 * first:2 * last] = SURE
            half_size_prior.weak_texture(self._steps, limit, self.weak, first, last)
            half_size_prior.flat(labels, FLAT, self._smooth, first, last)
            half_size_prior.half_prior(
                labels, (chosen.labels, chosen.offsets, chosen.margins, validity),
                self.weak, self._smooth, tuple(prior), first, last)
        return self.finish(chain, after, measure, write_limits)
