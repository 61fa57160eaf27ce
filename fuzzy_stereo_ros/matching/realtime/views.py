# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Both images as they are compared, at full and at half size, averaged with those before."""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPossibility, extra_columns, fine_places, FULL_SIZE, HALF_SIZE, View)


class Views:
    """
    The possibilities of one image size, read from one pair after the other.

    full, half: a `CensusPossibility` each; inside: the first and last column of the target that
    exist
    """

    def __init__(self, config, rows, columns, tile):
        """tile: rows that the bands of an image, full or half, are multiples of."""
        extra = extra_columns(config.min_disparity, config.disparities)
        self.full = CensusPossibility(rows, columns, config.disparities, FULL_SIZE, extra)
        self.half = CensusPossibility(
            rows // 2, columns // 2, -(-config.disparities // 2), HALF_SIZE, extra // 2)
        self.inside = config.min_disparity, config.min_disparity + columns - 1
        self._shift = config.min_disparity
        # The right image as it is read and averaged.
        self._right = View(rows, columns, True, 0) if extra else self.full.right
        self._bands, self._half_bands = cut_bands(rows, tile), cut_bands(rows // 2, tile)

    def read(self, crew, left, right, average, describe):
        """
        Read a pair.

        The right image is moved by the smallest disparity: to the right as it is read, to the left
        into a wider view, so that none of it is lost.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); average: called with the left and the
        right view once they are read; describe: called with a view and a range of rows, writes
        what its matches are judged by
        """
        full, half, shift = self.full, self.half, self._shift
        places = fine_places(left, right)

        def read(band):
            full.left.read(left, 0, places, band[1], band[2])
            self._right.read(right, max(shift, 0), places, band[1], band[2])

        def halve(band):
            full.left.halve(half.left, band[1], band[2])
            full.right.halve(half.right, band[1], band[2])

        crew.each(read, self._bands)
        average(full.left, self._right)
        if shift < 0:
            crew.each(lambda band: full.right.spread(
                self._right, -shift, band[1], band[2]), self._bands)
        crew.each(lambda band: full.describe(describe, band[1], band[2]), self._bands)
        crew.each(halve, self._half_bands)
        crew.each(lambda band: half.describe(describe, band[1], band[2]), self._half_bands)
