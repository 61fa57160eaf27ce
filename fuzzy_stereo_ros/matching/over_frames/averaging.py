# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Both pictures of a pair averaged over frames, tile by tile, which removes noise.

Not in the paper. Averaging pictures helps more than averaging maps: matching amplifies noise. A
tile is averaged only where it changed by noise alone: no more than the noise of this pair at its
brightness (photons add noise), with block means no larger than those of white noise, and no more
in any block than elsewhere. Nor may it drift in the direction of a motion over frames, or change
in the same way in both views, as texture does. Where a camera turns, the whole picture moves by
one shift, which phase correlation finds; where it moves otherwise, nothing is averaged.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import Chain
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    blend, compare_tiles, MEASURES, TILE)
from fuzzy_stereo_ros.matching.kernels.temporal.motion import best_shift, move_ages, thumbnail
from fuzzy_stereo_ros.matching.kernels.temporal.unchanged_tiles import (
    add_drifts, ages_of_both, changes_alike, choose_tiles, reject_alike, reject_drifting,
    tile_noises)
import numpy as np

THUMBNAIL = 60       # rows or columns, at least, of the thumbnails that are correlated
SMALLEST = 16        # rows and columns of a thumbnail that phase correlation can work with
CORRELATION_ERROR = 2  # px of error of the correlation
SAMPLED = 16         # every SAMPLED-th row is compared to find the exact shift
ALIKE = 0.55         # correlation of the changes in both views from which a tile moves
LIKE = 2.5           # limit of the difference of an averaged pixel, as a factor of its tile's
STILL = 0.8          # share of unchanged tiles from which the picture counts as still
ANOTHER = 0.3        # share of unchanged tiles below which the scene is another one
FAINT = 0.5          # grey levels of noise from which both views are compared for moving texture


class History(NamedTuple):
    """
    The averaged pictures of the previous frame, with which those of this one are compared.

    pictures, ages, drifts: see FrameState; labels: (R, C), of the left picture, None where it was
    warped: its tiles are then not tested for motion, as warping leaves some
    """

    pictures: np.ndarray
    ages: np.ndarray
    drifts: np.ndarray
    labels: np.ndarray | None

    @classmethod
    def of(cls, state):
        """Return that of a FrameState, None for none."""
        return state and cls(state.pictures, state.ages, state.drifts, state.own.labels)


