# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From chosen labels to a dense map in parts of a pixel, and to its smooth surface.

Not in the paper, whose maps are whole-pixel.
"""
import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.refinement import consistency, dense_map, filling
import numpy as np

MEDIAN_RADIUS, MEDIAN_COLOUR, MEDIAN_DISTANCE = 9, 20.0, 9.0     # px, grey levels, px
PLANE_COLOUR = 15.0      # grey levels, summed over channels, at which a neighbour counts 1 / e
GROWTH = 0.25            # by so much of itself the limit of a plane's pixels grows a px away


class DenseSurface:
    """Memory for one image size."""

    def __init__(self, rows, columns, disparities):
        """Allocate for images of a size and a number of disparities."""
        self._bands, self._disparities = cut_bands(rows), disparities
        self.validity = np.zeros((rows, columns), np.uint8)
        self.fitted, self._filled, self._median, self._smooth = (
            np.zeros((rows, columns), np.float32) for _ in range(4))
        self._histograms = [np.zeros(dense_map.BINS * disparities + 1, np.float32)
                            for _ in self._bands]
        steps = np.arange(3 * 256)
        self._median_colour, self._plane_colour = (
            np.exp(-steps / scale).astype(np.float32) for scale in (MEDIAN_COLOUR, PLANE_COLOUR))
        distance = np.arange(-MEDIAN_RADIUS, MEDIAN_RADIUS + 1)
        self._median_distance = np.exp(
            -distance**2 / (2 * MEDIAN_DISTANCE**2)).astype(np.float32)

    def check(self, pool, labels, target, inside):
        """
        Give the validity on labels: int16 (R, C), as the target's pixels chose.

        inside: the first and the last column of the (moved) target that exist
        """
        pool.each(lambda band: consistency.check_consistency(
            labels, target, self._disparities, inside, self.validity, band[1], band[2]),
            self._bands)

    def fill(self, pool, labels, offsets, colour, result):
        """
        Write a dense map: rejected pixels get the background's disparity, then a median.

        labels: int16, offsets: float32, colour: uint8 (R, C, 3); result: float32 (R, C), px
        """
        np.add(labels, offsets, out=self.fitted)
        np.clip(self.fitted, 0, self._disparities - 1, out=self.fitted)
        rejected = (self.validity == consistency.INVALID).astype(np.uint8)
        pool.each(lambda band: filling.fill_rows(
            self.fitted, self.validity, self._filled, band[1], band[2]), self._bands)
        pool.each(lambda band: dense_map.weighted_median(
            self._filled, rejected, colour, MEDIAN_RADIUS, self._median_colour,
            self._median_distance, self._histograms[band[0]], self._median, band[1], band[2]),
            self._bands)
        cv2.medianBlur(self._median, 5, dst=result)

    def smooth(self, pool, surface, colour, radius, limit):
        """Return the map of local planes, float32 (R, C), memory that the next call reuses."""
        pool.each(lambda band: dense_map.local_planes(
            surface, colour, radius, self._plane_colour, np.float32(limit), np.float32(GROWTH),
            self._smooth, band[1], band[2]), self._bands)
        return np.clip(self._smooth, 0, self._disparities - 1, out=self._smooth)
