# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two rigs of one file, in a process each: what must hold of both."""
from pathlib import Path

from launched import (
    check_disparity, description, included, Launched, PAIR, surroundings, written)
from node_process import shifted_pair

RIGS = """
rigs:
  front:
    parameters: {disparity_range: 16, input_qos: reliable}
  rear:
    namespace: /robot/rear
    node_name: stereo
    left_namespace: /cameras/left
    right_namespace: /cameras/right
    params_file: rear.yaml
    parameters:
      min_disparity: 3
      input_qos: reliable
      qos_overrides: {/robot/rear/disparity: {publisher: {depth: 4}}}
    remappings: {left/image_rect: /cameras/left/image_mono}
"""


def rigs():
    """Return the LaunchDescription of two rigs from a file."""
    file = written('rigs.yaml', RIGS)
    Path(file).with_name('rear.yaml').write_text(
        '/**:\n  ros__parameters:\n    disparity_range: 24\n    min_disparity: 0\n')
    return description(included('rigs.launch.py', rigs_file=file))


class TwoRigs(Launched):
    """Tests of the nodes of `rigs`."""

    rig = {'cli_args': ['--ros-args', '-r', '__ns:=/front']}
    wanted = '/front/'

    def test_each_node_matches_its_own_cameras_with_its_own_parameters(self):
        """See disparities of both, in turns."""
        self.connect()
        with surroundings(cli_args=[
                '--ros-args', '-r', '__ns:=/cameras',
                '-r', 'left/image_rect:=left/image_mono']) as rear:
            rear.listen(namespace='/robot/rear/')
            rear.until(rear.rig.subscribed, 'the other node subscribes to the other rig')
            other = shifted_pair(11, seed=1)
            self.around.first_match(*PAIR)
            rear.first_match(*other)
            for _ in range(3):
                check_disparity(self.around.match(*PAIR))
                check_disparity(rear.match(*other), 11, 24)
            for around in (self.around, rear):
                assert set(around.disparities) <= set(around.rig.sent)
        names = ('min_disparity', 'qos_overrides./robot/rear/disparity.publisher.depth')
        assert self.parameters('/robot/rear/stereo', *names) == [3, 4]
