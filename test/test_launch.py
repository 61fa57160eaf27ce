# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with the real launch: what test_stereo_node claims, started as users do."""
from contextlib import ExitStack
import os
from pathlib import Path
import tempfile
import unittest

from node_process import own_domain, ros_environment, shifted_pair, values_of
import numpy as np
import pytest

WHY = 'launch and launch_testing are not importable: they come with ROS 2, not from PyPI'
launch = pytest.importorskip('launch', reason=WHY)
launch_ros = pytest.importorskip('launch_ros', reason=WHY)
launch_testing = pytest.importorskip('launch_testing', reason=WHY)
actions = pytest.importorskip('launch.actions')
sources = pytest.importorskip('launch.launch_description_sources')
asserts = pytest.importorskip('launch_testing.asserts')

LAUNCH_FILE = Path(__file__).parents[1] / 'launch' / 'fuzzy_stereo.launch.py'
PROFILES_FILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
PAIR = shifted_pair(7)
held = ExitStack()      # what the tests hold on to from the start of launch to the end
shared = {}


@pytest.mark.launch_test
def generate_test_description():
    shared['domain'] = held.enter_context(own_domain())
    patch = held.enter_context(pytest.MonkeyPatch.context())
    logs = held.enter_context(tempfile.TemporaryDirectory())
    for name, value in ros_environment(logs).items():
        patch.setenv(name, value)
    patch.setenv('ROS_DOMAIN_ID', str(shared['domain']))
    patch.delenv(PROFILES_FILE)     # the launch file sets it
    return launch.LaunchDescription([
        actions.IncludeLaunchDescription(
            sources.PythonLaunchDescriptionSource(str(LAUNCH_FILE)),
            launch_arguments={
                'node_name': 'stereo', 'namespace': 'rig', 'left_namespace': '/left',
                'right_namespace': '/right', 'disparity_range': '16',
                'confidence_threshold': '0'}.items()),
        launch_testing.actions.ReadyToTest()])


class TestTheLaunchedNode(unittest.TestCase):

    def test_it_is_ready_and_answers_with_disparities(self, proc_output):
        from ros_bench import Surroundings
        proc_output.assertWaitFor('ready: the kernels are warm', timeout=60)
        around = Surroundings(shared['domain'])
        try:
            around.listen(namespace='/rig/')
            around.until(around.rig.subscribed, 'the node subscribes to the rig')
            message = around.first_match(*PAIR)
            assert message.max_disparity == 15.0
            assert np.mean(np.abs(values_of(message.image)[:, 15:] - 7) < 0.5) > 0.95
            around.until(
                lambda: ('stereo', '/rig') in around.listener.get_node_names_and_namespaces(),
                'the node has its name')
        finally:
            around.close()


@launch_testing.post_shutdown_test()
class TestTheEndedNode(unittest.TestCase):

    def test_it_ended_with_code_0(self, proc_info):
        asserts.assertExitCodes(proc_info, [0])

    def test_it_ran_with_the_profile_for_large_images(self):
        assert os.environ[PROFILES_FILE] == str(
            LAUNCH_FILE.parents[1] / 'config' / 'fastdds.xml')

    @classmethod
    def tearDownClass(cls):
        held.close()
