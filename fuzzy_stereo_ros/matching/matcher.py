# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""StereoMatcher: matches pairs one after the other with the algorithm of a profile."""
from dataclasses import replace
from functools import cache
import numbers
import threading
import time

import cv2
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Budget, Random
from fuzzy_stereo_ros.matching.kernels.compiled import expect
from fuzzy_stereo_ros.matching.match import Camera, mirrored
from fuzzy_stereo_ros.matching.out_of_range import EXTRA_LABELS, reject_beyond, searched
from fuzzy_stereo_ros.matching.paper.matcher import PaperMatcher
from fuzzy_stereo_ros.matching.quality.matcher import QualityMatcher
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
from fuzzy_stereo_ros.matching.row_alignment import rig_of, RowAlignment, Rows
import numpy as np

WARM_UP_SIZE = 64, 96       # rows, columns; the kernels are the same for all sizes
WARM_UP_MOTIONS = 0, 4, 8   # px; a moving picture needs further kernels
WARM_UP_FRAMES = 16         # of a still scene with noise, for the evolution of planes
FEWEST_ROWS, FEWEST_COLUMNS = 2, 2
MOST_PIXELS = 2**30     # kernels number pixels with 32 bits
MOST_SIDE = 2**16       # kernels number rows and columns at half size with 15 and 16 bits
ALGORITHMS = {'realtime': RealtimeMatcher, 'quality': QualityMatcher, 'paper': PaperMatcher}


class StereoMatcher:
    """
    Matches pairs one after the other, each warm-started with the previous one.

    algorithm: the matcher of the profile for the size of the last pair, with its `population` and
    `possibility_of`; None before the first. state: the `FrameState` after the last pair, or
    None; rows: the `Rows` of the rig.
    """

    def __init__(self, config='realtime', stages=None, **changes):
        """
        Create a matcher; it allocates its memory at the first pair.

        config: the name of a profile, as 'realtime', 'fast' or 'quality', or a MatcherConfig.
        stages: the `Stages` of the profile with some of them exchanged; None for its own.
        changes: of the config, as disparities=96; help(MatcherConfig) names all.
        Raises ValueError for a profile, a parameter or a value that is not allowed.
        """
        self.config = MatcherConfig.from_profile(config, **changes)
        self._stages, self._alignment = stages, RowAlignment(self.config)
        self.algorithm, self._shape, self._lock = None, None, threading.RLock()
        self.restore(None)

    def match(self, left, right, stamp=None, observe=None, camera=None):
        """
        Match a rectified pair and return its `Match`.

        It holds, among others, disparity: float32 (R, C), px of the reference image, NaN =
        invalid; x of the left pixel less x of the right one, more where it is near. confidence:
        float32 (R, C), 0 to 1. times: {stage: ms}, with `total`. Its depth(camera) is
        float32 (R, C), metres, NaN = invalid.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR, of one size and dtype.
        stamp: int ns, of the pair; None counts pairs as consecutive.
        observe: called after each generation with its number and the genes (P, R, C), which count
        from min_disparity and are mirrored where the reference is the right image.
        camera: the `Camera` of the left image, by which a camera that moves is followed; None
        where it is not known.
        Threads that call it wait for each other. Raises ValueError, with a sentence that says why,
        for a pair that cannot be matched.
        """
        with self._lock:        # kernels write into its memory
            return self._match(left, right, stamp, observe, camera)

    def _match(self, left, right, stamp, observe, camera):
        started = time.perf_counter_ns()
        left, right = checked_pair(left, right, self.config)
        stamp, rig = checked_stamp(stamp), rig_of(left, camera, self.config.reference)
        if self.config.reference == 'right':
            left, right = mirrored(right), mirrored(left)
            camera = camera and camera.mirrored_right(left.shape[1])
        shape = left.shape[:2]
        wider = searched(self.config, shape[1])
        algorithm, aligning = self._algorithm_of(shape, wider), time.perf_counter_ns()
        algorithm.pool.begin_frame()
        aligned, rows = self._alignment.align(algorithm.pool, self.rows, left, right, rig)
        align_ms = (time.perf_counter_ns() - aligning) / 1e6
        previous = self._previous(shape, stamp)
        frame = previous.frame + 1 if previous is not None and stamp is None else 0
        match, state = algorithm.match(
            left, aligned, previous, Random((self.config.seed, frame if stamp is None else stamp)),
            Budget(self.config.generations, self.config.deadline_ms, started), observe, camera)
        self.state = state and state._replace(stamp=stamp, frame=frame, config=self.config)
        beyond = reject_beyond(algorithm.pool, self.config, wider.disparities, match)
        match.times['rows'] = align_ms
        match = replace(match, **beyond, misalignment=self._watch(rows, left, right, match))
        if not self.config.fill and self.config.fill_holes:
            reject_wide_holes(self.config, match)
        if self.config.reference == 'right':
            match = replace(match, disparity=mirrored(match.disparity),
                            confidence=mirrored(match.confidence))
        match.times['total'] = (time.perf_counter_ns() - started) / 1e6
        return match

    def __reduce__(self):
        """Return what makes a copy, which continues after the same state, in memory of its own."""
        return StereoMatcher, (self.config, self._stages), (self.state, self.rows)

    def __setstate__(self, found):
        """Continue after the state and the rows that a copy gets."""
        self.restore(*found)

    def reset(self):
        """Forget all previous frames, but not the rows of the rig."""
        self.state = None

    def restore(self, state, rows=None):
        """Continue after the `state` and the `rows` of a matcher of the same configuration."""
        self.state, self.rows = state, Rows() if rows is None else rows

    def warm_up(self, rows, columns):
        """Compile or load the kernels, once a configuration, and take memory for a size."""
        check_size(rows, columns)
        match_warm_up_pairs(self.config)
        with self._lock:
            algorithm = self._algorithm_of((rows, columns), searched(self.config, columns))
            if self.state is None and self.config.disparities <= columns:
                # The system maps memory at the first write: now, not in the first frame.
                blank, random = np.zeros((rows, columns), np.uint8), Random((self.config.seed, 0))
                algorithm.match(blank, blank, None, random, Budget(0, 0, 0))

    def _watch(self, rows, left, right, match):
        """Reject what is from beyond the image; return the Misalignment of rows, or None."""
        index, nearest = self._alignment.nearest_seen(rows, left.shape[:2])
        if len(nearest):
            hidden = nearest != np.arange(len(left))[index, None]
            match.confidence[index] = np.where(hidden, np.float32(0), match.confidence[index])
            match.disparity[index] = (
                match.disparity[nearest, np.arange(left.shape[1])]
                if self.config.fill or self.config.fill_holes
                else np.where(hidden, np.float32(np.nan), match.disparity[index]))
        started = time.perf_counter_ns()
        self.rows = rows if match.reused else self._alignment.watch(rows, left, right, match)
        match.times['rows'] += (time.perf_counter_ns() - started) / 1e6
        measured = self._alignment.measured(self.rows, left.shape[:2])
        if measured is not None:
            measured = measured._replace(undone=bool(rows.undone.any()))
            if self.config.reference == 'right':
                measured = measured.of_the_right()
        return measured

    def _previous(self, shape, stamp):
        """Return the state of the previous frame if this pair may start from it, else None."""
        if (self.state is None or not self.config.warm_start
                or not self.state.fits(shape, self.config, stamp)):
            return None
        return self.state.before(stamp)._replace(config=searched(self.state.config, shape[1]))

    def _algorithm_of(self, shape, config):
        """Return the algorithm for an image size, by a config; a new one when the size changes."""
        if shape != self._shape:
            self.algorithm, self._shape = None, None   # frees the memory of the old one first
            expect(self.config)
            kind = ALGORITHMS[self.config.algorithm]
            self.algorithm = kind(config, *shape, self._stages)
            self._shape = shape
        return self.algorithm


