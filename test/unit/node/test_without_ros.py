# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What needs ROS says so in a sentence where there is none."""
import os

from repository import ROOT, run_python

# One process imports what needs no ROS, and forks for each program, to start it as a user does.
START_EACH = r"""
import gc, os, re, runpy, sys
import cv2, fuzzy_stereo_ros.pair_matcher, fuzzy_stereo_ros.parameters.table, yaml

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if re.match(names, name):
            raise ModuleNotFoundError(f'No module named {name!r}', name=name)

sys.meta_path.insert(0, Blocked())
gc.freeze()     # so that a child that ends does not visit what is imported
for program in sys.argv[1:]:
    for names in r'(rcl|launch|ament_)|\w+_(interfaces|msgs)$', '(rclpy|launch)$':
        child = os.fork()
        if not child:
            sys.argv[1:] = ['--help']
            (runpy.run_path if program.endswith('.py') else runpy.run_module)(
                program, run_name='__main__')
            sys.exit()
        print(program, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
PROGRAMS = [*(f'fuzzy_stereo_ros.node.{name}' for name in (
    'disparity_node', 'managed_node', 'simulated_cameras')), 'bench.demo', 'bench.live',
    *map(str, (ROOT / 'launch').glob('*.launch.py'))]


def test_without_all_or_some_of_ros_a_program_ends_with_a_sentence():
    path = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])
    ended = run_python('-c', START_EACH, *PROGRAMS, PYTHONPATH=path)
    assert ended.stdout.splitlines() == [f'{one} 1' for one in PROGRAMS for _ in range(2)]
    told = ended.stderr.splitlines()
    assert len(told) == 2 * len(PROGRAMS) > 12
    for line in told:
        assert line.startswith('this program needs ROS 2, but ')
        assert 'source the setup.bash' in line
