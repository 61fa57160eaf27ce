# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bring messages of several topics together by their stamps, live and from a bag alike."""
from typing import NamedTuple

WAIT = 'wait'
FEWEST_JOINED = 2       # messages of a queue in which nearest stamps are found


class MatchedSet(NamedTuple):
    """
    One message of every topic, of one moment.

    stamp: ns, of the first topic's message. messages: in the order of the topics.
    spread: ns between the earliest and the latest stamp.
    went_back: the stamp is smaller than that of the set before, as when a bag starts again.
    """

    stamp: int
    messages: tuple
    spread: int
    went_back: bool


class Synchroniser:
    """
    Queues by topic; a set comes out as soon as it is certain, and what is older is let go.

    With tolerance None the stamps of a set are equal. Otherwise every message of the first topic
    is joined with the nearest of each other topic, where the two are each other's nearest and no
    further apart than the tolerance. It is certain only when the next message is known, unless
    stamps are equal: a set then comes out one message later. In both cases the sets depend on
    the stamps alone, not on how the topics' messages interleave, while no queue overflows.

    A stamp that goes back empties the queue of its topic: one topic after the other starts anew.
    Of held topics, as those of static calibrations, the newest message is in every set, whatever
    its stamp; before each has one, no set comes out.
    """

    def __init__(self, topics, queue_size=5, tolerance=None, held=()):
        """
        Make empty queues.

        topics: names; held: those of them that are held, not the first.
        queue_size: messages kept waiting by topic, >= 1; with a tolerance `FEWEST_JOINED` or more.
        tolerance: ns, 0 = any distance, None = equal stamps only.
        """
        self.topics = tuple(topics)
        self.received = dict.fromkeys(self.topics, 0)
        self.unmatched = dict.fromkeys(self.topics, 0)
        self.matched = 0
        self.jumps_back = 0
        self._queue_size = queue_size if tolerance is None else max(queue_size, FEWEST_JOINED)
        self._tolerance = tolerance
        self._held = dict.fromkeys(held)
        self._queued = [topic for topic in self.topics if topic not in self._held]
        self._queues = {topic: {} for topic in self._queued}    # stamp: message, stamps ascend
        self.latest = dict.fromkeys(self._queued)
        self._last_set = None

    def add(self, topic, stamp, message):
        """Take a message with its stamp in ns and return the list of sets it completes."""
        self.received[topic] += 1
        if topic in self._held:
            complete, self._held[topic] = self._complete(), message
            return [] if complete or not self._complete() else self._due()
        queue = self._queues[topic]
        if self.latest[topic] is not None and stamp < self.latest[topic]:
            self._let_go(topic, list(queue))
        self.latest[topic] = stamp
        if stamp in queue:
            self._let_go(topic, [stamp])
        queue[stamp] = message
        if len(queue) > self._queue_size:
            self._let_go(topic, [next(iter(queue))])
        return self._due([stamp])

    def finish(self):
        """Return the list of sets that waited for a next message, when no more will come."""
        return self._due(final=True)

    def clear(self):
        """Let go of all that waits; the counts stay."""
        for topic, queue in self._queues.items():
            self._let_go(topic, list(queue))

    def waiting(self, topic):
        """Return how many messages of a topic, which is not held, wait for the others."""
        return len(self._queues[topic])

    def holds(self, topic):
        """Return whether a topic is held and has a message."""
        return self._held.get(topic) is not None

    def difference(self):
        """Return the ns between the latest stamps of two topics at most; None before two came."""
        stamps = [stamp for stamp in self.latest.values() if stamp is not None]
        return max(stamps) - min(stamps) if len(stamps) > 1 else None

    def _complete(self):
        return None not in self._held.values()

    def _due(self, stamps=None, final=False):
        """Return the sets that are certain; stamps: those that may have become so, None = all."""
        if not self._complete():
            return []
        if self._tolerance is not None:
            return self._nearest(final)
        if stamps is None:
            stamps = list(self._queues[self.topics[0]])
        return [self._take([stamp] * len(self._queued)) for stamp in stamps
                if all(stamp in queue for queue in self._queues.values())]

    def _nearest(self, final):
        sets = []
        while self._queues[self.topics[0]]:
            pivot, *later = self._queues[self.topics[0]]
            chosen = [pivot] + [
                _join(pivot, later[0] if later else None, list(self._queues[topic]),
                      self._tolerance, final) for topic in self._queued[1:]]
            if WAIT in chosen and None not in chosen:
                break
            if None in chosen:
                self._let_go(self.topics[0], [pivot])
            else:
                sets.append(self._take(chosen))
        return sets

    def _take(self, stamps):
        """Remove a set from the queues, let go what is older, and return the set."""
        messages = dict(self._held)
        for topic, stamp in zip(self._queued, stamps):
            messages[topic] = self._queues[topic].pop(stamp)
            self._let_go(topic, [older for older in self._queues[topic] if older < stamp])
        went_back = self._last_set is not None and stamps[0] < self._last_set
        self._last_set = stamps[0]
        self.matched += 1
        self.jumps_back += went_back
        return MatchedSet(stamps[0], tuple(messages[topic] for topic in self.topics),
                          max(stamps) - min(stamps), went_back)

    def _let_go(self, topic, stamps):
        for stamp in stamps:
            del self._queues[topic][stamp]
        self.unmatched[topic] += len(stamps)


def _join(pivot, following, stamps, tolerance, final):
    """
    Return the stamp to join to the pivot, None where there is none, WAIT where one may come.

    following: the first topic's stamp after the pivot, None while unknown; stamps: another
    topic's, ascending; tolerance: ns, 0 = any distance; final: nothing more will come.
    """
    before = max((stamp for stamp in stamps if stamp <= pivot), default=None)
    after = min((stamp for stamp in stamps if stamp >= pivot), default=None)
    if after is None and not final:
        return WAIT
    if after is not None and after > pivot and (
            before is None or after - pivot < pivot - before):
        if following is None and not final:
            return WAIT
        taken = following is not None and abs(following - after) < after - pivot
        nearest = before if taken else after
    else:
        nearest = before
    if nearest is None or (tolerance and abs(nearest - pivot) > tolerance):
        return None
    return nearest
