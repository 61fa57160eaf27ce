# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From frame to frame: both pictures are averaged, and the population lives on, moved with them.

Not in the paper, which matches one pair. The whole population is handed on, the fittest first. A
cell takes over the genes of where it was in the previous frame: in tiles that stayed or moved as a
whole, as averaging has found, or by the motion of the camera. Where it was not seen before, each
chromosome has the most possible gene.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.genetic.inheritance import inherit, NEW, origins_of_tiles
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal import warp
from fuzzy_stereo_ros.matching.over_frames.averaging import (
    ANOTHER, Averaging, History, STILL)
from fuzzy_stereo_ros.matching.over_frames.moving_camera import MovingCamera, NOISY, numbers
from fuzzy_stereo_ros.matching.over_frames.noise import NoiseEstimate
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift, Picture
from fuzzy_stereo_ros.matching.over_frames.state import FrameState
from fuzzy_stereo_ros.matching.paper.possibility import eight_bit_colours
import numpy as np

SURE = 0.5          # confidence from which a match tells how the camera moved
IN_PLACE = 0.0, 0.0, 1.0, 0.0       # scale of a disparity that stays what it is


class PaperState(NamedTuple):
    """
    What the profile adds to a `FrameState`.

    genes: uint16 (P, R, C), the population, the fittest chromosome first
    """

    genes: np.ndarray

    def after(self, gap_ns):
        """Return it for a frame that comes so much later."""
        return self

    def layout(self, shape, labels):
        """Return {name: (dtype, shape)} of the arrays, for images of a shape."""
        return {'genes': (np.uint16, (len(self.genes), *shape))}

    def check(self, labels):
        """Raise ValueError for a number that kernels, which check no index, cannot use."""
        if not self.genes.size or (self.genes >= labels).any():
            raise ValueError('the state has genes out of range')


class Inheritance:
    """
    The pictures of a pair and what they inherit from those before, of one image size.

    left, right: a `Picture` each; colours: uint8 (R, C, 3), of the left image
    """

    def __init__(self, config, rows, columns):
        """Allocate for images of a size."""
        self._highest, self._lowest = config.disparities - 1, float(config.min_disparity)
        self.left, self.right, self._half = (Picture(rows, columns, False), Picture(
            rows, columns, True), Picture(rows // 2, columns // 2, False))
        self._bands = cut_bands(rows, 2)
        self._averaging = Averaging(rows, columns, config.min_disparity)
        self._noise = NoiseEstimate(rows, columns)
        self._moving = MovingCamera(rows, columns, config.min_disparity)
        self._origins, self._nearest = (np.zeros((rows, columns), kind)
                                        for kind in (np.int32, np.float32))
        self._before, self._scale = None, IN_PLACE

    @property
    def luminances(self):
        """The luminance of the left and of the right image: uint16 (R, C), views."""
        left, right = (picture.luminance[MARGIN:-MARGIN, MARGIN:picture.columns + MARGIN]
                       for picture in (self.left, self.right))
        return left, right[:, ::-1]

    @property
    def greys(self):
        """The same in grey levels of 8 bits: uint8 (R, C)."""
        left, right = (picture.grey[:, :picture.columns] for picture in (self.left, self.right))
        return left, np.ascontiguousarray(right[:, ::-1])

    @property
    def motion(self):
        """How the camera moved, in words; '' where no camera is given."""
        return self._moving.description

    def read(self, pool, left, right):
        """Read a pair: uint8 or uint16 (R, C) or (R, C, 3)."""
        left_shift = luminance_shift(left, right)
        self.colours = eight_bit_colours(left, left_shift)

        def read_band(band):
            for picture, image in ((self.left, left), (self.right, right)):
                picture.read(image, 0, left_shift, *band[1:])
        pool.each(read_band, self._bands)

    def average(self, pool, state, camera):
        """
        Average the pictures with those of the FrameState of the previous frame, None for none.

        camera: a `Camera` that may have moved, or None. Returns whether the population is
        inherited.
        """
        views, averaging, moving = (self.left, self.right), self._averaging, self._moving
        self.left.halve(self._half, 0, self._half.rows)
        self._noise.measure(self.left, self._half, 0, self.left.rows)
        noise = self._noise.level       # before averaging
        if state is None:
            averaging.restart(pool, views)
        else:
            averaging.average(pool, views, History(
                state.pictures, state.ages, state.drifts, state.own.genes[0]))
        self.left.halve(self._half, 0, self._half.rows)
        followed = moving.follow(pool, state, camera, self._half.grey[:, :self._half.columns],
                                 averaging.share >= STILL)
        if state is None:
            return False
        self._before, self._scale = state.own.genes, IN_PLACE
        if followed:
            if noise > NOISY and averaging.share < ANOTHER:
                averaging.average(pool, views, History(
                    *moving.pictures(state), np.zeros_like(state.drifts), None), search=False)
            view = moving.motion.forward
            warp.move_labels(self._before[0].astype(np.float32), moving.lowest, numbers(view),
                             self._nearest, self._origins)
            self._lowest, self._scale = moving.lowest, tuple(view[2].tolist())
            return True
        if averaging.share < ANOTHER:
            return False
        origins_of_tiles(averaging.tiles[0].choices, *averaging.shift, self._origins)
        return True

    @property
    def unseen(self):
        """The share of the cells that the previous frame did not show."""
        return np.count_nonzero(self._origins == NEW) / self._origins.size

    def inherit(self, slot, fresh, genes):
        """
        Write the genes that a chromosome inherits.

        slot: its rank in the previous frame, where a smaller population counts again and again;
        fresh: uint16 (R, C), genes of new cells; genes: uint16 (R, C), written
        """
        inherit(self._before[slot % len(self._before)], self._origins, self._lowest, self._scale,
                self._highest, fresh, genes)

    def next_state(self, genes, confidence, config):
        """
        Return the FrameState of this frame, a copy.

        genes: uint16 (P, R, C), the fittest first; confidence: float32 (R, C), of the first
        """
        cells = genes[0, ::2, ::2][:self._half.rows, :self._half.columns].astype(np.float32)
        averaging = self._averaging
        return FrameState(
            averaging.pictures, averaging.ages, averaging.drifts,
            self._moving.state(cells, (confidence < SURE).astype(np.uint8)), PaperState(genes),
            None, 0, config)
