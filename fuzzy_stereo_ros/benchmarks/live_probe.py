# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node with probes: how late is who wants a turn, and what a pair takes beyond its match."""
import sys
import time

from fuzzy_stereo_ros.node.disparity_node import DisparityNode
from fuzzy_stereo_ros.node.run_node import run_node
import numpy as np
from rclpy.clock import Clock, ClockType
from std_msgs.msg import Float32MultiArray

PERIOD = 0.005      # s


class ProbedNode(DisparityNode):
    """
    Publishes three figures a second, all in ms, as `probe`.

    By how much turns came late: 99th percentile, largest. Processor time of a pair beyond its
    match, the probe's own turns included: with one thread, as others' time is not of the match.
    """

    def __init__(self, **options):
        """Start the node and the probes."""
        super().__init__(**options)
        self._late, self._before = [], None
        self._matching, self._pairs = 0.0, 0
        self._counted = self._count()
        self._timed, self._matcher.match = self._matcher.match, self._time
        self._figures = self.create_publisher(Float32MultiArray, 'probe', 10)
        self.create_timer(PERIOD, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _turn(self):
        now = time.monotonic()
        if self._before is not None:
            self._late.append(1000 * max(now - self._before - PERIOD, 0))
        self._before = now
        if len(self._late) * PERIOD >= 1:
            before, self._counted = self._counted, self._count()
            beyond, pairs = np.subtract(self._counted, before)
            self._figures.publish(Float32MultiArray(data=[
                sorted(self._late)[-len(self._late) // 100], max(self._late),
                1000 * beyond / pairs if pairs else float('nan')]))
            self._late.clear()

    def _count(self):
        """Return the processor time beyond matches in s, and the pairs matched."""
        return time.process_time() - self._matching, self._pairs

    def _time(self, pair):
        start = time.thread_time()
        try:
            return self._timed(pair)
        finally:
            self._matching += time.thread_time() - start
            self._pairs += 1


if __name__ == '__main__':
    sys.exit(run_node(ProbedNode, sys.argv))
