# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with cameras that stamp a millisecond apart."""
import launched
from launched import launch_testing, MILLISECOND, PAIR, SECOND
import pytest

PERIOD = 33 * MILLISECOND


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small(
        approximate_sync='True', approximate_sync_tolerance_seconds='0.005', queue_size='3'))


def right_is_late(milliseconds):
    """Return what moves the stamps of the right camera."""
    def change(messages):
        for topic in ('right/image_rect', 'right/camera_info'):
            messages[topic].header.stamp.nanosec += milliseconds * MILLISECOND
    return change


class TestTheLaunchedNode(launched.Launched):

    def test_what_is_within_the_tolerance_is_matched_and_nothing_else(self):
        self.connect()
        self.around.first_match(*PAIR)
        stamps = [1000 * SECOND + frame * PERIOD for frame in range(6)]
        apart = [1, 2, 8, 1, 2, 1]
        # a pair comes out when the next one shows that it is the nearest
        for stamp, milliseconds in zip(stamps, apart):
            self.around.rig.publish(*PAIR, stamp, right_is_late(milliseconds))
            before = stamp - PERIOD
            if before in stamps and apart[stamps.index(before)] <= 5:
                launched.check_disparity(self.answer(before))
        assert stamps[2] not in self.around.disparities


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
