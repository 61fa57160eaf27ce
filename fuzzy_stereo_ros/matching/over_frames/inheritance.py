# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The profiles `paper` and `quality` inherit pictures and maps from the previous frame.

Not in the paper, which matches one pair. Luminance and colours are averaged. A cell inherits the
genes of its place in the previous frame: in tiles that stayed or moved with the whole picture, as
averaging has found, or by the motion of the camera; all other cells are new.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.evidence import Evidence
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal import warp
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
from fuzzy_stereo_ros.matching.over_frames.averaging import ANOTHER, Averaging, History
from fuzzy_stereo_ros.matching.over_frames.moving_camera import MovingCamera
from fuzzy_stereo_ros.matching.over_frames.pictures import (
    luminance_shift, NoiseEstimate, NOISY, Picture)
from fuzzy_stereo_ros.matching.over_frames.state import FrameState, NO_COLOURS
import numpy as np

SURE_MATCH = 0.5    # confidence from which a match is used to estimate the motion of the camera
IN_PLACE = 0.0, 0.0, 1.0, 0.0       # scale that leaves a disparity as it is
LOUDER = (16 / 6)**0.5   # noise of a channel relative to B + 2 G + R, if channels are independent
CHANNELS, OF_LUMINANCE = 3, 2       # number of channels; bits of the sum of their weights