def reject_wide_holes(config, match):
    """Let 4-connected regions of more than fill_holes rejected pixels of a Match be invalid."""
    _, regions, facts, _ = cv2.connectedComponentsWithStats(
        config.rejects(match.confidence).view(np.uint8), connectivity=4)
    wide = facts[:, cv2.CC_STAT_AREA] > config.fill_holes
    wide[0] = False     # what is not rejected
    match.disparity[wide[regions]] = np.nan


def warm_up_camera(image):
    """Return a camera that has moved, for an image of a warm-up."""
    rows, columns = image.shape[:2]
    return Camera(columns, columns, (columns - 1) / 2, (rows - 1) / 2,
                  moved=(np.eye(3), np.array((0.0, 0.0, -0.1))))


@cache
def match_warm_up_pairs(config):
    """Call all kernels of a MatcherConfig; a second call for an equal one does nothing."""
    for matcher, left, right in warm_up_pairs(config):
        matcher.match(left, right, camera=warm_up_camera(left))


def warm_up_pairs(config):
    """Yield (matcher, left, right): small pairs, whose matching calls all kernels of a config."""
    small = replace(config, warm_start=True, deadline_ms=0.0,
                    population=min(config.population, 4), generations=min(config.generations, 2))
    scene = _moving_scene(WARM_UP_SIZE[0], max(WARM_UP_SIZE[1], config.disparities + EXTRA_LABELS))
    for kind in (np.uint8, np.uint16):
        for channels in (1, 3):
            matcher = StereoMatcher(small)
            if channels == 1:       # those of colour search for the rows
                rig = rig_of(scene[0], warm_up_camera(scene[0]), small.reference)
                matcher.restore(None, Rows(undone=np.array([0.5, 0, 0, 0]), pair=1, rig=rig))
            for picture in scene:
                image = np.squeeze(np.stack([picture.astype(kind)] * channels, -1))
                yield matcher, image, image
    if small.algorithm == 'realtime':
        matcher = StereoMatcher(small)
        for left, right in _still_frames(scene[0]):
            yield matcher, left, right


