# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What matches the pairs of one rig: a reader, a matcher, and changes prepared beside them."""
from typing import NamedTuple

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.realtime.warm_start import FrameState
from fuzzy_stereo_ros.memory import give_back_memory
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.preparation import Preparation


class Matched(NamedTuple):
    """
    A pair and what came of it.

    config: the MatcherConfig of the images as they were matched, reduced in scale.
    before: the FrameState it was matched from, None where there was none.
    """

    pair: StereoPair
    match: Match
    config: MatcherConfig
    before: FrameState | None


class Rig:
    """
    Matches one pair after the other.

    All but `match`, `match_pair` and `warm_up` may be called by any thread.
    config: the MatcherConfig in use, in pixels of the full image. last: the newest Matched, None
    before the first.
    """

    def __init__(self, config, reader, told):
        """
        Prepare nothing yet.

        config: a MatcherConfig. reader: a PairReader. told(config, error): called in a thread of
        its own when another configuration is prepared, with None, or cannot be, with why.
        """
        self.config, self.last = config, None
        self._reader, self._matcher = reader, None
        self._shape, self._forget = WARM_UP_SIZE, False
        self._preparation = Preparation(self._prepare, told)

    @property
    def state_of_change(self):
        """Where a change of configuration is, as of a Preparation: '' where there is none."""
        return self._preparation.state

    def warm_up(self):
        """Compile the kernels or load them from the cache."""
        self.config, self._matcher = self._prepare(self.config)

    def use(self, config):
        """Match with another MatcherConfig once its kernels and its memory are there."""
        self._preparation.ask(config)

    def forget(self):
        """Match the next pair without what was before it."""
        self._forget = True

    def match(self, messages):
        """
        Return what came of four messages: images and their CameraInfo, left and right, a Matched.

        Raises ValueError, as BadPair with a reason, where they cannot be matched.
        """
        return self.match_pair(self.read(messages))

    def read(self, messages):
        """
        Return the StereoPair of four messages; in one thread, which may be another than matches.

        Raises BadPair where they cannot be matched.
        """
        return self._reader.read(*messages)

    def match_pair(self, pair):
        """Return what came of a StereoPair, a Matched; ValueError where it cannot be matched."""
        made = self._preparation.take()
        if made is not None:
            self.config, self._matcher = made
        if self._forget:
            self._forget = False
            self._matcher.reset()
        before, shape = self._matcher.state, pair.left.shape[:2]
        match = self._matcher.match(pair.left, pair.right, stamp=pair.stamp)
        self.last = Matched(pair, match, self._matcher.config, before)
        if made is not None or shape != self._shape:
            self._shape = shape
            give_back_memory()      # of the matcher before, or of its images of another size
        return self.last

    def close(self, timeout=None):
        """End what is being prepared; return whether it has ended within the timeout in s."""
        return self._preparation.close(timeout)

    def _prepare(self, config):
        matcher = StereoMatcher(config.at_scale(self._reader.scale))
        matcher.warm_up(*self._shape)
        give_back_memory()      # of this warm-up
        return config, matcher