class Inheritance:
    """
    The pictures of a pair and what they inherit from those before, of one image size.

    views: a `Picture` of the left and of the mirrored right image; noisy: whether the last pair
    has so much noise that its pictures are averaged where the camera moves too
    """

    def __init__(self, config, rows, columns, seen=1, least_age=1):
        """
        Allocate for images of a size.

        seen: number of views with colours and maps; least_age: frames that a tile of noisy
        pictures must average, else its cells are new: maps found in more noise are worse
        """
        self._least_age = least_age
        self._highest, self._lowest = config.disparities - 1, float(config.min_disparity)
        self._shape = rows, columns
        self.views = [Picture(rows, columns, mirrored) for mirrored in (False, True)]
        self._halves = [Picture(rows // 2, columns // 2, view.mirrored) for view in self.views]
        self._half = self._halves[0]
        self._sides = [side for side in range(seen) for _ in range(CHANNELS)]
        self._channels = [Picture(rows, columns, side > 0) for side in self._sides]
        self._bands = cut_bands(rows, 2)
        self._averaging = Averaging(rows, columns, config.min_disparity)
        self._noises = [NoiseEstimate(rows, columns) for _ in range(2)]
        self._evidence = Evidence(*self._halves, self._noises, config.min_disparity)
        self._moving = MovingCamera(rows, columns, config.min_disparity)
        self._origins = np.zeros((seen, rows, columns), np.int32)
        self._nearest = np.zeros((rows, columns), np.float32)
        self._scales, self.noisy = [IN_PLACE] * seen, False

    @property
    def luminances(self):
        """The luminance of the left and of the right image: uint16 (R, C), views."""
        left, right = (view.luminance[MARGIN:-MARGIN, MARGIN:view.columns + MARGIN]
                       for view in self.views)
        return left, right[:, ::-1]

    @property
    def greys(self):
        """The same in grey levels of 8 bits: uint8 (R, C)."""
        return [_upright(view) for view in self.views]

    @property
    def colours(self):
        """The colours of the views, uint8 (R, C, 3); a grey image has it in all channels."""
        channels = self._channels if self._coloured else [self.views[side] for side in self._sides]
        return [np.stack([_upright(one) for one in channels[first:first + CHANNELS]], axis=-1)
                for first in range(0, len(channels), CHANNELS)]

    @property
    def motion(self):
        """How the camera moved, in words; '' where no camera is given."""
        return self._moving.description

    def read(self, pool, left, right, state=None):
        """Read a pair: uint8 or uint16 (R, C) or (R, C, 3); state: as of `average`."""
        left_shift = self._left_shift = luminance_shift(left, right, state and state.left_shift)
        images = left, right
        self._coloured = left.ndim == 3
        read = [(view, image, left_shift) for view, image in zip(self.views, images)]
        if self._coloured:
            read += [(picture, np.ascontiguousarray(images[side][..., place % CHANNELS]),
                      left_shift + OF_LUMINANCE)
                     for place, (picture, side) in enumerate(zip(self._channels, self._sides))]

        def read_band(band):
            for picture, image, shift in read:
                picture.read(image, 0, shift, *band[1:])
        pool.each(read_band, self._bands)

    def average(self, pool, state, camera):
        """
        Average the pictures with those of the FrameState of the previous frame, None for none.

        camera: a `Camera` that may have moved, or None. Returns whether maps are inherited.
        """
        averaging, moving = self._averaging, self._moving
        self._measure_noise()
        self.noisy = self._noises[0].level > NOISY
        number = len(self._channels) if self._coloured else 0
        if state is not None and len(state.colours) != number:
            state = None
        before = (state.colours if state is not None
                  else np.empty((number, *self._shape), np.uint16) if number else NO_COLOURS)
        averaging.average(pool, self.views, self._noises, History.of(state))
        self.views[0].halve(self._half, 0, self._half.rows)
        followed = moving.follow(pool, state, camera, self._half.grey[:, :self._half.columns],
                                 averaging.share)
        warped = moving.average_warped(averaging, self.views, self._noises, self.noisy, state,
                                       self._sides)
        before = before if warped is None else warped
        self._colours = np.empty_like(before)
        averaging.blend(pool, self._channels[:number], self._sides, before, self._colours,
                        LOUDER)
        if state is None or not (followed or averaging.share >= ANOTHER):
            return False
        self._find_origins(state.own.maps, followed)
        if self.noisy and self._least_age > 1:
            for tiles, origins in zip(averaging.tiles, self._origins):
                young = np.repeat(tiles.ages < self._least_age, TILE, axis=1)
                for row, line in enumerate(origins):
                    line[young[row // TILE, :line.size]] = warp.NEW
        return True

    def _measure_noise(self):
        for view, noise in zip(self.views, self._noises):
            noise.measure(view, 0, view.rows)
            noise.estimate()

    def _find_origins(self, maps, followed):
        """
        Find where the cells of maps, (views, R, C), were.

        followed: whether the motion of the camera is known
        """
        averaging, moving = self._averaging, self._moving
        if followed:
            self._lowest, columns = moving.lowest, self._shape[1]
            views = moving.motion.forward, moving.motion.mirrored_right(columns, moving.offset)
            self._scales = [tuple(view[2].tolist()) for view in views]
            for labels, origins, view in zip(maps, self._origins, views):
                warp.move_labels(labels.astype(np.float32), moving.kernel_motion(view),
                                 (self._nearest, origins))
            return
        self._scales = [IN_PLACE] * len(self._origins)
        for tiles, origins, shift in zip(averaging.tiles, self._origins, averaging.shifts[:, 1]):
            warp.origins_of_tiles(tiles.choices, *shift, origins)

    @property
    def unseen(self):
        """The share of the cells that are new, in the view that has most of them."""
        return max(float(np.mean(origins == warp.NEW)) for origins in self._origins)

    def inherit(self, before, fresh, genes, side=0):
        """
        Write the map of a view that is inherited.

        before: (R, C), the map of the previous frame; fresh: (R, C), genes of new cells; genes:
        (R, C), written, uint16 or float32; side: 1 for the mirrored right view
        """
        warp.inherit(before, self._origins[side], self._lowest, self._scales[side],
                     self._highest, fresh, genes)

    def seen(self, labels):
        """Return where the pair shows what a map, (R, C) labels, matches: bool (R, C)."""
        rows = len(labels)
        for view, half in zip(self.views, self._halves):
            view.halve(half, 0, half.rows)
        self._measure_noise()
        self._evidence.sum_up(labels, (0, 0, rows))
        self._evidence.judge()
        validity, no_votes = (np.full(labels.shape, CONSISTENT, np.uint8) for _ in range(2))
        self._evidence.reject(validity, no_votes, 0, rows)
        return validity == CONSISTENT

    def next_state(self, labels, confidence, own, config):
        """
        Return the FrameState of this frame.

        labels: (R, C), the fittest map; confidence: float32 (R, C), of it; own: what the profile
        adds
        """
        cells = labels[::2, ::2][:self._half.rows, :self._half.columns].astype(np.float32)
        return FrameState(
            *self._averaging.kept, self._colours,
            self._moving.state(cells, (confidence < SURE_MATCH).astype(np.uint8)), own,
            self._left_shift, None, 0, config)


def _upright(picture):
    """Return the grey levels of a `Picture`, not mirrored: uint8 (R, C)."""
    grey = picture.grey[:, :picture.columns]
    return np.ascontiguousarray(grey[:, ::-1]) if picture.mirrored else grey
