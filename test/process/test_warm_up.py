# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A matcher that is warm has all its kernels: no frame waits for one to be compiled."""
import subprocess
import sys

from node_process import ROOT
import pytest

MATCH = """
import gc, sys
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import made_sequence
from numba.core.dispatcher import Dispatcher
import numpy as np

def compiled():
    return {(one.py_func.__name__, str(kinds)) for one in gc.get_objects()
            if isinstance(one, Dispatcher) for kinds in one.overloads}

matcher = StereoMatcher(MatcherConfig.from_profile(sys.argv[1], disparities=24))
if sys.argv[2] == 'warm':
    matcher.warm_up(120, 160)
before = compiled()
for number, frame in enumerate(made_sequence(120, 160, 24, 5, noise=2.0)):
    matcher.match(*(np.roll(view, 3 * number, axis=1) for view in (frame.left, frame.right)))
if sys.argv[1] == 'realtime':       # where planes evolve from frame to frame
    chance, view = np.random.default_rng(1), frame.left.astype(float)
    view[40:, 40:140] = 90
    for _ in range(20):
        matcher.match(*np.clip(view + chance.normal(0, 1.5, (2, *view.shape)), 0, 255).astype('B'))
print(*sorted(name for name, kinds in compiled() - before))
"""


@pytest.mark.parametrize('profile', ['realtime', 'quality'])
def test_no_kernel_is_left_to_the_frames_of_a_camera_that_moves(profile):
    found = {}
    for how in ('warm', 'cold'):
        done = subprocess.run([sys.executable, '-c', MATCH, profile, how], cwd=ROOT, text=True,
                              capture_output=True, check=True)
        found[how] = done.stdout.split()
    assert found['warm'] == []
    if profile == 'realtime':
        assert {'bring_forward', 'propose_planes', 'propose_map'} <= set(found['cold'])
