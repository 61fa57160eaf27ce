# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A replay cut into segments that can be matched at the same time, wherever there is a processor.

What comes out depends on where the segments begin, and on nothing else: neither on how many
workers there are, nor on which of them dies, nor on whether the replay was interrupted.
"""
from collections import deque
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import DamagedBag
from fuzzy_stereo_ros.pair_matcher import Matched
from fuzzy_stereo_ros.replay.request import WARM_PAIRS
from fuzzy_stereo_ros.replay.source import HELD_BYTES, Step

SEGMENT_PAIRS = 48      # long enough for warming up to cost a sixth, short enough to be held
AHEAD = 2               # segments on their way for each worker: one is matched, one lies ready


class Segment(NamedTuple):
    """Steps in a row: before, lists of those that warm up, and of those that count."""

    before: list
    steps: list

    @property
    def new(self):
        """Return whether any of its pairs was not written before."""
        return any(step.pair is not None and not step.again for step in self.steps)

    def pairs(self):
        """Return (pairs, warming) as a SegmentOrder has them."""
        pairs, warming, went_back = [], 0, False
        for place, step in enumerate([*self.before, *self.steps]):
            went_back |= step.went_back
            if step.pair is not None:
                pairs.append((step.pair, went_back))
                warming += place < len(self.before)
                went_back = False
        return tuple(pairs), warming


def cut(steps):
    """
    Yield the Segments of Steps: SEGMENT_PAIRS numbers each, from a multiple of that on.

    WARM_PAIRS numbers before them warm up. What steps() raises is raised after the last Segment.
    """
    before, own, place, damage = [], [], None, None
    try:
        for step in steps:
            if step.number is not None:
                last, place = place, step.number // SEGMENT_PAIRS
                if last not in (None, place):
                    yield Segment(before, own)
                    first = place * SEGMENT_PAIRS - WARM_PAIRS
                    before = [one for one in (*before, *own)
                              if one.number is not None and one.number >= first]
                    own = []
            own.append(step)
    except DamagedBag as error:
        damage = error
    if own:
        yield Segment(before, own)
    if damage is not None:
        raise damage


class SegmentedReplay:
    """
    What `replay` takes for the source and for the Rig: steps, and what workers made of them.

    The steps come in one thread, which may be another than the one that matches.
    """

    def __init__(self, source, cluster, tally, stopped, copied=()):
        """
        Read nothing yet.

        source: a ReplaySource that copies nothing. cluster: a Cluster. tally: Tally in which
        warming up is counted, segments and workers. stopped(): whether to end early.
        copied: BagMessages to be copied, in their order.
        """
        self._source, self._cluster = source, cluster
        self._tally, self._stopped = tally, stopped
        self._copies, self._answers = CopiesBetween(copied), deque()

    @property
    def synchroniser(self):
        """The Synchroniser of the source."""
        return self._source.synchroniser

    @property
    def resumed(self):
        """Whether the pairs that were done have come, as of the source."""
        return self._source.resumed

    def steps(self):
        """Yield each Step, an empty one when it is stopped; DamagedBag or ClusterFault."""
        segments, asked, damage = cut(self._read()), deque(), None
        while not self._stopped():
            self._tally.workers = max(self._tally.workers, self._cluster.workers)
            while segments is not None and len(asked) < AHEAD * self._cluster.workers:
                try:
                    segment = next(segments, None)
                except DamagedBag as error:
                    segment, damage = None, error
                if segment is None or self._stopped():
                    segments = None
                    break
                asked.append((segment, self._cluster.ask(*segment.pairs())
                              if segment.new else None))
            if not asked:
                break
            yield from self._answered(*asked.popleft())
        if self._stopped():
            yield Step(0)
        elif damage is not None:
            raise damage
        else:
            yield from self._copies.rest()

    def match_pair(self, pair):
        """Return the Matched of the next pair of the steps; ValueError where there is none."""
        answer, (again, warm, milliseconds) = self._answers.popleft()
        self._tally.again += again
        self._tally.warm += warm
        self._tally.milliseconds += milliseconds
        if isinstance(answer, ValueError):
            raise answer
        return Matched(pair, answer, self._cluster.config, None)

    def forget(self):
        """Do nothing: the workers were told which pairs start anew."""

    def _read(self):
        """Yield the Steps of the source until it is stopped."""
        for step in self._source.steps():
            if self._stopped():
                return
            yield step

    def _answered(self, segment, asked):
        """Yield the steps of a segment, the answer to each pair ready for `match_pair`."""
        answers = ()
        if asked is not None:
            answer = self._cluster.answer(asked, self._stopped)
            if answer is None:
                return
            warming, answers = answer.warming, iter(answer.answers)
            self._tally.segments += 1
        for step in segment.steps:
            if asked is None:
                step = step._replace(pair=None)
            elif step.pair is not None:
                self._answers.append((next(answers), warming))
                warming = 0, 0, 0.0
            yield from self._copies.before(step)


class CopiesBetween:
    """Messages to be copied, read when the step comes before which they are written."""

    def __init__(self, messages):
        """Read nothing yet; messages: BagMessages in their order."""
        self._messages, self._damage = iter(messages), None
        self._next, self._begun = None, False

    def before(self, step):
        """Yield the messages up to a Step, in Steps of their own and in itself; DamagedBag."""
        if self._damage is not None:
            raise self._damage
        copies = yield from self._until(step.logged)
        yield step._replace(copies=copies)

    def rest(self):
        """Yield Steps with all other messages; DamagedBag where they cannot be read."""
        copies = yield from self._until(None)
        if copies:
            yield Step(copies[-1].logged, copies=copies)
        if self._damage is not None:
            raise self._damage

    def _until(self, logged):
        """Yield Steps of about HELD_BYTES of messages and return those that are left."""
        copies, size = [], 0
        if not self._begun:
            self._advance()
        while self._next is not None and (logged is None or self._next.logged <= logged):
            message = self._next
            copies.append(message)
            size += len(message.content)
            self._advance()
            if size >= HELD_BYTES:
                yield Step(message.logged, copies=tuple(copies))
                copies, size = [], 0
        return tuple(copies)

    def _advance(self):
        self._begun = True
        try:
            self._next = next(self._messages, None)
        except DamagedBag as error:
            self._next, self._damage = None, error
