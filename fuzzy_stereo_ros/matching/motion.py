# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How the picture moved since the previous frame: one shift for all of it, by phase correlation.

Not in the paper. A camera that turns moves everything alike; whether a part of the picture moved
with the rest, stayed, or is another one now is judged tile by tile.
"""
import cv2
import numpy as np

REDUCTION = 4        # the glance that frames are compared by is so much smaller, or a bit more
SMALLEST = 16        # rows and columns of a glance that phase correlation can work with


class Motion:
    """Compares the pictures of two frames of one image size, by glances at them."""

    def __init__(self, rows, columns):
        """Prepare for images of a size; those too small for a glance count as never moving."""
        self._rows, self._columns = rows, columns
        self._size = _even_size(columns // REDUCTION), _even_size(rows // REDUCTION)
        self._usable = min(self._size) >= SMALLEST
        if self._usable:
            self._window = cv2.createHanningWindow(self._size, cv2.CV_32F)

    def glance(self, grey):
        """Return a small float32 picture of an image, uint8 (R, C + slack)."""
        if not self._usable:
            return np.zeros((0, 0), np.float32)
        return cv2.resize(grey[:, :self._columns], self._size,
                          interpolation=cv2.INTER_AREA).astype(np.float32)

    def between(self, before, now):
        """Return how far the picture moved down and to the right, in whole pixels."""
        if not self._usable:
            return 0, 0
        # the window is applied here: OpenCV would apply it to the arrays themselves
        (right, down), _ = cv2.phaseCorrelate(before * self._window, now * self._window)
        across, along = self._scale()
        return round(down * along), round(right * across)

    def change(self, before, now, down, right, tiles):
        """
        Return by how many grey levels each tile became brighter or darker than all did.

        before, now: glances; down, right: px that the picture is taken to have moved; tiles:
        (rows, columns) of the result, float32.
        """
        if not self._usable:
            return np.zeros(tiles, np.float32)
        across, along = self._scale()
        shift = np.float32([[1, 0, right / across], [0, 1, down / along]])
        moved = cv2.warpAffine(before, shift, self._size, borderMode=cv2.BORDER_REPLICATE)
        change = cv2.resize(now - moved, tiles[::-1], interpolation=cv2.INTER_AREA)
        return np.abs(change - np.median(change))

    def _scale(self):
        return self._columns / self._size[0], self._rows / self._size[1]


def _even_size(size):
    """Return the largest even size, not above, that needs no padding; others are biased."""
    while size >= SMALLEST and (size % 2 or cv2.getOptimalDFTSize(size) != size):
        size -= 1
    return size
