# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Both images as they are compared, at full and at half size, and how much noise they have.

Not in the paper, whose memberships have a width of their own. Noise is what bends half as much in
the half-size picture: white noise halves where 2 x 2 pixels are averaged; texture does not, and
bends more from pixel to pixel the coarser it is seen.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import roughness, TILE
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPossibility, extra_columns, fine_places, FULL_SIZE, HALF_SIZE, View)
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


SPREAD = 8.0     # times the noise, that by which a pixel may differ from those around it
UNSEEN = 0.3     # grey levels of noise that are not heeded
LOUDEST = 8.0    # grey levels; what seems louder than that is no camera's noise


class Views:
    """
    The possibilities of one image size, read from one pair after the other.

    full, half: a `CensusPossibility` each; inside: the first and last column of the target that
    exist; noise: grey levels, standard deviation, 0 where none is found
    """

    def __init__(self, config, rows, columns, tile, noise):
        """
        Allocate for images of a size.

        tile: rows that the bands of an image, full or half, are multiples of; noise: called with
        rows and columns, returns what estimates noise, see NoiseEstimate
        """
        extra = extra_columns(config.min_disparity, config.disparities)
        self.full = CensusPossibility(rows, columns, config.disparities, FULL_SIZE, extra)
        self.half = CensusPossibility(
            rows // 2, columns // 2, -(-config.disparities // 2), HALF_SIZE, extra // 2)
        self.inside = config.min_disparity, config.min_disparity + columns - 1
        self._shift = config.min_disparity
        # The right image as it is read and averaged.
        self._right = View(rows, columns, True, 0) if extra else self.full.right
        self._estimate = noise(rows, columns)
        self.noise = 0.0
        self._bands = cut_bands(rows, tile)

    def read(self, pool, left, right, average, describe):
        """
        Read a pair.

        The right image is moved by the smallest disparity: to the right as it is read, to the left
        into a wider view, so that none of it is lost.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); average: called with the left and the
        right view once they are read, returns the share of noise that it leaves; describe: called
        with a view and a range of rows, writes what its matches are judged by
        """
        full, half, shift = self.full, self.half, self._shift
        places = fine_places(left, right)

        def read(band):
            _, first, last = band
            full.left.read(left, 0, places, first, last)
            self._right.read(right, max(shift, 0), places, first, last)
            full.left.halve(half.left, first // 2, last // 2)
            self._estimate.measure(full.left, half.left, first, last)

        def halve(band):
            _, first, last = band
            full.left.halve(half.left, first // 2, last // 2)
            full.right.halve(half.right, first // 2, last // 2)
            full.calm(int(256 * tolerance), first, last)

        def describe_full(band):
            _, first, last = band
            full.describe(describe, first, last)
            half.calm(int(128 * tolerance), first // 2, last // 2)

        pool.each(read, self._bands)
        # of this pair alone: what averaging has left hides behind texture
        self.noise = self._estimate.level
        self.noise *= average(full.left, self._right)
        tolerance = max(0.0, SPREAD * (min(self.noise, LOUDEST) - UNSEEN))
        if shift < 0:
            pool.each(lambda band: full.right.spread(
                self._right, -shift, band[1], band[2]), self._bands)
        pool.each(halve, self._bands)
        pool.each(describe_full, self._bands)
        pool.each(lambda band: half.describe(describe, band[1] // 2, band[2] // 2), self._bands)
