# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file of the migration page, written for stereo_image_proc but for one word."""
import launched
from launched import launch_testing, PAIR
from migration_page import block, CAMERAS
import pytest


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.included(
        launched.written('stereo.launch.py', block('python'))))


class TestTheLaunchedNode(launched.Launched):
    rig = {'cli_args': ['--ros-args', *CAMERAS]}
    wanted = '/stereo/'

    def test_it_matches_what_comes_by_the_remappings_with_its_parameters(self):
        self.logged('that mean nothing here are ignored: correlation_window_size, '
                    'stereo_algorithm, uniqueness_ratio')
        self.connect()
        launched.check_disparity(self.around.first_match(*PAIR), disparities=32)


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
