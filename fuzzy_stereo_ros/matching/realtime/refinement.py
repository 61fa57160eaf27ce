# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From the best chromosome to disparities: which pixels to reject, medians, sub-pixel, confidence.

Not in the paper, whose maps are whole-pixel and dense.
"""
from functools import partial

import cv2
from fuzzy_stereo_ros.matching.bands import by_bands
from fuzzy_stereo_ros.matching.kernels.refinement import filling, subpixel
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    check_consistency, reject_changed)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.speckles import Speckles
import numpy as np

ALIKE = 20           # grey levels within which neighbours belong to a pixel's class
AROUND = 9           # side of the square whose mean certainty is a pixel's confidence
LEAST_SURE = 1e-6    # less than one certain pixel around gives; any label is as good
# Share of right pixels by tenths of certainty, from every other Middlebury scene, with noise of 0
# and 1.5 grey levels, cold and after frames; `benchmark accuracy` tells how true it is elsewhere.
RIGHT = 0, 0.4, 0.54, 0.675, 0.81, 0.89, 0.95, 0.993, 0.999, 1, 1    # never bent upwards


class Refinement:
    """
    Memory for one image size, and the steps in order.

    validity: uint8 (R, C), which labels of the scanlines are consistent; settled: the same of the
    genes that evolution has left
    """

    def __init__(self, columns, disparities, labels_type, bands):
        """Allocate for images of so many columns, labels of a type, and bands of all rows."""
        rows = bands[-1][2]
        around = rows + 2 * filling.RADIUS, columns + 2 * filling.RADIUS + 2 * LANES
        self._bands, self._disparities = bands, disparities
        self.validity, self.settled = (np.zeros((rows, columns), np.uint8) for _ in range(2))
        self._speckles = Speckles(columns, bands)
        self._padded, self._padded_grey = (np.zeros(around, labels_type) for _ in range(2))
        self._members = [np.zeros(filling.NEIGHBOURS * LANES, labels_type) for _ in self._bands]
        self._median = np.zeros((rows, columns + 2 * LANES), labels_type)
        self._labels = np.zeros((rows, columns), labels_type)
        fine_type = np.int16 if disparities < 2000 else np.int32
        self._fitted = np.zeros((rows, columns + 2 * subpixel.RADIUS + LANES), fine_type)
        self._fine = np.zeros((rows, columns + LANES), fine_type)
        self._certain, self._blurred = (np.zeros((rows, columns), np.float32) for _ in range(2))
        slopes = np.diff(RIGHT)
        self._lines = np.column_stack(
            (RIGHT[:-1] - np.arange(10) * slopes, 10 * slopes)).astype(np.float32)
        self._rows = [np.zeros((2, columns + LANES), fine_type) for _ in self._bands]

    @property
    def fine(self):
        """The labels of the last frame with their fractions: (R, C), 1 / STEPS of a label."""
        return self._fine[:, :self._labels.shape[1]]

    def check(self, chosen, inside, config, band):
        """Write the validity on the pixels of a band by left-right consistency."""
        check_consistency(chosen.labels, chosen.target, self._disparities, inside, self.validity,
                          band[1], band[2])
        if config.speckle_size > 1:
            self._speckles.find(chosen.labels, self.validity, config.speckle_range, band)

    def without_speckles(self, pool, chosen, config):
        """Return the validity on each pixel, uint8 (R, C), once all bands are checked."""
        if config.speckle_size > 1:
            self._speckles.join(chosen.labels, config.speckle_range)
            pool.each(lambda band: self._speckles.reject(
                self.validity, config.speckle_size, band), self._bands)
        return self.validity

    def smooth(self, pool, labels, chromosome, grey):
        """
        Return the membership median, then a 5 x 5 median, of a chromosome: (R, C) labels.

        labels: (R, C), those that `validity` judges. What evolution took from a plane was not
        measured: like what is filled it has no confidence.
        """
        columns = chromosome.shape[1]
        bits = max(int(self._disparities - 1).bit_length(), 1)

        def settle(band):
            reject_changed(labels, chromosome, self.validity, self.settled, band[1], band[2])
            filling.pad_map(chromosome, columns, self._padded, band[1], band[2])
            filling.pad_map(grey, columns, self._padded_grey, band[1], band[2])
        pool.each(settle, self._bands)
        pool.each(lambda band: filling.membership_median(
            self._padded, self._padded_grey, ALIKE, bits, columns, self._median,
            self._members[band[0]], band[1], band[2]), self._bands)
        by_bands(pool, partial(cv2.medianBlur, ksize=5), 2, self._median[:, :columns],
                 self._labels)
        return self._labels

    def write(self, pool, labels, chosen, reliance, config):
        """
        Return what the user gets.

        labels: (R, C), smooth; chosen: the `Chosen` that has sub-pixel offsets and margins;
        reliance: see WarmStart.reliance.
        disparity: float32 (R, C), px, NaN = invalid; confidence: float32 (R, C), 0 to 1
        """
        disparity, confidence = (np.empty(labels.shape, np.float32) for _ in range(2))

        def fit(band):
            subpixel.fit(chosen.labels, chosen.offsets, self.settled, self._fitted, band[1],
                         band[2])
            subpixel.certainty(chosen.sums, chosen.margins, *reliance, self.settled,
                               self._certain, band[1], band[2])

        def write_out(band):
            subpixel.smooth_offsets(labels, self._fitted, *self._rows[band[0]], self._fine,
                                    band[1], band[2])
            subpixel.write_out(
                self._fine, self.settled, self._blurred, np.float32(LEAST_SURE), self._lines,
                config.min_disparity, config.disparities, config.fill,
                np.float32(config.confidence_threshold), disparity, confidence, band[1], band[2])
        pool.each(fit, self._bands)
        by_bands(pool, partial(cv2.blur, ksize=(AROUND, AROUND)), AROUND // 2, self._certain,
                 self._blurred)
        pool.each(write_out, self._bands)
        return disparity, confidence
