# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How much noise a picture has, from itself: what bends half as much in the half-size picture.

Not in the paper, whose memberships have a width of their own. White noise halves where 2 x 2
pixels are averaged; texture does not, and bends more from pixel to pixel the coarser it is seen.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.temporal.sameness import roughness, TILE
import numpy as np

QUIETEST = 0.1       # share of the tiles, those that bend least, in which noise is looked for
_BENDS = 1.954       # mean size of second differences of white noise of 1
_LOSES = 0.75        # share of the square of noise that the half-size picture has lost


class NoiseEstimate:
    """The estimate for one image size and its memory."""

    def __init__(self, rows, columns):
        """Allocate for full images of a size."""
        self._rough, self._bands = [], []
        for height, width in ((rows, columns), (rows // 2, columns // 2)):
            self._rough.append(np.zeros((-(-height // TILE), -(-width // TILE)), np.float32))
            self._bands.append([(index, -(-first // TILE), -(-last // TILE))
                                for index, first, last in cut_bands(height)])

    def of(self, crew, full, half):
        """Return the noise in grey levels, a standard deviation; full, half: `View`s of a size."""
        fine, coarse = (_bend(crew, *seen) for seen in zip((full, half), self._rough, self._bands))
        return max((fine**2 - coarse**2) / _LOSES, 0.0)**0.5


def _bend(crew, view, rough, bands):
    """Return how much the plainest tiles of a view bend: grey levels of white noise."""
    crew.each(lambda band: roughness(view.fine, view.columns, rough, band[1], band[2]), bands)
    place = int(QUIETEST * (rough.size - 1))
    return float(np.partition(rough.reshape(-1), place)[place]) / _BENDS
