# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with the arguments as they are written for stereo_image_proc.launch.py."""
from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS
import launched
from launched import launch_testing, PAIR
import pytest

PEER = {
    'approximate_sync': 'True', 'use_color': 'False', 'avoid_point_cloud_padding': 'False',
    'launch_image_proc': 'True', 'namespace': 'rig', 'left_namespace': 'one',
    'right_namespace': 'two', 'container': 'stereo_container', 'stereo_algorithm': '1',
    'prefilter_size': '9', 'prefilter_cap': '31', 'correlation_window_size': '15',
    'min_disparity': '0', 'disparity_range': '16', 'texture_threshold': '10',
    'speckle_size': '50', 'speckle_range': '4', 'disp12_max_diff': '0',
    'uniqueness_ratio': '15.0', 'P1': '200.0', 'P2': '400.0', 'sgbm_mode': '0'}


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.included('fuzzy_stereo.launch.py', **PEER))


class TestTheLaunchedNode(launched.Launched):
    rig = {'cli_args': [
        '--ros-args', '-r', '__ns:=/rig', *(
            word for side, name in (('left', 'one'), ('right', 'two'))
            for topic, there in (('image_rect', 'image_raw'), ('camera_info', 'camera_info'))
            for word in ('-r', f'{side}/{topic}:={name}/{there}'))]}
    wanted = '/rig/'

    def test_raw_images_are_matched_and_what_means_nothing_is_named_in_one_warning(self):
        given = [name for name in IGNORED_PARAMETERS if name in PEER]
        assert len(given) == 10
        self.logged(f"that mean nothing here are ignored: {', '.join(given)}")
        self.connect()
        launched.check_disparity(self.around.first_match(*PAIR))
        names = ('approximate_sync', 'rectify', 'use_color', 'speckle_size', 'speckle_range')
        assert self.parameters('/rig/disparity_node', *names) == [True, True, False, 50, 4]


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