def _moving_scene(rows, columns):
    """Return uint8 pictures (R, C) of blobs that move to the right, each with other noise."""
    random = np.random.default_rng(0)
    blobs = cv2.GaussianBlur(random.normal(size=(rows, columns)), None, 2.0)
    blobs = np.interp(blobs, (blobs.min(), blobs.max()), (20, 235))
    return [(np.roll(blobs, moved, axis=1) + random.normal(size=blobs.shape)).astype(np.uint8)
            for moved in WARM_UP_MOTIONS]


def _still_frames(picture):
    """
    Yield noisy pairs of a still scene with a plain wall, of another, and of a wall: uint8 (R, C).

    The views of the last wall have nothing in common, so that it votes.
    """
    rows, columns = picture.shape
    scene = picture.astype(np.float32)
    scene[rows // 4:, columns // 4:-columns // 8] = 120
    random = np.random.default_rng(0)
    for number in range(WARM_UP_FRAMES + 1):
        if number == WARM_UP_FRAMES:
            scene = 255 - scene     # a new scene: the camera is followed
        noisy = scene + random.normal(0, 1.5, (2, rows, columns))
        yield np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    yield [np.rint(120 + cv2.GaussianBlur(random.normal(0, 9, picture.shape), None, 2)).astype(
        np.uint8) for _ in range(2)]


def checked_pair(left, right, config):
    """Return two images, (R, C) or (R, C, 3) of 8 or 16 bits, contiguous and alike; ValueError."""
    images = []
    for name, image in (('left', left), ('right', right)):
        if not isinstance(image, np.ndarray):
            raise ValueError(f'the {name} image is a {type(image).__name__}; '
                             'give a NumPy array of uint8 or uint16')
        if image.ndim not in (2, 3) or image.ndim == 3 and image.shape[2] not in (1, 3):
            raise ValueError(f'the {name} image has the shape {image.shape}; '
                             'allowed are (rows, columns) and (rows, columns, 3)')
        if image.dtype not in (np.uint8, np.uint16):
            raise ValueError(f'the {name} image is {image.dtype}; allowed are uint8 and uint16')
        images.append(image[..., 0] if image.ndim == 3 and image.shape[2] == 1 else image)
    left, right = images
    if left.shape[:2] != right.shape[:2]:
        raise ValueError(
            f'the left image is {_size(left)}, the right one {_size(right)}; '
            'give two rectified images of one size')
    if left.dtype != right.dtype:
        raise ValueError(f'the left image is {left.dtype}, the right one {right.dtype}; '
                         'give two images of one depth')
    rows, columns = left.shape[:2]
    check_size(rows, columns)
    if config.disparities > columns:
        raise ValueError(
            f'{config.disparities} disparities are more than the {columns} columns of the images; '
            'ask for fewer disparities or give larger images')
    if left.ndim != right.ndim:
        left, right = _grey(left), _grey(right)
    return np.ascontiguousarray(left), np.ascontiguousarray(right)


def check_size(rows, columns):
    """Raise ValueError where images of a size are smaller or larger than kernels can take."""
    if rows < FEWEST_ROWS or columns < FEWEST_COLUMNS:
        raise ValueError(f'the images are {columns} x {rows}; '
                         f'at least {FEWEST_COLUMNS} x {FEWEST_ROWS} pixels are needed')
    if rows * columns > MOST_PIXELS or max(rows, columns) > MOST_SIDE:
        raise ValueError(f'the images are {columns} x {rows}; at most {MOST_PIXELS} pixels, and '
                         f'{MOST_SIDE} a side, are allowed')


def checked_stamp(stamp):
    """Return a stamp as an int, ns, or None as it is; ValueError for what is neither."""
    if stamp is None:
        return None
    if not isinstance(stamp, numbers.Integral):
        raise ValueError(f'the stamp is {stamp!r}; allowed are whole numbers of ns, and None')
    return int(stamp)


def _size(image):
    return f'{image.shape[1]} x {image.shape[0]}'


def _grey(image):
    """Return (B + 2 G + R) / 4 of a colour image, in its own dtype; a grey one as it is."""
    if image.ndim == 2:
        return image
    weighted = image.astype(np.uint32) @ np.array([1, 2, 1], np.uint32)
    return ((weighted + 2) >> 2).astype(image.dtype)
