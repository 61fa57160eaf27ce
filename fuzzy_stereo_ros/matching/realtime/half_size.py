# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The chromosome at half size, a parent of the one at full size.

Not in the paper. It is searched for each pair among all labels, without the previous frame, so
that it shows where the previous best is outdated; where texture is weak it is a prior as well.
"""
from math import hypot
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import widened
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior, weight_of
from fuzzy_stereo_ros.matching.kernels.refinement import filling
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import check_consistency
from fuzzy_stereo_ros.matching.kernels.refinement.square_median import square_median
from fuzzy_stereo_ros.matching.kernels.scanlines import half_size_prior
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import SearchResult
from fuzzy_stereo_ros.matching.realtime.refinement import Speckles
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type, Scanlines
import numpy as np

TILE = 64               # side of the tiles that are searched at a time
SPECKLE = 20            # half-size pixels; smaller components of the half map are rejected
WEAK = weight_of(1, 2)  # of the prior where texture is weak: the largest cost is reached at 3 px
WEAK_TEXTURE = 72       # sum of 18 grey steps below which texture is weak: 4 on average
NOISY_STEPS = 28        # by how much noise of a grey level raises that; its steps sum to 20
CLEAR = 4               # least margin, in summed cost, of a label of the prior
SURE = 255              # what is not limited by the evidence of a plain region
FLAT = 1                # largest range of labels in 3 x 3 pixels of the prior


class HalfSizeResult(NamedTuple):
    """
    The half-size chromosome.

    labels: uint8 or uint16 (R / 2, C / 2), dense; validity: uint8, which are consistent; chosen:
    the `SearchResult` before inconsistent labels were filled, whose margins are evidence; prior:
    the `Prior` of the full search where texture is weak; certainty: uint8 (R, C), of the map that
    plain regions have, in 1 / 255, 255 elsewhere
    """

    labels: np.ndarray
    validity: np.ndarray
    chosen: SearchResult
    prior: Prior
    certainty: np.ndarray


class HalfSize:
    """
    The half-size search of one image size and its memory.

    weak: uint8 (R / 2, C / 2), where texture is weak, after a search
    """

    def __init__(self, possibility, rows, columns, disparities):
        """
        Allocate for full images of a size and a number of disparities.

        possibility: the `CensusPossibility` of half-size images
        """
        self._half_disparities = possibility.disparities
        self._target_range = possibility.target_range
        self._scanlines = Scanlines(possibility, TILE)
        shape = possibility.rows, possibility.columns
        labels_type = self._scanlines.chosen.labels.dtype
        self._validity, self.weak, self._smooth = (zeros(shape, np.uint8) for _ in range(3))
        self._labels, self._filled = (zeros(shape, labels_type) for _ in range(2))
        self._certainty = zeros((rows, columns), np.uint8)
        self._certainty[:] = SURE
        self._speckles = Speckles(*shape)
        self._steps = zeros(shape, np.uint16)
        self._prior = Prior(zeros((rows, columns), gene_type(disparities)),
                            zeros((rows, columns), np.uint8))

    def search(self, pool, after=None):
        """
        Search the labels of the pair that the possibility was filled with.

        pool: a ThreadPool, or a Chain, whose mark of this stage is returned; after: a stage of it
        """
        return self._scanlines.search(pool, after)

    def complete(self, pool, grey, noise, after=None):
        """
        Return the `HalfSizeResult` of a search.

        pool: a ThreadPool, or a Chain, which completes the result; grey: uint8, full left; noise:
        of it, grey levels, standard deviation, which is no texture; after: the stage of the search
        """
        limit = int(hypot(WEAK_TEXTURE, NOISY_STEPS * noise))
        chosen, rows, prior = self._scanlines.chosen, len(self._labels), self._prior

        def finish(band):
            check_consistency(chosen.labels, chosen.target, self._half_disparities,
                              self._target_range, self._validity, band[1], band[2])
            self._speckles.find(chosen.labels, self._validity, 1, band)

        def fill(band):
            filling.fill_rows(chosen.labels, self._validity, self._filled, band[1], band[2])
            half_size_prior.texture_steps(grey, self._steps, band[1], band[2])

        def write_limits(band):
            _, first, last = band
            self._certainty[2 * first:2 * last] = SURE
            square_median(self._filled, self._labels, *widened(band, 1, rows))
            half_size_prior.weak_texture(self._steps, limit, self.weak, first, last)
            half_size_prior.flat(self._labels, FLAT, self._smooth, first, last)
            half_size_prior.half_prior(
                self._labels, (chosen.labels, chosen.offsets, chosen.margins, self._validity),
                self.weak, self._smooth, CLEAR, WEAK, tuple(prior), first, last)
        bands = pool.parts(rows)
        pool.each(finish, bands, after)
        pool.each(lambda step: self._speckles.join(chosen.labels, step, bands), [1])
        pool.each(lambda band: self._speckles.reject(self._validity, SPECKLE, band), bands)
        pool.each(fill, bands)
        pool.each(write_limits, bands, reach=1)
        return HalfSizeResult(self._labels, self._validity, chosen, prior, self._certainty)
