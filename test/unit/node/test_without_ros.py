# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What needs ROS says so in a sentence where there is none."""
import os
import subprocess
import sys

import pytest
from repository import ROOT

BLOCKING = """
import re, sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if re.match({blocked!r}, name):
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)

sys.meta_path.insert(0, Blocked())
"""
NODES = 'disparity_node', 'managed_node', 'simulated_cameras'
LAUNCH_FILES = sorted(str(path) for path in (ROOT / 'launch').glob('*.launch.py'))


ALL, SOME = r'(rcl|launch|ament_)|\w+_(interfaces|msgs)$', '(rclpy|launch)$'


@pytest.mark.parametrize('words, blocked', [
    *((['-m', f'fuzzy_stereo_ros.node.{name}'], ALL) for name in NODES),
    *((['-c', f'from fuzzy_stereo_ros.node.{name} import main'], SOME) for name in NODES),
    *((words, blocked) for words in (['-m', 'bench.demo'], ['-m', 'bench.live'], *(
        [file] for file in LAUNCH_FILES)) for blocked in (ALL, SOME))])
def test_without_all_or_some_of_ros_a_program_ends_with_a_sentence(words, blocked, tmp_path):
    (tmp_path / 'sitecustomize.py').write_text(BLOCKING.format(blocked=blocked))
    path = os.pathsep.join([str(tmp_path), str(ROOT), os.environ.get('PYTHONPATH', '')])
    ended = subprocess.run([sys.executable, *words, '--help'], capture_output=True, text=True,
                           env={**os.environ, 'PYTHONPATH': path})
    assert ended.returncode == 1
    assert ended.stderr.startswith('this program needs ROS 2, but ')
    assert ended.stderr.count('\n') == 1
    assert 'source the setup.bash' in ended.stderr
