# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An estimate of the noise of a picture.

Not in the paper. Noise is estimated from second differences at full and at half size, in the
plainest tiles: the mean of 2 x 2 pixels halves white noise, while the second differences of
texture grow at the coarser size.
"""
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import roughness, TILE
import numpy as np

PLAINEST = 0.1       # share of the tiles, those of least second differences, that show noise
_SECOND = 1.954      # mean size of second differences of white noise of 1
_LOST = 0.75         # share of the variance of noise that halving a picture removes


class NoiseEstimate:
    """An estimate of the noise of pictures of one size."""

    def __init__(self, rows, columns):
        """Allocate for full images of a size."""
        self._rough = [np.zeros((-(-height // TILE), -(-width // TILE)), np.float32)
                       for height, width in ((rows, columns), (rows // 2, columns // 2))]

    def measure(self, full, half, first, last):
        """
        Measure some rows of a picture; full, half: `CensusPicture`s of it.

        first, last: rows of the full image, from a multiple of 2 TILE on
        """
        for view, rough, size in zip((full, half), self._rough, (TILE, 2 * TILE)):
            roughness(view.luminance, view.columns, rough, first // size,
                      min(-(-last // size), len(rough)))

    @property
    def level(self):
        """The noise of the picture, all of whose rows are measured: grey levels, deviation."""
        full, half = map(_plainest, self._rough)
        return max((full**2 - half**2) / _LOST, 0.0)**0.5


def _plainest(rough):
    """Return the noise of a view by its plainest tiles, in grey levels, as if without texture."""
    place = int(PLAINEST * (rough.size - 1))
    return float(np.partition(rough.reshape(-1), place)[place]) / _SECOND
