# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file and subscribers that come, leave and come back."""
import launched
from launched import launch_testing, PAIR
import pytest

INPUTS = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small())


class TestTheLaunchedNode(launched.Launched):

    def subscriptions(self):
        return sum(self.around.listener.count_subscribers(topic) for topic in INPUTS)

    def diagnosed(self, times):
        """Wait for so many reports of the node, one a second."""
        self.around.diagnostics.clear()
        self.around.until(lambda: len(self.around.diagnostics) >= times, 'diagnostics')

    def test_images_are_subscribed_to_only_while_an_output_has_a_subscriber(self):
        around = self.around
        self.diagnosed(2)
        assert self.subscriptions() == 0
        for _ in range(2):      # it comes, it leaves, it comes back
            self.connect()
            assert self.subscriptions() == len(INPUTS)
            launched.check_disparity(around.first_match(*PAIR))
            around.leave()
            around.until(lambda: self.subscriptions() == 0, 'the node leaves the cameras')
        unseen = around.rig.publish(*PAIR)
        self.diagnosed(2)
        assert self.subscriptions() == 0
        assert unseen not in around.disparities


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
