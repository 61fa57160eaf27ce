# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node with a probe in its executor: how late is who wants a turn."""
import sys
import time

from fuzzy_stereo_ros.node.disparity_node import DisparityNode
from fuzzy_stereo_ros.node.run_node import run_node
from rclpy.clock import Clock, ClockType
from std_msgs.msg import Float32MultiArray

PERIOD = 0.005      # s


class ProbedNode(DisparityNode):
    """Publishes once a second by how many ms turns came late: 99th percentile, largest."""

    def __init__(self, **options):
        """Start the node and the probe."""
        super().__init__(**options)
        self._late, self._before = [], None
        self._turns = self.create_publisher(Float32MultiArray, 'late_turns', 10)
        self.create_timer(PERIOD, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _turn(self):
        now = time.monotonic()
        if self._before is not None:
            self._late.append(1000 * max(now - self._before - PERIOD, 0))
        self._before = now
        if len(self._late) * PERIOD >= 1:
            self._turns.publish(Float32MultiArray(data=[
                sorted(self._late)[-len(self._late) // 100], max(self._late)]))
            self._late.clear()


if __name__ == '__main__':
    sys.exit(run_node(ProbedNode, sys.argv))
