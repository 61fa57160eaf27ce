# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Match the pairs of one stereo camera in order, while changed parameters are prepared."""
from concurrent import futures
from dataclasses import replace
from functools import partial
import threading
from typing import NamedTuple

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.compiling import warm_up
from fuzzy_stereo_ros.matching.match import Camera, Match
from fuzzy_stereo_ros.matching.realtime.warm_start import FrameState
from fuzzy_stereo_ros.memory import give_back_memory
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
import numpy as np

PREPARING, READY, FAILED = 'being prepared', 'from the next pair on', 'cannot be prepared'


class MatchedPair(NamedTuple):
    """
    A pair and the result of matching it.

    config: the MatcherConfig of the images as they were matched, reduced in scale.
    before: the FrameState it was matched from, None where there was none.
    """

    pair: StereoPair
    match: Match
    config: MatcherConfig
    before: FrameState | None


class PairMatcher:
    """
    Matches one pair after the other; another thread prepares a matcher for changed parameters.

    config: the MatcherConfig in use, in pixels of the full image. last: the newest MatchedPair,
    as the matcher gave it, None before the first. change: '' where no change of config waits,
    else PREPARING, READY or FAILED. All but `match` and `warm_up` may be called by any thread.
    """

    def __init__(self, config, scale=1.0, on_ready=None):
        """
        Compile nothing yet.

        config: a MatcherConfig. scale: of the images, see PairReader. on_ready(config, error):
        called in a thread of its own when a requested config is prepared, with None, or cannot
        be, with the exception.
        """
        self.config, self.last, self.change = config, None, ''
        self._scale, self._on_ready = scale, on_ready
        self._matcher, self._shape, self._reset = None, WARM_UP_SIZE, False
        self._lock = threading.Lock()
        self._thread = futures.ThreadPoolExecutor(1, 'preparation')
        self._requested, self._prepared, self._preparing = None, None, []

    def warm_up(self, report=None):
        """
        Compile the kernels or load them; in the thread that matches, before the first pair.

        report: see `compiling.warm_up`.
        """
        self._matcher = self._warm_matcher(self.config, partial(warm_up, report=report))

    def match(self, pair):
        """
        Return the MatchedPair of a StereoPair; ValueError where it cannot be matched.

        What a pixel outside of a raw image takes part in is invalid.
        """
        with self._lock:
            prepared, self._prepared = self._prepared, None
            if prepared is not None:
                self.config, self._matcher = prepared
                self.change = ''
        if self._reset:
            self._reset = False
            self._matcher.reset()
        before, shape = self._matcher.state, pair.left.shape[:2]
        match = self._matcher.match(pair.left, pair.right, stamp=pair.stamp,
                                    camera=camera_of(pair))
        self.last = MatchedPair(pair, match, self._matcher.config, before)
        if prepared is not None or shape != self._shape:
            self._shape = shape
            give_back_memory()      # of the matcher before, or of its images of another size
        return self.last._replace(match=without_missing(match, pair.missing))

    def reset(self):
        """Match the next pair without the previous frame."""
        self._reset = True

    def request(self, config):
        """Match with another MatcherConfig once it is prepared; replaces earlier requests."""
        with self._lock:
            self._requested, self._prepared, self.change = config, None, PREPARING
            self._preparing = [self._thread.submit(self._prepare, config)]

    def close(self, timeout=None):
        """
        Cancel requests; return whether nothing is being prepared any more.

        timeout: s to wait for what is being prepared; None = until done.
        """
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
        except Exception as problem:    # noqa: B902  the matcher in use goes on, whatever it is
            error = problem
        with self._lock:
            if config is not self._requested:
                return
            self._prepared, self.change = prepared, READY if error is None else FAILED
        self._on_ready(config, error)

    def _warm_matcher(self, config, warm_up=None):
        """Return a StereoMatcher after warm_up(it, rows, columns), its own if none."""
        matcher = StereoMatcher(config.at_scale(self._scale))
        (warm_up or type(matcher).warm_up)(matcher, *self._shape)
        give_back_memory()      # of this warm-up
        return matcher


def camera_of(pair):
    """Return the Camera of a StereoPair, as the matcher takes it."""
    return Camera(*pair.calibration.left, pair.calibration.offset)


def without_missing(match, missing):
    """Return a Match, invalid where the left pixel or the right one that it matches is missing."""
    if missing is None:
        return match
    left, right = missing
    columns = np.arange(left.shape[1])
    matched = np.isfinite(match.disparity) & (match.confidence > 0)     # not filled
    other = columns - np.rint(np.where(matched, match.disparity, 0)).astype(np.intp)
    seen = np.take_along_axis(right, np.clip(other, 0, columns[-1]), axis=1)
    invalid = left | (matched & seen)
    return replace(match, disparity=np.where(invalid, np.float32(np.nan), match.disparity),
                   confidence=np.where(invalid, np.float32(0), match.confidence))
