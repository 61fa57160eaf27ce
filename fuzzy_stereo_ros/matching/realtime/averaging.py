# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Both pictures averaged over the frames in which they show the same: the noise goes, tile by tile.

Not in the paper. A map from two pictures is better than a map from one and a memory of the map
before: matching errs by far more than noise alone. A tile is averaged only where what changed is
noise: no louder than noise is in this pair, not brighter or darker by blocks than white noise is,
and no louder in any block than elsewhere. A camera that turns moves everything alike, by one shift
that phase correlation finds; where the picture moves otherwise, nothing is averaged.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    blend, choose_tiles, compare_tiles, roughness, Rules, TILE)
from fuzzy_stereo_ros.matching.kernels.temporal.motion import best_shift, move_ages, thumbnail
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


RULES = Rules(loud=1.2, white=1.5, peak=1.3, bump=1.8, slack=0.3, oldest=32)
LIKE = 2.5           # times what a tile differs by which a pixel is averaged at the most
QUIET_TILES = 0.2    # share of the tiles that surely show nothing but noise
ROUGH = 0.61         # what noise is at the most by second differences: 1.5 / sqrt(6) of them
STILL = 0.8          # share of unchanged tiles from which the picture is taken to stay
ANOTHER = 0.3        # share of unchanged tiles below which it is another scene altogether


class Averaged(NamedTuple):
    """What became of a view; by tile, (tile rows, tile columns)."""

    differences: np.ndarray  # float32 (2, 4, ...), by shift; see compare_tiles
    rough: np.ndarray        # float32, second differences
    ages_then: np.ndarray    # float32 (2, ...), by shift, frames that it was the mean of
    choices: np.ndarray      # int8, which shift the tile made; -1: it is averaged with nothing
    ages: np.ndarray         # float32, frames that it is the mean of now, this one with them
    sizes: np.ndarray        # float32, how much it differs, grey levels


class Averaging:
    """
    The views of one image size, averaged: `pictures` of both, mirrored alike, and `ages`.

    share: of the tiles, those that show the same as before, in the view that has fewer
    """

    def __init__(self, rows, columns):
        """Allocate for images of a size."""
        tiles = -(-rows // TILE), -(-columns // TILE)
        self.bands = [(index, -(-first // TILE), -(-last // TILE))
                      for index, first, last in cut_bands(rows)]
        self._motion, self._size = Motion(rows, columns), (rows, columns)
        self.seen = [Averaged(
            np.zeros((2, 4, *tiles), np.float32), np.zeros(tiles, np.float32),
            np.zeros((2, *tiles), np.float32), np.full(tiles, -1, np.int8),
            np.ones(tiles, np.float32), np.zeros(tiles, np.float32)) for _ in range(2)]
        self.noise, self.shift, self.pictures, self.share = 0.0, (0, 0), None, 0.0

    @property
    def ages(self):
        """A copy of the ages of both views' tiles: float32 (2, tile rows, tile columns)."""
        return np.stack([seen.ages for seen in self.seen])

    def begin(self, pool, views):
        """Start anew: what is seen now is all there is."""
        self.noise, self.shift, self.share = 0.0, (0, 0), 0.0
        for seen in self.seen:
            seen.choices[:] = -1
            seen.ages[:] = 1
        pictures = np.empty((2, *self._size), np.uint16)
        self._blend(pool, views, pictures, pictures)

    def average(self, pool, views, pictures, ages, search=True):
        """
        Average both views with the pictures before: where they stayed, or moved with the rest.

        views: left and right; pictures: uint16 (2, R, C), the right one mirrored like its view;
        ages: float32 (2, tile rows, tile columns), of the pictures' tiles; search: whether all of
        it may have moved.
        """
        self.shift = 0, 0
        for seen, before in zip(self.seen, ages):
            seen.ages_then[:] = before
        shares = self._choose(pool, views, pictures, 1)
        if search and min(shares) < STILL:
            self.shift = self._motion.between(pictures[0], views[0].fine)
        if any(self.shift):
            for seen, before, (down, right) in zip(self.seen, ages, self._shifts()[:, 1]):
                move_ages(before, down, right, seen.ages_then[1])
            shares = self._choose(pool, views, pictures, 2)
        self.share = min(shares)
        for seen, share in zip(self.seen, shares):
            if share < ANOTHER:
                seen.choices[:] = -1
                seen.ages[:] = 1
        self._blend(pool, views, pictures, np.empty_like(pictures))

    def _shifts(self):
        """Return by view, and by whether a tile moved, how far: down and right, int64."""
        down, right = self.shift
        return np.array([[(0, 0), (down, right)], [(0, 0), (down, -right)]], np.int64)

    def _choose(self, pool, views, pictures, number):
        """Compare the tiles after the last of a number of shifts; return who are the same."""
        shifts = self._shifts()[:, number - 1]

        def compare(band):
            for seen, view, picture, (down, right) in zip(self.seen, views, pictures, shifts):
                compare_tiles(view.fine, picture, down, right, seen.differences[number - 1],
                              band[1], band[2])
                if number == 1:
                    roughness(view.fine, view.columns, seen.rough, band[1], band[2])
        pool.each(compare, self.bands)
        shares, self.noise = [], 0.0
        for seen in self.seen:
            noise = min(_quiet(seen.differences[:number, 0].min(axis=0)),
                        ROUGH * _quiet(seen.rough))
            shares.append(choose_tiles(
                seen.differences[:number], seen.ages_then, noise, tuple(RULES), seen.choices,
                seen.ages, seen.sizes))
            self.noise = max(self.noise, noise)
        return shares

    def _blend(self, pool, views, before, after):
        shifts = self._shifts()
        limits = [np.maximum(LIKE * seen.sizes, 1) for seen in self.seen]

        def blend_band(band):
            for side, (seen, view) in enumerate(zip(self.seen, views)):
                blend(view.fine, view.grey, before[side], shifts[side], seen.choices, seen.ages,
                      limits[side], after[side], band[1], band[2])
        pool.each(blend_band, self.bands)
        self.pictures = after


def _quiet(by_tile):
    """Return what so few tiles are below that they surely show nothing but noise."""
    flat = by_tile.reshape(-1)
    place = int(QUIET_TILES * (flat.size - 1))
    return float(np.partition(flat, place)[place])
