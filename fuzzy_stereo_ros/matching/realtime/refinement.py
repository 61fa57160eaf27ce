# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From the best chromosome to disparities: rejected pixels, medians, sub-pixel, confidence.

Not in the paper, whose maps are whole-pixel and dense. Speckles, small components of a map, are
seldom right: they are found as by cv2.filterSpeckles, but by bands that threads share.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import cut_bands, MOST_PARTS, widened
from fuzzy_stereo_ros.matching.kernels.refinement import filling, subpixel
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    check_consistency, find_components, join_components, reject_changed, reject_small)
from fuzzy_stereo_ros.matching.kernels.refinement.square_median import REACH, square_median
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

CLASS_ALIKE = 20     # grey levels within which neighbours belong to a pixel's class


class Speckles:
    """
    The components of a map of one image size: `find` those of each band, `join`, then `reject`.

    labels: whole numbers (R, C); validity: uint8 (R, C); step: neighbours whose labels differ by
    at most this are connected; smallest: pixels of a component that stays; band: one of all bands
    """

    def __init__(self, rows, columns):
        """Allocate for images of a size."""
        self._columns = columns
        self._marks = zeros((MOST_PARTS, 3), np.int64)
        self._runs = zeros((4, rows * columns), np.int32)

    def find(self, labels, validity, step, band):
        """Find the components of a band."""
        index, first, last = band
        find_components(labels, validity, step, self._runs, self._marks[index], first, last)

    def join(self, labels, step, bands):
        """Join the components of all bands where they touch."""
        join_components(labels, step, self._runs, self._marks[:len(bands)],
                        np.array([first for _, first, _ in bands]))

    def reject(self, validity, smallest, band):
        """Reject the pixels of a band that belong to small components."""
        index, first, _ = band
        reject_small(
            validity, smallest, self._runs, first * self._columns, self._marks[index, 2])


def reject_speckles(pool, labels, validity, step, smallest):
    """Reject the small components of a map; labels to smallest: see Speckles."""
    bands = cut_bands(len(labels))
    speckles = Speckles(*labels.shape)
    pool.each(lambda band: speckles.find(labels, validity, step, band), bands)
    speckles.join(labels, step, bands)
    pool.each(lambda band: speckles.reject(validity, smallest, band), bands)


class Refinement:
    """
    The steps of one image size, in order, and their memory.

    validity: uint8 (R, C), which labels of the scanlines are consistent; final_validity: the same
    of the best chromosome
    """

    def __init__(self, possibility, labels_type, by_membership=True):
        """
        Allocate for images of the size of a `CensusPossibility`, and labels of a type.

        by_membership: whether there is a membership median
        """
        rows, columns, disparities = (
            possibility.rows, possibility.columns, possibility.disparities)
        self._by_membership = by_membership
        around = rows + 2 * filling.MEDIAN_RADIUS, columns + 2 * filling.MEDIAN_RADIUS + 2 * LANES
        self._disparities, self._target_range = disparities, possibility.target_range
        self.validity, self.final_validity = (
            zeros((rows, columns), np.uint8) for _ in range(2))
        self._speckles = Speckles(rows, columns)
        self._padded = tuple(zeros(around, labels_type) for _ in range(2))
        self._median = zeros((rows, columns + 2 * LANES), labels_type)
        self._labels = zeros((rows, columns), labels_type)
        fine_type = np.int16 if disparities < 2000 else np.int32
        self._fitted = zeros((rows, columns + 2 * subpixel.RADIUS + LANES), fine_type)
        self._fine = zeros((rows, columns + LANES), fine_type)
        self._certain, self._agreeing = (
            zeros((rows, columns), dtype) for dtype in (np.uint16, np.uint8))
        self._rows = [zeros((2, columns + LANES), fine_type) for _ in range(MOST_PARTS)]

    @property
    def fine_labels(self):
        """The sub-pixel labels of the last frame: (R, C), in 1 / STEPS of a label."""
        return self._fine[:, :self._labels.shape[1]]

    def check(self, chain, chosen, config, after):
        """Write the validity of a `SearchResult`: left-right consistency, and no speckles."""
        labels, step, speckles = chosen.labels, config.speckle_range, self._speckles
        bands = chain.parts(len(labels))

        def check_band(band):
            check_consistency(
                labels, chosen.target, self._target_range, self.validity, *band[1:])
            if config.speckle_size > 1:
                speckles.find(labels, self.validity, step, band)
        checked = chain.each(check_band, bands, after)
        if config.speckle_size <= 1:
            return checked
        chain.each(lambda bands: speckles.join(labels, step, bands), [bands])
        return chain.each(
            lambda band: speckles.reject(self.validity, config.speckle_size, band), bands)

    def smooth(self, pool, labels, chromosome, grey):
        """
        Return the membership median, if any, then a 5 x 5 median, of a chromosome: (R, C) labels.

        labels: (R, C), which `validity` belongs to. Genes that evolution has changed are not
        measured matches: like filled ones they have no confidence.
        """
        bits = max(int(self._disparities - 1).bit_length(), 1)

        def smooth_band(band):
            reject_changed(labels, chromosome, self.validity, self.final_validity, *band[1:])
            found = chromosome
            if self._by_membership:
                found = self._median
                filling.membership_median(chromosome, grey, self._padded, CLASS_ALIKE, bits, found,
                                          *widened(band, REACH, len(labels)))
            square_median(found, self._labels, *band[1:])
        pool.each(smooth_band, pool.parts(len(labels)), after=0)
        return self._labels

    def write(self, pool, labels, chosen, half, reject, config):
        """
        Return the disparity and the confidence of the result.

        pool: a ThreadPool, or the Chain of `smooth`; labels: (R, C), smooth; chosen: the
        `SearchResult`, with sub-pixel offsets and margins; half: the `SmallResult`; reject:
        called with the first row and the one behind the last of some rows, rejects what the pair
        shows nothing of.
        disparity: float32 (R, C), px, NaN = invalid; confidence: float32 (R, C), 0 to 1
        """
        disparity, confidence = (np.empty(labels.shape, np.float32) for _ in range(2))
        margins_of_half = half.chosen.margins, half.prior.weights
        bounds = tuple(map(np.float32, (
            config.min_disparity, config.min_disparity + config.disparities - 1,
            -np.inf if config.fill else config.confidence_threshold)))

        def write_band(band):
            rows = widened(band, subpixel.AROUND // 2, len(labels))
            reject(*rows)
            subpixel.fit(chosen.labels, chosen.offsets, self.final_validity, self._fitted, *rows)
            subpixel.certainty(chosen.sums, chosen.margins, margins_of_half,
                               self.final_validity, self._certain, *rows)
            subpixel.smooth_offsets(labels, self._fitted, *self._rows[band[0]], self._fine,
                                    self._agreeing, *band[1:])
            subpixel.write_out(
                (self._fine, self._agreeing), self.final_validity, self._certain, half.certainty,
                bounds, disparity, confidence, *band[1:])
        # after the band below, too, in whose first rows it rejects pixels
        pool.each(write_band, pool.parts(len(labels)), reach=1)
        return disparity, confidence
