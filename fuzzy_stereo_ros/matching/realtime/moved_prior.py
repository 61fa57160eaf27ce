# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The previous best, moved with the camera, as a prior of the search.

Not in the paper. A moved label is checked by the pictures: the census of a point that stands still
is the same in both frames. Where the label agrees with the half-size map, or its census agrees
better, the search relies on it; its weight grows with the frames that it survived. Points that
move by themselves fail this check.
"""
import cv2
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.temporal import warp
from fuzzy_stereo_ros.matching.over_frames.moving_camera import to_pixels
import numpy as np

CENSUS_SIDE = 3      # cells of a side of the square in which distances of census are summed
# largest sum of distances of a trusted moved label: less than by chance, 12 bits a cell
UNLIKE = 10 * CENSUS_SIDE**2
LIKELIER = 4         # by which its sum must be below that of the half map where they differ
AGREEING, FLAT = 3, 3  # labels by which they may differ; largest range of labels in 3 x 3 cells
LONGEST = 3          # largest strength, reached by labels that survived so many frames
NO_CENSUS = np.zeros((0, 0), np.uint32), np.zeros((0, 0), np.uint8)


class MovedPrior:
    """The prior that a `MovingCamera` gives, of one image size."""

    def __init__(self, rows, columns, labels_type, moving):
        """Allocate for images of a size; moving: the `MovingCamera`."""
        cells = rows // 2, columns // 2
        self._shape, self._bands, self._moving = (rows, columns), cut_bands(cells[0]), moving
        self._labels = zeros((rows, columns), labels_type)
        self._distances = tuple(zeros(cells, np.uint8) for _ in range(2))
        self._strengths = zeros(cells, np.uint8)
        self.restart()

    def restart(self):
        """Have no prior until `write`."""
        self._packed = None
        self._strengths[:] = 0

    def write(self, pool, previous, half, census, labels, weights, by_strength):
        """
        Make the moved map a prior where there is none yet; return the labels of the prior.

        previous: the FrameState; half: the `HalfSizeResult`; census: uint8 (R, 3, C or more), of
        the left image; labels, weights: (R, C), of the prior so far; by_strength: uint8
        (LONGEST + 1,), what weights get. Returns None where the camera was not followed.
        """
        moving, own = self._moving, previous.own
        if moving.motion is None:
            return None
        back = moving.kernel_motion(to_pixels(moving.motion.back))
        both = self._packed_census(pool, census), own.census
        pool.each(lambda band: warp.census_distances(
            moving.moved, half.labels, AGREEING, back, both, self._distances, band[1], band[2]),
            self._bands)
        side = CENSUS_SIDE, CENSUS_SIDE
        summed = tuple(cv2.boxFilter(found, cv2.CV_16U, side, normalize=False)
                       for found in self._distances)
        highest = previous.config.disparities - 1

        def write_band(band):
            warp.trusted_moved(
                (moving.moved, moving.source), (previous.camera.cell_validity, own.survived),
                half.labels, summed, (UNLIKE, AGREEING, LIKELIER, FLAT, LONGEST), self._strengths,
                band[1], band[2])
            warp.moved_prior((moving.moved, self._strengths), highest, by_strength, labels,
                             weights, self._labels, band[1], band[2])
        pool.each(write_band, self._bands)
        return self._labels

    def note(self, pool, previous, census, fine):
        """
        Return cells, census and survived for the next frame.

        cells: float32 (r, c), labels; census: uint32 (R, C), of the full image; survived: uint8
        (r, c), how many frames each label survived while the camera moved; the last two of no
        size where no camera is known. census, fine: of this frame, the latter (R, C) in
        1 / STEPS of a label.
        """
        moving = self._moving
        cells = np.empty_like(moving.moved)
        if not moving.known:
            return cells, *NO_CENSUS
        survived = np.zeros(cells.shape, np.uint8)
        before = survived if moving.motion is None else previous.own.survived
        pool.each(lambda band: warp.note_survivors(
            fine, (moving.moved, moving.source), self._strengths, before, cells, survived,
            band[1], band[2]), self._bands)
        return cells, self._packed_census(pool, census), survived

    def _packed_census(self, pool, census):
        """Return the census of this frame as 32-bit words, packed once a frame."""
        if self._packed is None:
            packed = self._packed = np.empty(self._shape, np.uint32)
            pool.each(lambda band: warp.pack_census(census, packed, band[1], band[2]),
                      cut_bands(self._shape[0]))
        return self._packed
