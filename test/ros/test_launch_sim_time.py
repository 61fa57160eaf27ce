# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with time from /clock, as a bag gives it that is played in a loop."""
from fuzzy_stereo_ros.pairs.messages import stamp_of
import launched
from launched import launch_testing, MILLISECOND, PAIR, SECOND
import pytest

BEGIN, PERIOD, FRAMES = 1000 * SECOND, 100 * MILLISECOND, 5


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small(use_sim_time='true'))


class TestTheLaunchedNode(launched.Launched):

    def setUp(self, proc_output, proc_info):
        from rclpy.time import Time
        from rosgraph_msgs.msg import Clock
        super().setUp(proc_output, proc_info)
        publisher = self.around.listener.create_publisher(Clock, '/clock', 10)
        self.tell = lambda stamp: publisher.publish(Clock(clock=Time(nanoseconds=stamp).to_msg()))
        self.around.until(publisher.get_subscription_count, 'the node listens to /clock')

    def play(self):
        """Play the bag once and return when each of its pairs is matched."""
        for stamp in range(BEGIN, BEGIN + FRAMES * PERIOD, PERIOD):
            self.tell(stamp)
            launched.check_disparity(self.around.match(*PAIR, stamp))

    def time_of_diagnostics(self):
        self.around.diagnostics.clear()
        self.around.until(lambda: self.around.diagnostics, 'diagnostics')
        return stamp_of(self.around.diagnostics[-1].header)

    def test_a_loop_whose_stamps_go_back_is_matched_each_time(self):
        self.connect()
        self.around.first_match(*PAIR)      # by the wall clock: the first loop goes back as well
        for _ in range(3):
            self.play()
        self.logged('timestamps jumped back')

    def test_the_node_reports_in_the_time_of_the_clock(self):
        for now in (BEGIN, BEGIN + SECOND, BEGIN):
            self.around.until(
                lambda: self.tell(now) or self.time_of_diagnostics() == now,    # noqa: B023
                'the node has the time of the clock')


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
