# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The best chromosome and the pictures of the previous frame, warped to the camera's new pose.

Not in the paper. A warped label is checked by the pictures: the census of a point that stands
still is the same in both frames. Where the label agrees with the half-size map, or its census
agrees better, the search relies on it, the more the longer the label has survived. Points that
move by themselves fail this check.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.evolution import Stopwatch
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import STEPS
from fuzzy_stereo_ros.matching.kernels.temporal import warp
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.realtime.camera_motion import between
import numpy as np

AROUND = 3           # cells of a side of the square in which distances of census are summed
UNLIKE = 8 * AROUND**2      # largest sum of a moved label that the search relies on
LIKELIER = 4         # by which its sum must be below that of the half map where they differ
NEAR, FLAT = 3, 3    # labels by which they may differ; largest range of labels in 3 x 3 cells
LONGEST = 3          # largest strength, reached by labels that survived so many frames
HOLE = 5             # side of the median that closes holes between cells that moved
IN_PLACE = 'in place'
FARTHER = -10.0      # column or row of a pixel outside the image


class CameraState(NamedTuple):
    """
    What the next frame of a moving camera needs; arrays of no size where no camera is known.

    half_grey: uint8 (r, c), left image at half size; census: uint32 (R, C), of the full image;
    cells: float32 (r, c), sub-pixel labels of every other pixel of every other row; survived:
    uint8 (r, c), how many frames each label survived while the camera moved
    """

    half_grey: np.ndarray
    census: np.ndarray
    cells: np.ndarray
    survived: np.ndarray


NO_CAMERA = CameraState(*(np.zeros((0, 0), kind) for kind in (
    np.uint8, np.uint32, np.float32, np.uint8)))


