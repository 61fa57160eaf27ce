# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch files with the real launch, one launch a case: what it starts does what it says."""
from collections.abc import Callable
from contextlib import closing
import os
import time
from typing import NamedTuple
import unittest

from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import launched
from launched import (
    check_disparity, FOLDER, included, launch_testing, PAIR, PEER, PROFILES_FILE, surroundings,
    written)
from made_messages import values_of
from made_scenes import shifted_pair
from node_process import START
import numpy as np
from pages import block, CAMERAS, text_of
import pytest


class Case(NamedTuple):
    # launch: returns what is launched; check(test): called with a `TestTheLaunched` once a line
    # is printed, `begun`; rig: options of the simulated cameras; wanted: namespace of the outputs.

    launch: Callable
    check: Callable
    rig: dict = {}
    wanted: str = ''
    begun: str = 'ready: the kernels are warm'


def matches(test, **expected):
    """See that pairs are matched; return the disparity of the first."""
    test.connect()
    check_disparity(test.around.first_match(*PAIR), **expected)


def is_brought_up_by_a_lifecycle_manager(test):
    from lifecycle_manager import Manager
    manager = Manager(test.around)
    assert manager.state() == 'unconfigured'
    assert [manager.change(name) for name in ('configure', 'activate')] == ['inactive', 'active']
    matches(test)


# ---- what was written for stereo_image_proc ----

PEER_CAMERAS = [
    '--ros-args', '-r', '__ns:=/rig', *(
        word for side, name in (('left', 'one'), ('right', 'two'))
        for topic, there in (('image_rect', 'image_raw'), ('camera_info', 'camera_info'))
        for word in ('-r', f'{side}/{topic}:={name}/{there}'))]


def has_its_name_rectifies_and_names_what_means_nothing_in_one_warning(test):
    assert os.environ[PROFILES_FILE] == str(FOLDER.parent / 'config' / 'fastdds.xml')
    given = [name for name in IGNORED_PARAMETERS if name in PEER]
    assert len(given) == 10
    test.logged(f"stereo_image_proc's matchers are ignored: {', '.join(given)}")
    matches(test)
    names = ('approximate_sync', 'rectify', 'use_color', 'speckle_size', 'speckle_range')
    assert test.around.parameters(*names, node='/rig/stereo') == [True, True, False, 50, 4]


def matches_by_the_remappings_of_the_page(test):
    test.logged("stereo_image_proc's matchers are ignored: correlation_window_size, "
                'stereo_algorithm, uniqueness_ratio')
    matches(test, disparities=32)


# The node of the peer's own launch test, in XML; a single pair that is lost would end a test.
PEER_TEST = """
<launch>
  <node pkg="fuzzy_stereo_ros" exec="disparity_node">
    <param name="input_qos" value="reliable"/>
    <param name="disparity_range" value="16"/>
    <param name="confidence_threshold" value="0.0"/>
    <remap from="left/image_rect" to="/left/image_rect_color"/>
    <remap from="right/image_rect" to="/right/image_rect_color"/>
  </node>
</launch>
"""
COLOURED = ['--ros-args', *(word for side in ('left', 'right') for word in (
    '-r', f'{side}/image_rect:={side}/image_rect_color'))]


def publishes_what_the_peers_own_test_waits_for(test):
    from ros_bench import uncalibrate
    test.connect()
    message = test.around.first_match(*PAIR, change=uncalibrate)
    check_disparity(message)
    assert (message.f, message.t, message.image.encoding) == (1.0, 0.0, '32FC1')


# ---- several rigs, the demo ----

ROWS, COLUMNS, DISPARITIES = 120, 160, 16


def two_rigs():
    text = block('yaml', text_of('docs/node.md'))
    for told, small_enough in (("'128'", "'16'"), ("'256'", "'24'")):
        text = text.replace(told, small_enough)
    return included(written('rigs.launch.yaml', text))


def each_node_matches_its_own_cameras_in_a_process_with_its_own_parameters(test):
    test.connect()
    with closing(surroundings(**in_namespace('/cameras'))) as rear:
        rear.listen(namespace='/rear/')
        rear.until(rear.rig.subscribed, 'the other node subscribes to the other rig')
        for _ in range(3):
            check_disparity(test.around.first_match(*PAIR))
            check_disparity(rear.first_match(*shifted_pair(11, seed=1)), 11, 24)
        for around in (test.around, rear):
            assert set(around.disparities) <= set(around.rig.sent)
    assert len(test.processes.processes()) == 2


