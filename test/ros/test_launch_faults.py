# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with cameras that send what is wrong: it is named, and the node lives."""
import launched
from launched import launch_testing, PAIR
import pytest


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small())


def bad_encoding(messages):
    messages['left/image_rect'].encoding = '32FC1'


def bad_step(messages):
    messages['right/image_rect'].step = 3


def uncalibrated(messages):
    messages['left/camera_info'].p[0] = 0.0


def swapped_cameras(messages):
    for side, tx in (('left', -24.0), ('right', 0.0)):
        messages[f'{side}/camera_info'].p[3] = tx


FAULTS = {
    bad_encoding: "left image: encoding is '32FC1'",
    bad_step: 'right image: step is 3 bytes',
    uncalibrated: 'left camera_info: the camera is not calibrated',
    swapped_cameras: 'left and right are swapped',
}


class TestTheLaunchedNode(launched.Launched):

    def test_each_fault_is_named_and_the_next_pair_is_matched(self):
        self.connect()
        self.around.first_match(*PAIR)
        for change, sentence in FAULTS.items():
            refused = self.around.rig.publish(*PAIR, change=change)
            self.logged(sentence)
            launched.check_disparity(self.around.match(*PAIR))
            assert refused not in self.around.disparities


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
