# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One matcher: a pair goes in, a disparity comes out, and the best chromosome is kept."""
from dataclasses import dataclass, replace
import time

import cv2
from fuzzy_stereo_ros.matching.checks import check_size, checked_pair, checked_stamp
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Budget, evolve
from fuzzy_stereo_ros.matching.paper_search import PaperSearch
from fuzzy_stereo_ros.matching.quality.matcher import ThoroughSearch
from fuzzy_stereo_ros.matching.realtime.matcher import GuidedSearch
import numpy as np

WARM_UP_SIZE = 64, 96       # rows, columns; the kernels are the same for all sizes
WARM_UP_MOTIONS = 0, 4, 8   # px; a picture that moves needs kernels which others do not
SEARCHES = {'guided': GuidedSearch, 'thorough': ThoroughSearch, 'paper': PaperSearch}


@dataclass(frozen=True)
class Match:
    """
    What came of a pair.

    disparity: float32 (R, C), pixels of the reference image, NaN = invalid.
    confidence: float32 (R, C), 0 to 1, from possibility; 0 where refused or filled.
    history: a `Generation` for each that ran; times: milliseconds by stage, and `total`.
    warm: whether the previous best took part; generations: how many ran.
    """

    disparity: np.ndarray
    confidence: np.ndarray
    history: list
    times: dict
    warm: bool

    @property
    def generations(self):
        """How many generations ran."""
        return len(self.history)


class StereoMatcher:
    """
    Matches pairs one after the other, each warm-started with the last.

    search: what evolved the last pair, to be looked into; None before the first.
    """

    def __init__(self, config=None, search_type=None):
        """
        Prepare for pairs; memory is taken when the first one comes.

        config: a MatcherConfig; the profile `realtime` if none. search_type: class of the search,
        that of the configuration if none.
        """
        self.config = config or MatcherConfig()
        self._search_type = search_type or SEARCHES[self.config.search]
        self.search, self._shape = None, None
        self.reset()

    def match(self, left, right, stamp=None, observe=None):
        """
        Match a rectified pair.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR, of one size and dtype.
        stamp: int ns, of the pair; None counts pairs as consecutive.
        observe: called with generation number and population (P, R, C) after each generation,
        genes from 0 for min_disparity, mirrored where the reference is the right image; `search`
        tells the fitness and, by `possibility_of`, how possible a chromosome is.
        Raises ValueError, with a sentence that says why, for what is no such pair.
        """
        started = time.perf_counter_ns()
        left, right = checked_pair(left, right, self.config)
        stamp = checked_stamp(stamp)
        if self.config.reference == 'right':
            left, right = _mirrored(right), _mirrored(left)
        state = self._previous(left.shape[:2], stamp)
        frame = state.frame + 1 if state is not None and stamp is None else 0
        search = self._search_of(left.shape[:2])
        search.start(left, right, state, (self.config.seed, frame if stamp is None else stamp))
        budget = Budget(self.config.generations, self.config.deadline_ms, started)
        history = evolve(search, budget, observe)
        disparity, confidence = (np.empty(left.shape[:2], np.float32) for _ in range(2))
        self.state = search.finish(stamp, frame, disparity, confidence)
        if self.config.reference == 'right':
            disparity, confidence = _mirrored(disparity), _mirrored(confidence)
        times = dict(search.times, total=(time.perf_counter_ns() - started) / 1e6)
        return Match(disparity, confidence, history, times, search.warm)

    def reset(self):
        """Forget the previous frame."""
        self.state = None

    def restore(self, state):
        """Take a `state` of a matcher of the same configuration as the previous frame."""
        self.state = state

    def warm_up(self, rows, columns):
        """
        Compile the kernels, or load them from the cache, and take memory for images of a size.

        Every kind of image is matched, cold and warm, on a matcher that is thrown away.
        Raises ValueError for a size that cannot be matched.
        """
        check_size(rows, columns)
        small = replace(self.config, warm_start=True, deadline_ms=0.0,
                        population=min(self.config.population, 4),
                        generations=min(self.config.generations, 2))
        columns_for_all = max(WARM_UP_SIZE[1], self.config.disparities)
        scene = _moving_scene(WARM_UP_SIZE[0], columns_for_all)
        for kind in (np.uint8, np.uint16):
            for channels in (1, 3):
                matcher = StereoMatcher(small)
                for picture in scene:
                    image = np.squeeze(np.stack([picture.astype(kind)] * channels, -1))
                    matcher.match(image, image)
        search = self._search_of((rows, columns))
        if self.state is None and self.config.disparities <= columns:
            # The system gives memory when it is written to: not in the first frame.
            blank = np.zeros((rows, columns), np.uint8)
            search.start(blank, blank, None, (self.config.seed, 0))

    def _previous(self, shape, stamp):
        """Return the previous frame's state where this pair may start from it, else None."""
        if (self.state is None or not self.config.warm_start
                or not self.state.fits(shape, self.config, stamp)):
            return None
        return self.state

    def _search_of(self, shape):
        """Return the search of an image size, made anew when the size changes."""
        if shape != self._shape:
            self.search, self._shape = None, None   # two need not be in memory at a time
            self.search = self._search_type(self.config, *shape)
            self._shape = shape
        return self.search


def _moving_scene(rows, columns):
    """Return uint8 pictures (R, C) of blots that move to the right, each with noise of its own."""
    chance = np.random.default_rng(0)
    blots = cv2.GaussianBlur(chance.normal(size=(rows, columns)), None, 2.0)
    blots = np.interp(blots, (blots.min(), blots.max()), (20, 235))
    return [(np.roll(blots, moved, axis=1) + chance.normal(size=blots.shape)).astype(np.uint8)
            for moved in WARM_UP_MOTIONS]


def _mirrored(image):
    return np.ascontiguousarray(image[:, ::-1])