def shows_a_picture_in_colour_of_the_ground_truth_of_the_made_scene(test):
    from sensor_msgs.msg import Image
    pictures = {}
    test.around.collect(Image, '/preview', pictures)
    picture = next(iter(test.around.until(lambda: pictures, 'a preview').values()))
    assert (picture.height, picture.width, picture.encoding) == (ROWS, COLUMNS, 'bgr8')
    assert np.std(np.frombuffer(picture.data, np.uint8)) > 20
    test.around.listen()
    found = test.around.until(lambda: test.around.disparities, 'a disparity image')
    message = next(iter(found.values()))
    assert message.max_disparity == DISPARITIES - 1
    values = values_of(message.image)
    valid = values >= message.min_disparity
    assert valid.mean() > 0.7
    frames = make_sequence(ROWS, COLUMNS, DISPARITIES, 12, pan=2.0)
    assert max(np.mean(np.abs(values - frame.truth)[valid] < 0.5) for frame in frames) > 0.9


def in_namespace(name):
    return {'cli_args': ['--ros-args', '-r', f'__ns:={name}']}


CASES = {
    'managed': Case(
        lambda: included('fuzzy_stereo.launch.py', managed='true', disparity_range='16',
                         confidence_threshold='0', input_qos='reliable'),
        is_brought_up_by_a_lifecycle_manager, begun=''),
    "the peer's arguments": Case(
        lambda: included('fuzzy_stereo.launch.py', node_name='stereo', **PEER),
        has_its_name_rectifies_and_names_what_means_nothing_in_one_warning,
        {'cli_args': PEER_CAMERAS}, '/rig/'),
    'the migration page': Case(
        lambda: included(written('stereo.launch.py', block('python'))),
        matches_by_the_remappings_of_the_page, {'cli_args': ['--ros-args', *CAMERAS]},
        '/stereo/'),
    "the peer's own test, in XML": Case(
        lambda: included(written('peer.launch.xml', PEER_TEST)),
        publishes_what_the_peers_own_test_waits_for, {'cli_args': COLOURED}),
    'two rigs': Case(
        two_rigs, each_node_matches_its_own_cameras_in_a_process_with_its_own_parameters,
        in_namespace('/front'), '/front/'),
    'the demo': Case(
        lambda: included('demo.launch.py', rows=str(ROWS), columns=str(COLUMNS),
                         disparities=str(DISPARITIES), rate='10', viewer='False'),
        shows_a_picture_in_colour_of_the_ground_truth_of_the_made_scene, in_namespace('/unused'))}


@pytest.mark.launch_test
@launch_testing.parametrize('case', CASES)
def generate_test_description(case):
    return launched.description(CASES[case].launch())


class TestTheLaunched(unittest.TestCase):
    """Tests of what a case has launched; self.around is a `Surroundings`."""

    def setUp(self, proc_output, proc_info, case):
        """Wait for the node, then start the simulated cameras."""
        self.case, self.output, self.processes = CASES[case], proc_output, proc_info
        self.logged(self.case.begun)
        self.around = surroundings(**self.case.rig)
        self.addCleanup(self.around.close)
        self.around.check = self.check

    def check(self):
        """See that every process lives."""
        for process in self.processes:
            assert not hasattr(process, 'returncode'), f'{process.process_name} has ended'

    def connect(self):
        """Subscribe to the outputs and wait until the node has subscribed to the rig."""
        self.around.listen(namespace=self.case.wanted)
        self.around.until(self.around.rig.subscribed, 'the node subscribes to the rig')

    def test_it_does_what_it_says(self):
        self.case.check(self)

    def printed(self):
        return b''.join(event.text for event in self.output).decode()

    def logged(self, text):
        """Wait for a text in what the processes print."""
        deadline = time.monotonic() + START
        with self.output.io_event:
            while text not in self.printed():
                assert time.monotonic() < deadline, f'never logged: {text}'
                self.check()
                self.output.io_event.wait(1)


@launch_testing.post_shutdown_test()
class TestTheEnd(unittest.TestCase):
    def test_every_process_ended_with_code_0(self, proc_info):
        launched.asserts.assertExitCodes(proc_info, [0])

    @classmethod
    def tearDownClass(cls):
        """Leave the surroundings."""
        launched.held.close()
