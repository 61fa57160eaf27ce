# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a frame uses of the previous one: averaged pictures, and a prior of the search.

Not in the paper. A previous best may be fit and out of date, and would freeze the map. So pictures
and chromosome are used only in tiles that differ from the previous frame by noise alone, and the
chromosome only where it was consistent, is flat and agrees with the half-size map, which does not
depend on the previous frame. Without noise the previous best gains nothing, and is not used.

Where the camera moved, labels that moved with it are checked by the pictures: the census of a
point that stands still is the same in both frames. The search relies on a label that agrees with
the half-size map, or whose census agrees better: the more, the more frames it survived. Points
that move by themselves fail this check.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import cut_bands, widened
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior, weight_of
from fuzzy_stereo_ros.matching.kernels.scanlines import half_size_prior
from fuzzy_stereo_ros.matching.kernels.temporal import motion, warp
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, OUTSIDE, STEPS
from fuzzy_stereo_ros.matching.over_frames.averaging import Averaging, History
from fuzzy_stereo_ros.matching.over_frames.moving_camera import MovingCamera, to_pixels
from fuzzy_stereo_ros.matching.over_frames.pictures import NOISY
from fuzzy_stereo_ros.matching.over_frames.state import FrameState, NO_COLOURS
from fuzzy_stereo_ros.matching.realtime.generation import gene_type, parent_of
from fuzzy_stereo_ros.matching.realtime.still_scene import (
    is_reused, LONGEST_STEP_NS, new_result, SETTLED)
import numpy as np

QUIET = 0.2          # grey levels of noise below which the previous best is not used
DISTANCE = 3         # px that a trusted gene may differ from the half map
FLAT = 2             # largest range of trusted labels in 3 x 3 half-size pixels
DEAD_ZONE, MOVED_DEAD_ZONE = 0, 1   # px from the prior that cost nothing: in place, or moved
CUTS = 1, 3, 6       # largest cost of other labels, by the frames that a tile is unchanged
MOVED_CUTS = 1, 3, 5    # the same of labels moved with the camera, by the frames they survived
WEIGHTS = np.array([0, *(weight_of(DEAD_ZONE, cut) for cut in CUTS)], np.uint8)
MOVED_WEIGHTS = np.array([weight_of(MOVED_DEAD_ZONE, MOVED_CUTS[min(survived, 2)])
                          for survived in range(256)], np.uint8)
NO_CENSUS = np.zeros((0, 0), np.uint32), np.zeros((0, 0), np.uint8)


