# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with compressed images from cameras in namespaces of their own."""
import launched
from launched import launch_testing, PAIR
import numpy as np
import pytest


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small(
        namespace='rig', image_transport='compressed',
        left_namespace='/cameras/left', right_namespace='/cameras/right'))


class TestTheLaunchedNode(launched.Launched):
    rig = {'compressed': True, 'cli_args': ['--ros-args', '-r', '__ns:=/cameras']}
    wanted = '/rig/'

    def test_compressed_images_below_the_namespaces_of_the_cameras_are_matched(self):
        self.connect()
        launched.check_disparity(self.around.first_match(*PAIR))
        colour = [np.repeat(image[:, :, None], 3, 2) for image in PAIR]
        launched.check_disparity(self.around.match(*colour))
        topics = dict(self.around.listener.get_topic_names_and_types())
        assert '/cameras/left/image_rect/compressed' in topics
        assert '/cameras/left/image_rect' not in topics


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