class PictureShift:
    """Compares the pictures of two frames of one image size."""

    def __init__(self, rows, columns):
        """Allocate for images of a size; those too small for a thumbnail never move."""
        self._scale = max(min(rows, columns) // THUMBNAIL, 1)
        size = [_even_size(pixels // self._scale) for pixels in (rows, columns)]
        self._usable = min(size) >= SMALLEST
        self._before, self._now = (np.zeros(size, np.float32) for _ in range(2))
        self._window = cv2.createHanningWindow(size[::-1], cv2.CV_32F) if self._usable else None

    def between(self, before, now):
        """
        Return how far the picture moved down and to the right, in whole pixels.

        before: uint16 (R, C), luminance; now: uint16, the same, padded.
        """
        if not self._usable:
            return 0, 0
        thumbnail(before, 0, self._scale, self._before)
        thumbnail(now, MARGIN, self._scale, self._now)
        # the window is applied here: OpenCV would apply it to the arrays themselves
        (right, down), _ = cv2.phaseCorrelate(self._before * self._window,
                                              self._now * self._window)
        return best_shift(now, before, round(down * self._scale),
                          round(right * self._scale), CORRELATION_ERROR, SAMPLED)


def _even_size(size):
    """Return the largest even size up to a size that needs no padding; others are biased."""
    while size >= SMALLEST and (size % 2 or cv2.getOptimalDFTSize(size) != size):
        size -= 1
    return size


class ViewTiles(NamedTuple):
    """A view compared with its previous picture, by tile: (tile rows, tile columns)."""

    differences: np.ndarray  # float32 (2, MEASURES, ...), by shift; see compare_tiles
    noises: np.ndarray       # float32, grey levels
    ages_then: np.ndarray    # float32 (2, ...), by shift, frames in the previous average
    choices: np.ndarray      # int8, index of the shift; -1: it changed and is not averaged
    ages: np.ndarray         # float32, frames in the average, with this one
    sizes: np.ndarray        # float32, difference, grey levels
    drifts_then: np.ndarray  # float32 (2, 2, ...), by shift; see add_drifts
    drifts: np.ndarray       # float32 (2, ...), with this frame


class Averaging:
    """
    Averages the views of one image size.

    pictures: uint16 (2, R, C), averaged, mirrored as the views are; tiles: `ViewTiles` of each;
    shifts: int64 (2, 2, 2), of each view, of tiles that stay and that move: down, right;
    ages_of_both: float32 by tile of the left view, see the kernel; share: of the tiles that are
    unchanged, in the view that has fewer; noise: grey levels
    """

    def __init__(self, rows, columns, offset):
        """Allocate for images of a size; offset: of disparities from labels, px."""
        shape = -(-rows // TILE), -(-columns // TILE)
        self._shift, self._size = PictureShift(rows, columns), (rows, columns)
        self._offset = offset
        self._alike = np.zeros(shape, np.float32)
        self.ages_of_both = np.zeros(shape, np.float32)
        sizes = {'differences': (2, MEASURES), 'ages_then': (2,), 'drifts_then': (2, 2),
                 'drifts': (2,)}
        kinds = {'choices': np.int8}
        self._both = ViewTiles(*(
            np.zeros((2, *sizes.get(name, ()), *shape), kinds.get(name, np.float32))
            for name in ViewTiles._fields))
        self.tiles = [ViewTiles(*(values[side] for values in self._both)) for side in range(2)]
        self.shifts = np.zeros((2, 2, 2), np.int64)

    @property
    def choices(self):
        """Those of the `ViewTiles` of both views: int8 (2, tile rows, tile columns)."""
        return self._both.choices

    @property
    def kept(self):
        """The pictures, and copies of the ages and drifts of their tiles: of a `FrameState`."""
        return self.pictures, self._both.ages.copy(), self._both.drifts.copy()

    def _restart(self, pool, views):
        """Start anew with the pictures of this frame."""
        self.noise, self.share = 0.0, 0.0
        self._move_by(0, 0)
        self._both.choices[:], self._both.ages[:], self._both.drifts[:] = -1, 1, 0
        self.ages_of_both[:] = 1
        self.pictures = np.empty((2, *self._size), np.uint16)
        self.blend(pool, views, (0, 1), self.pictures, self.pictures)

    def average(self, pool, views, noises, history, search=True):
        """
        Average both views with the previous pictures, where they stayed or moved as a whole.

        views: left and right; noises: the `NoiseEstimate` of each; history: the `History`, None
        to start anew; search: whether the picture may have moved as a whole
        """
        if history is None:
            self._restart(pool, views)
            return
        pictures, ages, drifts, labels = history
        self._move_by(0, 0)
        self._both.ages_then[:], self._both.drifts_then[:] = ages[:, None], drifts[:, None]
        shares = self._choose(pool, views, noises, history, 1)
        if search and min(shares) < STILL:
            self._move_by(*self._shift.between(pictures[0], views[0].luminance))
        if any(self.shift):
            for tiles, before, drift, shift in zip(
                    self.tiles, ages, drifts, self.shifts[:, 1]):
                for values, moved in zip((before, *drift), (
                        tiles.ages_then[1], *tiles.drifts_then[1])):
                    move_ages(values, *shift, moved)
            shares = self._choose(pool, views, noises, history, 2)
        self.share = min(shares)
        for tiles, share in zip(self.tiles, shares):
            if share < ANOTHER:
                tiles.choices[:] = -1
                tiles.ages[:] = 1
        self._both.drifts[:] = 0
        self.ages_of_both[:] = self.tiles[0].ages
        if labels is not None:
            self._reject_drifting(labels)
        self.pictures = np.empty_like(pictures)
        self.blend(pool, views, (0, 1), pictures, self.pictures)

    def parts(self, pool):
        """Return parts of rows of tiles for the threads of a pool, see `cut_parts`."""
        return [(index, -(-first // TILE), -(-last // TILE))
                for index, first, last in pool.parts(self._size[0])]

    @property
    def shift(self):
        """How far the left picture moved, down and right."""
        return tuple(self.shifts[0, 1].tolist())

    def _move_by(self, down, right):
        """Write the shifts of tiles that move; the right view is mirrored."""
        self.shifts[:, 1] = (down, right), (down, -right)

    def _choose(self, pool, views, noises, history, number):
        """Compare the tiles at the last of some shifts; return the shares of unchanged ones."""
        shifts, chain, found = self.shifts, Chain(pool), [0.0, 0.0]

        def compare(band):
            for tiles, view, picture, of_view in zip(
                    self.tiles, views, history.pictures, shifts):
                compare_tiles(view.luminance, picture, *of_view[number - 1],
                              tiles.differences[number - 1], band[1], band[2])

        def choose(side):
            tiles = self.tiles[side]
            differences = tiles.differences[:number]
            found[side] = tile_noises(differences, noises[side].rough, tiles.noises)
            choose_tiles(differences, tiles.ages_then[:number], tiles.noises,
                         tiles.choices, tiles.ages, tiles.sizes)

        def reject(labels):
            self.noise = max(0.0, *found)
            if labels is None or self.noise <= FAINT:
                return
            left = self.tiles[0]    # moving texture changes both views in the same way
            changes_alike(
                tuple(view.luminance for view in views), history.pictures, labels, self._offset,
                (shifts[0], left.differences, left.choices), self._alike)
            reject_alike(self._alike, ALIKE, labels, self._offset, shifts[0], self._both.choices,
                         self._both.ages)
        chain.each(compare, self.parts(chain))
        chain.each(choose, range(2))
        chain.each(reject, [history.labels])
        chain.run()
        return [np.count_nonzero(tiles.choices >= 0) / tiles.choices.size
                for tiles in self.tiles]

    def _reject_drifting(self, labels):
        """Restart tiles that drift in the direction of a motion over frames."""
        for tiles in self.tiles:
            add_drifts(tiles.differences, tiles.choices, tiles.drifts_then, tiles.drifts)
            reject_drifting(tiles.choices, tiles.ages, tiles.drifts)
        ages_of_both(self._both.ages, labels, self._offset, self.shifts[0], self.tiles[0].choices,
                     self.ages_of_both)

    def blend(self, pool, pictures, sides, before, after, louder=1.0):
        """
        Average pictures with those before where the views are averaged.

        pictures: `Picture`s of the left or right view, by sides: 0 or 1; before, after: uint16
        (N, R, C), after is written; louder: their noise as a factor of that of the luminance
        """
        limits = [np.maximum(np.float32(LIKE * louder) * tiles.sizes, 1) for tiles in self.tiles]

        def blend_band(band):
            for side, picture, old, new in zip(sides, pictures, before, after):
                tiles = self.tiles[side]
                blend((picture.luminance, picture.grey), old, self.shifts[side],
                      (tiles.choices, tiles.ages, limits[side]), new, band[1], band[2])
        pool.each(blend_band, self.parts(pool))
