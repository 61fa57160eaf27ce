# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Match the pairs of one stereo camera in order; prepare changed parameters meanwhile."""
from concurrent import futures
from dataclasses import replace
import threading
from typing import NamedTuple

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.compiling import on_all_cores
from fuzzy_stereo_ros.matching.match import Camera, Match
from fuzzy_stereo_ros.matching.over_frames.state import FrameState
from fuzzy_stereo_ros.matching.row_alignment import Rows
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair, takes_part
from fuzzy_stereo_ros.program import give_back_memory
import numpy as np

PREPARING, READY, FAILED = 'being prepared', 'from the next pair on', 'cannot be prepared'


class MatchedPair(NamedTuple):
    """A pair and the result of matching it."""

    pair: StereoPair
    match: Match
    config: MatcherConfig  # in pixels of the pair's images
    before: FrameState | None = None  # with which the match started, of PairMatcher
    rows: Rows = Rows()


class PairMatcher:
    """
    Matches one pair after another; a second thread prepares matchers for changed parameters.

    config: the MatcherConfig in use, in pixels of the full image. last: the newest MatchedPair
    before missing pixels are removed, None before the first. change: state of the newest request,
    PREPARING, READY or FAILED, '' if none waits.
    `match` and `warm_up` are for one thread, the other methods for any thread.
    """

    def __init__(self, config, scale=1.0, on_ready=None):
        """Compile nothing; on_ready(config, error): called in the thread that prepares."""
        self.config, self.last, self.change = config, None, ''
        self._scale, self._on_ready = scale, on_ready
        self._matcher, self._shape, self._reset = None, WARM_UP_SIZE, False
        self._lock = threading.Lock()
        self._thread = futures.ThreadPoolExecutor(1, 'preparation')
        self._requested, self._prepared, self._preparing = None, None, []

    def warm_up(self, report=None):
        """Compile or load the kernels, before the first pair; report: see `on_all_cores`."""
        with on_all_cores(report):
            self._matcher = self._warm_matcher(self.config)

    def match(self, pair):
        """Return the MatchedPair of a StereoPair, invalid where pixels are missing; ValueError."""
        with self._lock:
            prepared, self._prepared = self._prepared, None
            if prepared is not None:
                rows = self._matcher.rows       # of the camera, with any parameters
                self.config, self._matcher = prepared
                self._matcher.restore(None, rows)
                self.change = ''
        if self._reset:
            self._reset = False
            self._matcher.reset()
        before, rows, shape = self._matcher.state, self._matcher.rows, pair.left.shape[:2]
        try:
            match = self._matcher.match(pair.left, pair.right, stamp=pair.stamp,
                                        camera=camera_of(pair))
        except ValueError:
            raise
        except Exception:       # noqa: B902  an internal error
            self._matcher.reset()           # it may hold half of this pair
            raise
        self.last = MatchedPair(pair, match, self._matcher.config, before, rows)
        if prepared is not None or shape != self._shape:
            self._shape = shape
            give_back_memory()      # of the previous matcher, or of images of another size
        return self.last._replace(match=without_missing(match, pair.missing))

    def reset(self):
        """Match the next pair without the previous frame."""
        self._reset = True

    def request(self, config):
        """Prepare another MatcherConfig, used by `match` once ready; replaces earlier requests."""
        with self._lock:
            self._requested, self._prepared, self.change = config, None, PREPARING
            self._preparing = [self._thread.submit(self._prepare, config)]

    def close(self, timeout=None):
        """Cancel requests; return whether the preparation ended in time, s."""
        with self._lock:
            self._requested = self._prepared = None
        self._thread.shutdown(wait=False, cancel_futures=True)
        return not futures.wait(self._preparing, timeout).not_done

    def _prepare(self, config):
        if config is not self._requested:
            return      # a newer request came
        prepared, error = None, None
        try:
            prepared = config, self._warm_matcher(config)
        except Exception as problem:    # noqa: B902  the matcher in use stays after any error
            error = problem
        with self._lock:
            if config is not self._requested:
                return
            self._prepared, self.change = prepared, READY if error is None else FAILED
        self._on_ready(config, error)

    def _warm_matcher(self, config):
        matcher = StereoMatcher(config.at_scale(self._scale))
        matcher.warm_up(*self._shape)
        give_back_memory()      # of this warm-up
        return matcher


def camera_of(pair):
    """Return the matcher's Camera for a StereoPair, None for UNCALIBRATED ones."""
    calibration = pair.calibration
    return Camera(*calibration.left, calibration.offset) if calibration.focal else None


def without_missing(match, missing, reference='left'):
    """Return a Match that is invalid where a pixel or its partner in the other view is missing."""
    if missing is None:
        return match
    invalid = takes_part(match.disparity, missing, match.confidence > 0, reference)
    return replace(match, disparity=np.where(invalid, np.float32(np.nan), match.disparity),
                   confidence=np.where(invalid, np.float32(0), match.confidence))
