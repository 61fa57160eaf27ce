# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the middleware loses without a word: gaps in the numbers that a publisher counts by."""


class Gaps:
    """
    Counts messages that are missing between two others.

    lost: {topic: number}. Not counted is what cannot be known: losses before the first message of
    a publisher and after its last one, and all while a topic has several publishers.
    """

    def __init__(self, topics):
        """Begin with nothing lost; topics: names."""
        self.lost = dict.fromkeys(topics, 0)
        self._before = {}

    def begin(self, topic):
        """Forget what came before: another publisher, or one that was not listened to."""
        self._before.pop(topic, None)

    def note(self, topic, number, publishers):
        """
        Take the number of a message; None where the middleware does not count.

        publishers(): called where there is a gap; returns how many publishers the topic has.
        """
        before, self._before[topic] = self._before.get(topic), number
        if None not in (before, number) and number > before + 1 and publishers() == 1:
            self.lost[topic] += number - before - 1
