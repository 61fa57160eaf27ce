# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Match messages of several topics by their stamps, live and from a bag alike."""
from typing import NamedTuple

WAIT = 'wait'
SMALLEST_QUEUE = 2      # messages of a topic among which the nearest stamp can be found


class MatchedSet(NamedTuple):
    """One message of every topic, with matching stamps."""

    stamp: int          # ns, of the first topic's message
    messages: tuple     # in the order of the topics
    spread: int         # ns between the earliest and the latest stamp
    went_back: bool     # the stamp is less than that of the previous set, as when a bag loops


class Synchroniser:
    """
    A queue for each topic; returns a set as soon as it is certain, and drops older messages.

    With tolerance None the stamps of a set are equal. Otherwise each message of the first topic
    is matched with the message of every other topic that has the nearest stamp, if the two are
    each other's nearest of those left, and differ by no more than the tolerance. Unless the stamps
    are equal, that is certain only when the next message is known: the set is returned one
    message later. In both cases the sets depend on the stamps alone, not on the order in which
    the topics' messages arrive, as long as no queue overflows.

    When the stamps of a topic jump back, its queue is emptied.
    The newest message of a cached topic, such as a static calibration, is part of every set,
    whatever its stamp; no set is returned before every cached topic has a message.

    received, unmatched: {topic: number of messages}. matched: number of sets. jumps_back: number
    of sets that went back.
    """

    def __init__(self, topics, queue_size=5, tolerance=None, cached=()):
        """Make queues; tolerance: ns, 0 = any, None = equal stamps; cached: not the first."""
        self.topics = tuple(topics)
        self.received = dict.fromkeys(self.topics, 0)
        self.unmatched = dict.fromkeys(self.topics, 0)
        self.matched = 0
        self.jumps_back = 0
        self._queue_size = queue_size if tolerance is None else max(queue_size, SMALLEST_QUEUE)
        self._tolerance = tolerance
        self._cached = dict.fromkeys(cached)
        self._queued = [topic for topic in self.topics if topic not in self._cached]
        self._queues = {topic: {} for topic in self._queued}    # stamp: message, stamps ascend
        self._latest = dict.fromkeys(self._queued)
        self._last_set = None

    def add(self, topic, stamp, message):
        """Add a message with its stamp in ns; return the list of sets that are now certain."""
        self.received[topic] += 1
        if topic in self._cached:
            complete, self._cached[topic] = self._all_cached(), message
            return [] if complete else self._certain_sets()
        queue = self._queues[topic]
        if self._latest[topic] is not None and stamp < self._latest[topic]:
            self._drop(topic, list(queue))
        self._latest[topic] = stamp
        if stamp in queue:
            self._drop(topic, [stamp])
        queue[stamp] = message
        if len(queue) > self._queue_size:
            self._drop(topic, [next(iter(queue))])
        return self._certain_sets([stamp])

    def finish(self):
        """Return the list of sets that waited for a next message; none will come."""
        return self._certain_sets(final=True)

    def clear(self):
        """Drop all waiting messages; the counts stay."""
        for topic, queue in self._queues.items():
            self._drop(topic, list(queue))

    def has_cached(self, topic):
        """Return whether a topic is cached and has a message."""
        return self._cached.get(topic) is not None

    def difference(self):
        """Return the ns between the latest stamps of the topics, None with fewer than two."""
        stamps = [stamp for stamp in self._latest.values() if stamp is not None]
        return max(stamps) - min(stamps) if len(stamps) > 1 else None

    def _all_cached(self):
        return None not in self._cached.values()

    def _certain_sets(self, stamps=None, final=False):
        """Remove and return the sets that some stamps, or the end, make certain."""
        if not self._all_cached():
            return []
        if self._tolerance is not None:
            return self._nearest_sets(final)
        if stamps is None:
            stamps = list(self._queues[self.topics[0]])
        return [self._remove_set([stamp] * len(self._queued)) for stamp in stamps
                if all(stamp in queue for queue in self._queues.values())]

    def _nearest_sets(self, final):
        sets = []
        while self._queues[self.topics[0]]:
            pivot, *later = self._queues[self.topics[0]]
            chosen = [pivot] + [
                _nearest_stamp(pivot, later[0] if later else None, list(self._queues[topic]),
                               self._tolerance, final) for topic in self._queued[1:]]
            if WAIT in chosen and None not in chosen:
                break
            if None in chosen:
                self._drop(self.topics[0], [pivot])
            else:
                sets.append(self._remove_set(chosen))
        return sets

    def _remove_set(self, stamps):
        """Remove a set from the queues, drop older messages, and return the set."""
        messages = dict(self._cached)
        for topic, stamp in zip(self._queued, stamps):
            messages[topic] = self._queues[topic].pop(stamp)
            self._drop(topic, [older for older in self._queues[topic] if older < stamp])
        went_back = self._last_set is not None and stamps[0] < self._last_set
        self._last_set = stamps[0]
        self.matched += 1
        self.jumps_back += went_back
        return MatchedSet(stamps[0], tuple(messages[topic] for topic in self.topics),
                          max(stamps) - min(stamps), went_back)

    def _drop(self, topic, stamps):
        for stamp in stamps:
            del self._queues[topic][stamp]
        self.unmatched[topic] += len(stamps)


def _nearest_stamp(pivot, following, stamps, tolerance, final):
    """
    Return the stamp that matches the pivot, None if there is none, WAIT if one may still come.

    pivot: stamp of the first topic. following: its next stamp, None while unknown. stamps: of
    another topic, ascending. tolerance: ns, 0 = any difference. final: no more will come.
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
