# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How long the node of a soak lets others wait, by when it sent what they heard."""
import time
from typing import NamedTuple


class Wait(NamedTuple):
    """A time in s, and during which kind of event it ended."""

    seconds: float
    event: str


class Waits:
    """
    The longest waits so far.

    event: what happens now. longest: {what for: Wait}. What is heard late, as the soak itself is
    busy, is no wait: all times are of when something was sent.
    """

    def __init__(self):
        """Begin with nothing sent."""
        self.event = 'the start'
        self.longest = dict.fromkeys(('a pair', 'diagnostics'), Wait(0.0, ''))
        self._sent, self._diagnosed = {}, None

    def sent(self, stamp):
        """Note that a pair of a stamp is sent now; of several the first one counts."""
        self._sent.setdefault(stamp, time.time())

    def answered(self, stamp, when):
        """Note that the answer to a stamp was sent at a time in ns since 1970."""
        if stamp in self._sent:
            self._note('a pair', when / 1e9 - self._sent.pop(stamp))

    def diagnosed(self, when):
        """Note that diagnostics were sent at a time in ns since 1970."""
        if self._diagnosed is not None:
            self._note('diagnostics', (when - self._diagnosed) / 1e9)
        self._diagnosed = when

    def forget(self):
        """Wait no longer for the pairs that were sent so far: no answer is to come."""
        self._sent.clear()

    def _note(self, what, seconds):
        self.longest[what] = max(self.longest[what], Wait(seconds, self.event))