class RealtimeState(NamedTuple):
    """
    The part of the profile in a `FrameState`.

    labels: uint8 or uint16 (R, C), the chromosome that was selected; validity: uint8 (R, C), 0 =
    consistent; census: uint32 (R, C), of the left image; survived: uint8 (R / 2, C / 2), how many
    frames each label survived while the camera moved; both empty where no camera is known; still:
    searched frames in a row in which nothing changed; since_search: frames since the last search;
    still_disparity, still_confidence: float32 (R, C), its result, empty until `still` is SETTLED
    """

    labels: np.ndarray
    validity: np.ndarray
    census: np.ndarray
    survived: np.ndarray
    still: int
    since_search: int
    still_disparity: np.ndarray
    still_confidence: np.ndarray

    def after(self, gap_ns):
        """Return it for a frame that comes so much later: a late one is searched."""
        return self._replace(still=0) if gap_ns > LONGEST_STEP_NS else self

    def layout(self, shape, labels, known):
        """Return {name: (dtype, shape)} of the arrays; shape: of images; known: if a camera is."""
        cells = tuple(side // 2 for side in shape)
        result = np.float32, shape if self.still >= SETTLED else (0, 0)
        seen = (shape, cells) if known else ((0, 0), (0, 0))
        return {'labels': (gene_type(labels), shape), 'validity': (np.uint8, shape),
                'census': (np.uint32, seen[0]), 'survived': (np.uint8, seen[1]),
                'still_disparity': result, 'still_confidence': result}

    def check(self, labels):
        """Raise ValueError for a number that kernels, which check no index, cannot use."""
        if (self.labels >= labels).any():
            raise ValueError('the state has labels out of range')


class WarmStart:
    """Averages the views with the previous frame's, and makes its best a prior of the search."""

    def __init__(self, rows, columns, disparities, min_disparity):
        """Allocate for images of a size and a range of disparities."""
        half = rows // 2, columns // 2
        self._averaging = Averaging(rows, columns, min(min_disparity, 0))
        self._moving = MovingCamera(rows, columns, min_disparity)
        self._half_labels = zeros(half, gene_type(disparities))
        self._trusted, self._smooth = (zeros(half, np.uint8) for _ in range(2))
        nothing = zeros((rows, columns), self._half_labels.dtype)
        self._moved = zeros(nothing.shape, nothing.dtype), zeros((rows, columns), np.uint8)
        self._distances, self._moved_weights = zeros((2, *half), np.uint8), zeros(half, np.uint8)
        self._weights, self._weighted = zeros((rows, columns), np.uint8), False
        self._choices = np.zeros_like(self._averaging.choices[0])
        self._strengths = np.zeros_like(self._choices, np.uint8)
        self._prior = Prior(nothing, self._weights)
        self._inherited, self._valid = zeros(half, np.uint16), zeros(half, np.uint8)

    def average(self, pool, state, views):
        """Average the pictures of `Views` with those of a state; None starts anew."""
        self._averaging.average(pool, views.pictures, views.noises, History.of(state))
        # The labels are those of the last search: a tile that changed since then has none.
        searched = 1 if state is None else 1 + state.own.since_search       # frames ago
        motion.tile_strengths(
            self._averaging.choices[0], self._averaging.ages_of_both, searched, len(CUTS),
            self._choices, self._strengths)
        self._left = views.pictures[0]
        self._packed = None

    def follow(self, pool, state, camera, views):
        """
        Follow a camera that moved since a state, and average the `Views` with its warped pictures.

        camera: a `Camera` that may have moved, or None
        """
        half_grey = views.half.left.grey[:, :views.half.columns]
        self._moving.follow(pool, state, camera, half_grey, self._averaging.share)
        if self._moving.motion is not None:
            self._moved_weights[:] = 0
        if self._moving.average_warped(self._averaging, views.pictures, views.noises,
                                       views.noise > NOISY, state) is not None:
            self._strengths[:] = 0      # the previous map is not in place

    @property
    def motion(self):
        """How the camera moved, in words; '' where no camera is given."""
        return self._moving.description

    @property
    def noise_left(self):
        """
        The share of a frame's noise that is left in the averaged views.

        The mean variance over the tiles is the mean of `1 / ages`. Its fourth root is returned,
        not the square root: tiles that are not averaged have all of the noise.
        """
        return float((1 / self._averaging.tiles[0].ages).mean())**0.25

    def no_previous_best(self, pool, state, half):
        """Return neither a parent nor a prior: only pictures are used."""
        self._clear_weights()
        return None, None

    def previous_best(self, pool, state, half):
        """
        Return the previous best of a state as a `Parent`, and as a `Prior`, None where unused.

        half: the `SmallResult` of this frame, which shows where the previous best is outdated
        """
        if state is None:
            return self.no_previous_best(pool, state, half)
        return self._parent(state), self._prior_of(pool, state, half)

    def _prior_of(self, pool, state, half):
        """Return the prior from the previous best of a state, None where it is not used."""
        labels = self._labels_in_place(pool, state, half)
        if self._moving.motion is not None:
            labels = self._moved_labels(
                pool, state, half, self._prior.labels if labels is None else labels)
        return None if labels is None else self._prior._replace(labels=labels)

    def _moved_labels(self, pool, state, half, known):
        """
        Return labels of the prior where those that moved are added, and write their weights.

        known: (R, C), the labels so far
        """
        moving, highest = self._moving, state.config.disparities - 1
        back, moved = moving.kernel_motion(to_pixels(moving.motion.back)), self._moved[0]
        both, side = (self._census(pool), state.own.census), (warp.CENSUS_SIDE, warp.CENSUS_SIDE)
        pool.each(lambda band: warp.census_distances(
            moving.moved, half.labels, back, both, self._distances, *band[1:]), moving.bands)
        distances = np.stack([cv2.boxFilter(found, cv2.CV_16U, side, normalize=False)
                              for found in self._distances])
        before = cv2.LUT(state.own.survived, MOVED_WEIGHTS) * (
            state.camera.cell_validity == CONSISTENT)

        def write_band(band):
            warp.trusted_moved((moving.moved, moving.source), before, half.labels, distances,
                               self._moved_weights, *band[1:])
            warp.moved_prior((moving.moved, self._moved_weights), highest, known, self._weights,
                             moved, *band[1:])
        self._weighted = True       # first: an interrupt may come
        pool.each(write_band, moving.bands)
        return moved

    def _census(self, pool):
        """Return the census of this frame as 32-bit words, packed once a frame."""
        if self._packed is None:
            packed = self._packed = np.empty(self._weights.shape, np.uint32)
            pool.each(lambda band: warp.pack_census(self._left.census, packed, *band[1:]),
                      cut_bands(len(packed)))
        return self._packed

    def _parent(self, state):
        """Return the previous best of a state, moved into this frame, None where all is new."""
        if self._moving.motion is not None:
            cells = self._moving.moved
            self._valid[:] = np.where(cells >= 0, CONSISTENT, INVALID)
            np.rint(np.maximum(cells, 0), out=self._inherited, casting='unsafe')
            np.minimum(self._inherited, state.config.disparities - 1, out=self._inherited)
            return parent_of(self._inherited, self._valid, cell=2)
        return None if (self._choices < 0).all() else parent_of(
            state.own.labels, state.own.validity, choices=self._choices,
            shift=self._averaging.shift)

    def _labels_in_place(self, pool, state, half):
        """Return a state's labels and write their weights; None where no tile is in place."""
        left, bands = self._averaging.tiles[0], self._averaging.parts(pool)
        if self._averaging.noise < QUIET or not self._strengths.any():
            self._clear_weights()
            return None
        labels, validity, shift = state.own.labels, state.own.validity, self._averaging.shift
        if any(shift):
            def move(band):
                for source, outside, moved in zip((labels, validity), (0, OUTSIDE), self._moved):
                    motion.move_map(source, left.choices, *shift, outside, moved, band[1], band[2])
            pool.each(move, bands)
            labels, validity = self._moved
        rows = len(self._trusted)

        def weigh(band):
            half_band = band[0], *(TILE // 2 * tile_row for tile_row in band[1:])
            motion.trusted_cells(labels, validity, half.labels, DISTANCE, self._half_labels,
                                 self._trusted, *widened(half_band, 1, rows))
            half_size_prior.flat(
                self._half_labels, FLAT, self._smooth, *widened(half_band, 0, rows))
            motion.previous_prior(
                self._trusted, self._smooth, WEIGHTS[self._strengths], self._weights, *band[1:])
        self._weighted = True       # first: an interrupt may come
        pool.each(weigh, bands)
        return labels

    def _clear_weights(self):
        if self._weighted:
            self._weights[:] = 0
            self._weighted = False

    def reused_state(self, state, config):
        """
        Return the FrameState of a frame that reuses a result, None where it has to be searched.

        state: the FrameState of the previous frame, or None; config: the MatcherConfig
        """
        if not is_reused(state, self._averaging.choices, config):
            return None
        (pictures, ages, drifts), own = self._averaging.kept, state.own
        return state._replace(pictures=pictures, ages=ages, drifts=drifts,
                              own=own._replace(since_search=own.since_search + 1))

    def keep(self, pool, labels, validity):
        """
        Copy the chromosome that was selected for the next frame, once its match is made.

        labels: (R, C); validity: uint8 (R, C), of them
        """
        self._kept = np.empty_like(labels), np.empty_like(validity)

        def copy(band):
            rows = slice(*band[1:])
            for source, kept in zip((labels, validity), self._kept):
                kept[rows] = source[rows]
        pool.each(copy, pool.parts(len(labels)), reach=0)

    def next_state(self, pool, views, refinement, config, match, before=None):
        """
        Return the FrameState of this frame, with what `keep` copied.

        views: the `Views` of the pair; refinement: the `Refinement` that has made the match;
        config: the MatcherConfig; match: the `Match`; before: the FrameState of the previous frame
        """
        (labels, validity), self._kept = self._kept, None
        cells, *seen = self._seen(pool, before, refinement.fine_labels)
        result = new_result(before, self._averaging.choices, config, match)
        return FrameState(
            *self._averaging.kept, NO_COLOURS, self._moving.state(cells, validity),
            RealtimeState(labels, validity, *seen, *result), views.left_shift, None, 0, config)

    def _seen(self, pool, before, fine):
        """
        Return what the next frame knows of this one where a camera is given.

        before: the FrameState of the previous frame; fine: (R, C), 1 / STEPS of a label.
        Labels of cells, float32 (r, c), then census and survived of the `RealtimeState`.
        """
        moving, (rows, columns) = self._moving, self._half_labels.shape
        if not moving.known:
            return None, *NO_CENSUS
        cells = np.multiply(fine[:2 * rows:2, :2 * columns:2], np.float32(1 / STEPS),
                            dtype=np.float32)
        survived = np.zeros(cells.shape, np.uint8)
        if moving.motion is not None:
            pool.each(lambda band: warp.note_survivors(
                cells, (moving.moved, moving.source), self._moved_weights, before.own.survived,
                survived, *band[1:]), moving.bands)
        return cells, self._census(pool), survived
