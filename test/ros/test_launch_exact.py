# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with the real launch and equal stamps, started as users do."""
import os

import launched
from launched import FOLDER, launch_testing, PAIR, PROFILES_FILE
import pytest


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small(
        node_name='stereo', namespace='rig', left_namespace='/left', right_namespace='/right'))


class TestTheLaunchedNode(launched.Launched):
    wanted = '/rig/'

    def test_pairs_of_equal_stamps_are_matched_under_the_name_that_was_given(self):
        self.connect()
        launched.check_disparity(self.around.first_match(*PAIR))
        launched.check_disparity(self.around.match(*PAIR))
        names = self.around.listener.get_node_names_and_namespaces
        self.around.until(lambda: ('stereo', '/rig') in names(), 'the node has its name')


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):

    def test_it_ran_with_the_profile_for_large_images(self):
        assert os.environ[PROFILES_FILE] == str(FOLDER.parent / 'config' / 'fastdds.xml')
