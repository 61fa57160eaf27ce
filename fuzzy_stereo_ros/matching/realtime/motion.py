# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How the picture moved since the previous frame: one shift for all of it, by phase correlation.

Not in the paper. A camera that turns moves everything alike; whether a part of the picture moved
with the rest, stayed, or is another one now is judged tile by tile.
"""
import cv2
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.motion import best_shift, thumbnail
import numpy as np

GLANCE = 60          # rows of the small pictures that are correlated, about, and at the least
SMALLEST = 16        # rows and columns of a thumbnail that phase correlation can work with
REACH = 2            # px by which the correlation may be wrong
SAMPLED = 16         # one row in so many shows which shift is exact


class Motion:
    """Compares the pictures of two frames of one image size."""

    def __init__(self, rows, columns):
        """Prepare for images of a size; those too small for a thumbnail count as never moving."""
        self._scale = max(min(rows, columns) // GLANCE, 1)
        size = [_even_size(pixels // self._scale) for pixels in (rows, columns)]
        self._usable = min(size) >= SMALLEST
        self._before, self._now = (np.zeros(size, np.float32) for _ in range(2))
        self._window = cv2.createHanningWindow(size[::-1], cv2.CV_32F) if self._usable else None

    def between(self, before, now):
        """
        Return how far the picture moved down and to the right, in whole pixels.

        before: uint16 (R, C), fine grey; now: uint16, the same, padded.
        """
        if not self._usable:
            return 0, 0
        thumbnail(before, 0, self._scale, self._before)
        thumbnail(now, MARGIN, self._scale, self._now)
        # the window is applied here: OpenCV would apply it to the arrays themselves
        (right, down), _ = cv2.phaseCorrelate(self._before * self._window,
                                              self._now * self._window)
        return best_shift(now, before, round(down * self._scale),
                          round(right * self._scale), REACH, SAMPLED)


def _even_size(size):
    """Return the largest even size, not above, that needs no padding; others are biased."""
    while size >= SMALLEST and (size % 2 or cv2.getOptimalDFTSize(size) != size):
        size -= 1
    return size
