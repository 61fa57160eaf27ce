# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Both images at full and at half size, with their features and the noise of the pair.

Not in the paper, whose memberships have a fixed width.
"""
from itertools import pairwise

from fuzzy_stereo_ros.matching.bands import widened
from fuzzy_stereo_ros.matching.out_of_range import EXTRA_LABELS
from fuzzy_stereo_ros.matching.over_frames.pictures import (
    luminance_shift, NoiseEstimate)
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, CensusPossibility, COARSE_SIZE, extra_columns, FULL_SIZE, HALF_SIZE, JPEG_SIZE,
    SMALLEST)
from fuzzy_stereo_ros.matching.realtime.smoothing import Smoothing
import numpy as np

SPREAD = 8.0         # largest difference from the 3 x 3 mean that counts as noise, times the noise
PART = 32            # rows of which parts of the images are multiples
DENOISE_ROWS, CENSUS_ROWS = 1, 2  # rows around a row that denoising and census read
UNSEEN = 0.3         # grey levels of noise that are ignored
LOUDEST = 8.0        # grey levels; no camera has more noise
COMPRESSED = 0.5     # grey levels of noise that JPEG counts as in the census
FEW_LABELS = 32      # at half size, whose margin is searched, too
MOST_LABELS = 48     # that are all searched, at the smallest size
LEAST_SIDE = 64      # rows and columns of images smaller than half the size


def half_disparities(disparities):
    """
    Return how many labels are searched at half size.

    Of many the margin beyond the range is left out: a tile whose half map reaches the last label
    is still searched up to the end of the margin.
    """
    labels = -(-disparities // 2)
    return max(labels - EXTRA_LABELS // 2, min(labels, FEW_LABELS))


def small_sizes(rows, columns, disparities):
    """Return by what the sides of smaller sizes are divided, and their labels: [(int, int)]."""
    sizes = [(2, half_disparities(disparities))]
    while (sizes[-1][1] > MOST_LABELS and sizes[-1][0] < SMALLEST
           and min(rows, columns) >= 2 * sizes[-1][0] * LEAST_SIDE):
        scale, labels = sizes[-1]
        sizes.append((2 * scale, -(-labels // 2)))
    return sizes


class Views:
    """
    Both views of a pair at full and smaller sizes, in memory for one image size.

    full: a `CensusPossibility`; small: one of half the size, and while that has more than
    MOST_LABELS, of half of that; half: the first of these; noise: grey levels, standard deviation,
    0 where there is none; noises: a `NoiseEstimate` of each view as it was read; left_shift: of
    the luminance, see luminance_shift
    """

    def __init__(self, config, rows, columns):
        """Allocate for images of a size."""
        extra = extra_columns(config.min_disparity, config.disparities)
        existing = config.min_disparity, config.min_disparity + columns - 1
        self.full = CensusPossibility(
            rows, columns, config.disparities, FULL_SIZE, existing, extra)
        self.small = [CensusPossibility(
            rows // scale, columns // scale, labels, HALF_SIZE,
            tuple(end // scale for end in existing), extra // scale)
            for scale, labels in small_sizes(rows, columns, config.disparities)]
        self.half = self.small[0]
        self._shift = config.min_disparity
        # The right image as it is read and averaged.
        self._right = CensusPicture(rows, columns, True, 0) if extra else self.full.right
        self.noise, self.noises = 0.0, [NoiseEstimate(rows, columns) for _ in range(2)]
        self._smoothing = Smoothing(rows, columns)

    def read(self, pool, left, right, previous=None):
        """
        Read a pair, and estimate its noise.

        The right image is moved by the smallest disparity: to the right while it is read, to the
        left into a wider view, so that no column is lost.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); previous: the FrameState of the previous
        frame, or None
        """
        full, shift = self.full, self._shift
        left_shift = self.left_shift = luminance_shift(
            left, right, previous and previous.left_shift)
        unit = (1 if left.ndim == 2 else 4) << left_shift if left.dtype == np.uint8 else 0

        def read(band):
            _, first, last = band
            full.left.read(left, 0, left_shift, first, last)
            self._right.read(right, max(shift, 0), left_shift, first, last)
            for view, noise in zip(self.pictures, self.noises):
                noise.measure(view, first, last)
            self._smoothing.measure(self.pictures, unit, band)

        def estimate(noises):
            for noise in noises:
                noise.estimate()
            self.noise = noises[0].level
        pool.each(read, pool.parts(full.rows, PART))
        pool.each(estimate, [self.noises])

    @property
    def pictures(self):
        """The left and the right view as they were read, which averaging and smoothing change."""
        return self.full.left, self._right

    def smooth(self, pool):
        """Smooth the pair where JPEG or a blurred lens needs it, and match it as JPEG needs it."""
        self.full.left.edges = self.full.left.grey
        found = self._smoothing
        found.smooth(pool, self.pictures, pool.parts(self.full.rows, PART))
        self.full.use(COARSE_SIZE if found.coarse else JPEG_SIZE if found.compressed
                      else FULL_SIZE)

    def describe(self, pool):
        """Write the features of the pair."""
        sizes, full, shift = (self.full, *self.small), self.full, self._shift
        reach = (DENOISE_ROWS + CENSUS_ROWS) << len(self.small)     # of rows at full size

        def describe_band(band):
            noise = min(self.noise, LOUDEST)
            least = COMPRESSED if self._smoothing.compressed else 0.0
            tolerance = max(0.0, SPREAD * (max(noise, least) - UNSEEN))
            if shift < 0:
                full.right.spread(self._right, -shift, *widened(band, reach, full.rows))
            bands = [(band[0], band[1] >> level, band[2] >> level) for level in range(len(sizes))]
            for level, (larger, views) in enumerate(pairwise(sizes), 1):
                rows = widened(bands[level], reach >> level, views.rows)
                larger.left.halve(views.left, *rows)
                larger.right.halve(views.right, *rows)
            for level, (views, rows) in enumerate(zip(sizes, bands)):
                views.describe(*rows[1:], noise / 2**level, int((256 >> level) * tolerance))
        return pool.each(describe_band, pool.parts(full.rows, PART))
