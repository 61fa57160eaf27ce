# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How long each stage of a frame took."""
import time


class Stopwatch:
    """Runs from when it is made; times: milliseconds by stage, in the order of the stages."""

    def __init__(self):
        self.times, self._since = {}, time.perf_counter_ns()

    def took(self, stage):
        """Note the milliseconds since the last stage ended."""
        now = time.perf_counter_ns()
        self.times[stage] = (now - self._since) / 1e6
        self._since = now
