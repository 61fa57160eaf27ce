# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How much noise a picture has, from itself: what bends half as much in the half-size picture.

Not in the paper, whose memberships have a width of their own. White noise halves where 2 x 2
pixels are averaged; texture does not, and bends more from pixel to pixel the coarser it is seen.
"""
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import roughness, TILE
import numpy as np

QUIETEST = 0.1       # share of the tiles, those that bend least, in which noise is looked for
_BENDS = 1.954       # mean size of second differences of white noise of 1
_LOSES = 0.75        # share of the square of noise that the half-size picture has lost


class NoiseEstimate:
    """The estimate for one image size and its memory."""

    def __init__(self, rows, columns):
        """Allocate for full images of a size."""
        self._rough = [np.zeros((-(-height // TILE), -(-width // TILE)), np.float32)
                       for height, width in ((rows, columns), (rows // 2, columns // 2))]

    def measure(self, full, half, first, last):
        """
        Measure some rows of a picture; full, half: `View`s of it.

        first, last: rows of the full image, from a multiple of 2 TILE on
        """
        for view, rough, size in zip((full, half), self._rough, (TILE, 2 * TILE)):
            roughness(view.fine, view.columns, rough, first // size,
                      min(-(-last // size), len(rough)))

    @property
    def level(self):
        """The noise of the rows measured, all of a picture: grey levels, standard deviation."""
        fine, coarse = map(_plainest, self._rough)
        return max((fine**2 - coarse**2) / _LOSES, 0.0)**0.5


def _plainest(rough):
    """Return how much the plainest tiles of a view bend: grey levels of white noise."""
    place = int(QUIETEST * (rough.size - 1))
    return float(np.partition(rough.reshape(-1), place)[place]) / _BENDS
