# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Smooths views where JPEG or an unsharp lens is detected, which make the two views differ.

Not in the paper, whose pictures are of a laboratory. JPEG leaves steps between blocks and ripples
inside them, which differ between the views: both are smoothed. Where one lens is less sharp, the
census of the other view compares details that this one lacks: the sharper view is smoothed. Where
that is not enough, the other one is sharpened.
"""
from functools import partial
from math import sqrt

from fuzzy_stereo_ros.matching.bands import MOST_PARTS
from fuzzy_stereo_ros.matching.kernels.possibility import sharpness as kernels
import numpy as np

BLOCKS, BLOCK_STEP = 600, 4  # blocks measured in a picture, about; of so many, at most one
JPEG_DEVIATIONS = 3.5   # by which small coefficients must be too few to detect JPEG
FEW = 0.5            # share of the coefficients of other blocks below which they are too few
BLURRED = 0.85       # share of the other view's sharpness below which a view is blurred
UNSHARP = 0.35       # sharpness below which it is less sharp than what is smoothed
MEAN, SHARPENED = 1, -3     # shares of the way to the means: see kernels.smooth


class Smoothing:
    """
    Decides whether the views of a pair are smoothed or sharpened, and does it.

    compressed, coarse: whether the left view was compressed by JPEG, of quality 80 or less, and of
    70 or less
    """

    def __init__(self, rows, columns):
        """Allocate for images of a size."""
        self._apart = max(rows * columns // (BLOCKS * kernels.JPEG_BLOCK**2), BLOCK_STEP)
        # the first block of a picture, and of its mirror image: only one of the two can be of JPEG
        self._begins = 0, columns % kernels.JPEG_BLOCK or kernels.JPEG_BLOCK // 2
        self._counts = np.zeros((MOST_PARTS, len(self._begins), 3), np.int64)
        self._steps = np.zeros((MOST_PARTS, 2, 2), np.int64)
        self.compressed = self.coarse = False

    def measure(self, views, unit, band):
        """
        Measure a band of rows of both views.

        unit: of luminance in a grey level, 0 where pictures have other steps than JPEG
        """
        index, first, last = band
        self._counts[index], self._steps[index] = 0, 0
        left = views[0]
        if unit:
            for begin, counts in zip(self._begins, self._counts[index]):
                kernels.count_coefficients(
                    left.luminance, begin, left.columns, self._apart, unit, counts, first, last)
        for view, sums in zip(views, self._steps[index]):
            kernels.add_steps(view.luminance, view.columns, sums, first, last)

    def smooth(self, pool, views, bands):
        """Smooth the views that need it, once all bands are measured."""
        (small_from, small_to), (large_from, large_to) = kernels.SMALL, kernels.LARGE
        small, large, middle = self._counts[:len(bands)].sum(axis=0).T.tolist()
        # Number expected if all sizes are equally frequent: any other picture has more. After
        # coarse quantisation few are large either: then half of those of the other grid of blocks.
        expected = [max(number * (small_to - small_from) / (large_to - large_from), FEW * other)
                    for number, other in zip(large, small[::-1])]
        self.compressed = _too_few(small, expected)
        self.coarse = self.compressed and _too_few(
            middle, [FEW * other for other in middle[::-1]])
        steps, smoothed = self._steps[:len(bands)].sum(axis=0).tolist(), []
        for view, (near, far), (other_near, other_far) in zip(views, steps, steps[::-1]):
            sharpness, other = near * other_far, other_near * far
            if self.compressed or other < BLURRED * sharpness:
                smoothed.append((view, MEAN))
            elif sharpness < BLURRED * other and near < UNSHARP * far:
                smoothed.append((view, SHARPENED))
        for view, share in smoothed:
            pool.each(partial(view.smooth, share), bands)
        for view, _ in smoothed:
            view.take_smoothed()


def _too_few(counts, expected):
    """Return whether the counts of a grid of blocks are surely below those expected."""
    return any(wanted - count > JPEG_DEVIATIONS * sqrt(wanted)
               for count, wanted in zip(counts, expected))
