# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What comes out of bags, in order: pairs to be matched, and messages to be copied before them."""
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import BagMessage, decoded
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, StereoPair
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser

HELD_BYTES = 16 * 2**20     # of messages to be copied that wait for a pair


class Step(NamedTuple):
    """
    What comes next.

    logged: ns, when the last message that led to it was recorded. stamp: ns, of the pair, None
    where there is none; number: which of the selected pairs it is, from 0, likewise.
    pair: the StereoPair, or refusal: the BadPair that says why it is none. went_back: the stamp
    is smaller than that of a pair before. again: the pair was matched and written by a replay
    that is resumed. copies: the BagMessages to be copied before it.
    """

    logged: int
    stamp: int | None = None
    number: int | None = None
    pair: StereoPair | None = None
    refusal: BadPair | None = None
    went_back: bool = False
    again: bool = False
    copies: tuple = ()


class Selection(NamedTuple):
    """
    What of the bags is matched.

    start, stop: ns, when messages were recorded; None is all. every: of so many pairs the first.
    done: (logged, stamp) of the last few pairs that were written before, which are matched again
    so that new ones start warm; those before them are passed over. logged may be None.
    """

    start: int | None = None
    stop: int | None = None
    every: int = 1
    done: tuple = ()


class ReplaySource:
    """
    Reads bags as the node reads topics; in one thread.

    synchroniser: the Synchroniser, whose counts are for everybody to read.
    resumed: whether the pairs that were done have come.
    """

    def __init__(self, bags, topics, read, settings, tolerance, selection, copied=(),
                 infos=None):
        """
        Read nothing yet.

        bags: a BagReader. topics: StereoTopics. read(messages): returns a StereoPair of four.
        settings: queue_size and cache_camera_info, by name. tolerance: as of a Synchroniser.
        copied: names of topics. infos: left and right CameraInfo of all pairs; None where they
        come by their topics.
        """
        self._bags, self._read, self._selection = bags, read, selection
        self._copied, self._infos = set(copied), infos
        queued, self._held = topics, ()
        if infos is not None:
            queued = topics.left, topics.right
        elif settings['cache_camera_info']:
            self._held = topics.left_info, topics.right_info
        self.synchroniser = Synchroniser(queued, settings['queue_size'], tolerance, self._held)
        self._passed, self._went_back = 0, False
        self._waiting, self.resumed = bool(selection.done), not selection.done

    def steps(self):
        """Yield each Step; DamagedBag where a bag can be read no further."""
        copies, size, logged = [], 0, self._bags.begin
        for logged, event in self._events():
            if isinstance(event, BagMessage):
                copies.append(event)
                size += len(event.content)
                if size < HELD_BYTES:
                    continue
                step = Step(logged)
            elif isinstance(event, BadPair):
                step = Step(logged, refusal=event)
            else:
                step = self._step(logged, event)
                if step is None:
                    continue
            yield step._replace(copies=tuple(copies))
            copies, size = [], 0
        self.synchroniser.clear()
        yield Step(logged, copies=tuple(copies))

    def _events(self):
        """Yield (logged, BagMessage to be copied, or MatchedSet, or BadPair)."""
        logged, add = self._bags.begin, self.synchroniser.add
        self._add_held()
        wanted = self._copied.union(self.synchroniser.topics)
        for message in self._bags.messages(wanted, self._selection.start, self._selection.stop):
            logged = message.logged
            if message.topic in self._copied:
                yield logged, message
            if message.topic not in self.synchroniser.topics:
                continue
            try:
                content = decoded(message)
            except BadPair as bad:
                yield logged, bad
                continue
            for found in add(message.topic, stamp_of(content.header), content):
                yield logged, found
        for found in self.synchroniser.finish():
            yield logged, found

    def _add_held(self):
        """Let the newest of what is held be there when it begins in the middle of the bags."""
        for topic in self._held if self._selection.start is not None else ():
            newest = self._bags.newest(topic, self._selection.start)
            if newest is not None:
                content = decoded(newest)
                self.synchroniser.add(topic, stamp_of(content.header), content)

    def _step(self, logged, found):
        """Return the Step of a set; None where it is not selected."""
        number, rest = divmod(self._passed, self._selection.every)
        self._passed += 1
        self._went_back |= found.went_back
        if rest:
            return None
        again = not self.resumed
        if again:
            first, last = self._selection.done[0], self._selection.done[-1]
            self._waiting = self._waiting and not _is(first, logged, found.stamp)
            self.resumed = not self._waiting and _is(last, logged, found.stamp)
            if self._waiting:
                return None
        step = Step(logged, found.stamp, number, went_back=self._went_back, again=again)
        self._went_back = False
        try:
            return step._replace(pair=self._read(self._four(found.messages)))
        except BadPair as bad:
            return step._replace(refusal=bad)

    def _four(self, messages):
        """Return images and CameraInfo of a set, which may have only images."""
        if self._infos is None:
            return messages
        return messages[0], self._infos[0], messages[1], self._infos[1]


def _is(done, logged, stamp):
    """Return whether a pair is one that was done."""
    return done[1] == stamp and done[0] in (None, logged)