class MovingCamera:
    """
    The previous frame moved to this one, of one image size.

    description: how the camera moved, '' where no camera is given; milliseconds: time to find out
    """

    def __init__(self, rows, columns, labels_type, min_disparity):
        """Allocate for images of a size."""
        cells = rows // 2, columns // 2
        self._shape, self._bands = (rows, columns), cut_bands(cells[0])
        self._moved, self._right = (np.zeros(cells, np.float32) for _ in range(2))
        self._source = np.zeros(cells, np.int32)
        self._labels = np.zeros((rows, columns), labels_type)
        self._distances = [np.zeros(cells, np.uint8) for _ in range(2)]
        self._strengths = np.zeros(cells, np.uint8)
        self._columns, self._rows = (np.zeros(cells, np.float32) for _ in range(2))
        self._shift, self._min_disparity = min(min_disparity, 0), min_disparity
        self.description, self.milliseconds, self._motion = '', 0.0, None

    def follow(self, pool, previous, camera, half_grey, in_place):
        """
        Move the map of a previous FrameState, None for none; return whether that was done.

        camera: a `Camera`, or None; half_grey: uint8 (r, c), the left image at half size;
        in_place: whether most of the picture is unchanged: then nothing has to be moved
        """
        self._pool, self._camera, self._motion, self.description = pool, camera, None, ''
        self._packed, self.milliseconds = None, 0.0
        self._strengths[:] = 0
        if camera is None or previous is None or not previous.half_grey.size:
            return False
        if in_place:
            self.description = IN_PLACE
            return False
        watch = Stopwatch()
        self._lowest = self._min_disparity - camera.offset
        self._motion, self.description = between(
            previous.half_grey, half_grey, previous.cells, previous.validity[::2, ::2],
            self._lowest, camera)
        if self._motion is not None:
            warp.move_labels(
                previous.cells, self._lowest, _numbers(_between_cells(self._motion.forward)),
                self._moved, self._source)
        watch.lap('motion')
        self.milliseconds = watch.times['motion']
        return self._motion is not None

    def pictures(self, previous):
        """Return the pictures and ages of a FrameState, warped to this frame."""
        closed = np.where(self._moved < 0, cv2.medianBlur(self._moved, HOLE), self._moved)
        view = _numbers(_of_centres(self._motion.back))
        warp.to_right(closed, self._shift, self._right)
        pictures = np.empty_like(previous.pictures)
        ages = np.empty_like(previous.ages)
        for side, labels in enumerate((closed, self._right)):
            self._pool.each(lambda band, labels=labels, side=side: warp.look_back(
                labels, self._lowest, view, self._shift, bool(side), self._columns, self._rows,
                band[1], band[2]), self._bands)
            across, down = (self._full_size(found) for found in (self._columns, self._rows))
            if side:        # mirrored, as the picture is
                across, down = (np.ascontiguousarray(found[:, ::-1]) for found in (
                    self._shape[1] - 1 - across, down))
            cv2.remap(previous.pictures[side], across, down, cv2.INTER_LINEAR,
                      dst=pictures[side], borderMode=cv2.BORDER_CONSTANT)
            ages[side] = _ages_at(previous.ages[side], across, down)
        return pictures, ages

    def write_prior(self, previous, half, census, labels, weights, above):
        """
        Make the moved map a prior where there is none yet; return the labels of the prior.

        previous, half: the FrameState and the `Half`; census: uint8 (R, 3, C or more), of the
        left image; labels, weights: (R, C), of the prior so far, weights written: above and a
        strength of 1 to LONGEST. Returns None where the camera was not followed.
        """
        if self._motion is None:
            return None
        view = _numbers(_to_pixels(self._motion.back))
        packed = self._packed_census(census)
        self._pool.each(lambda band: warp.census_distances(
            self._moved, half.labels, NEAR, self._lowest, view, packed, previous.census,
            *self._distances, band[1], band[2]), self._bands)
        summed = [cv2.boxFilter(found, cv2.CV_16U, (AROUND, AROUND), normalize=False)
                  for found in self._distances]
        highest = previous.config.disparities - 1

        def write_band(band):
            warp.trusted_moved(
                self._moved, self._source, previous.validity, summed[0], half.labels, summed[1],
                (UNLIKE, NEAR, LIKELIER, FLAT, LONGEST), self._strengths,
                previous.survived, band[1], band[2])
            warp.moved_prior(self._moved, self._strengths, highest, above, labels, weights,
                             self._labels, band[1], band[2])
        self._pool.each(write_band, self._bands)
        return self._labels

    def next_state(self, previous, half_grey, census, fine):
        """
        Return the `CameraState` of this frame; NO_CAMERA where no camera is known.

        half_grey, census: of this frame's left image; fine: (R, C), 1 / STEPS of a label
        """
        if self._camera is None:
            return NO_CAMERA
        cells, survived = np.empty_like(self._moved), np.zeros(self._moved.shape, np.uint8)
        before = survived if self._motion is None else previous.survived
        self._pool.each(lambda band: warp.note_survivors(
            fine, STEPS, self._moved, self._strengths, self._source, before, cells, survived,
            band[1], band[2]), self._bands)
        return CameraState(half_grey.copy(), self._packed_census(census), cells, survived)

    def _packed_census(self, census):
        """Return the census of this frame as 32-bit words, packed once a frame."""
        if self._packed is None:
            packed = self._packed = np.empty(self._shape, np.uint32)
            self._pool.each(lambda band: warp.pack_census(census, packed, band[1], band[2]),
                            cut_bands(self._shape[0]))
        return self._packed

    def _full_size(self, cells):
        """Return values of the cells' centres for all pixels, linear between them."""
        found = cv2.resize(cells, (2 * cells.shape[1], 2 * cells.shape[0]))
        rows, columns = self._shape
        return np.pad(found, ((0, rows - found.shape[0]), (0, columns - found.shape[1])),
                      constant_values=FARTHER)


def _numbers(view):
    """Return a view, a matrix (3, 4), as the tuple that kernels take."""
    return tuple(view.ravel().tolist())


def _to_pixels(view):
    """Return a view of pixels as one from cells to pixels."""
    return view * (2.0, 2.0, 1.0, 1.0)


def _between_cells(view):
    """Return a view of pixels as one from cells to cells."""
    return _to_pixels(view) * [[0.5], [0.5], [1.0]]


def _of_centres(view):
    """Return a view of pixels as one from the centres of cells to pixels."""
    centred = _to_pixels(view)
    centred[:, 2] += 0.5 * (view[:, 0] + view[:, 1])
    return centred


def _ages_at(ages, across, down):
    """Return the ages of tiles, float32 (tile rows, tile columns), where their middles were."""
    rows, columns = (np.minimum(np.arange(number) * TILE + TILE // 2, size - 1)
                     for number, size in zip(ages.shape, across.shape))
    place = (np.floor_divide(found[np.ix_(rows, columns)], TILE).astype(np.intp)
             for found in (down, across))
    row, column = place
    inside = (row >= 0) & (row < ages.shape[0]) & (column >= 0) & (column < ages.shape[1])
    return np.where(inside, ages[np.clip(row, 0, ages.shape[0] - 1),
                                 np.clip(column, 0, ages.shape[1] - 1)], 0).astype(np.float32)
