# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A matcher that is warm has all its kernels: no frame waits for one to be compiled."""
import os
import re
import shutil
import signal
import subprocess
import sys

from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels import compiled
from fuzzy_stereo_ros.progress import COMPILING
from mounted import mounting
from node_process import START
import psutil
import pytest
from repository import COMMAND_LINE, printed_by, ROOT, run_python

CODE = compiled.SOURCES / '__pycache__'
MATCH = """
import sys
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.compiling import record_calls
from fuzzy_stereo_ros.matching.kernels.compiled import kernels
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import numpy as np

def compiled():
    return {(one.py_func.__name__, str(kinds)) for one in kernels for kinds in one.overloads}

config = MatcherConfig.from_profile(sys.argv[1], disparities=24)
matcher, noted = StereoMatcher(config), set()
if sys.argv[2] == 'warm':
    noted = {(one.py_func.__name__, str(kinds)) for one, kinds in record_calls(config)}
    matcher.warm_up(120, 160)
before = compiled()
for number, frame in enumerate(make_sequence(120, 160, 24, 5, noise=2.0)):
    matcher.match(*(np.roll(view, 3 * number, axis=1) for view in (frame.left, frame.right)))
if sys.argv[1] == 'realtime':       # where pictures are averaged, and plain regions vote
    random, view = np.random.default_rng(1), frame.left.astype(float)
    view[40:, 40:140] = 90
    for _ in range(20):
        matcher.match(*np.clip(view + random.normal(0, 1.5, (2, *view.shape)), 0, 255).astype('B'))
    matcher.match(*(cv2.GaussianBlur(random.normal(100, 9, view.shape), None, 2).astype('B')
                    for _ in range(2)))
for found in compiled() - before, compiled() - noted:
    print(*sorted(name for name, kinds in found))
print(*{'numba.np.arraymath', 'scipy.linalg'} & {*sys.modules})
"""


# May be compiled by the warm-up itself: a dry run of quality ends before its second frame; in that
# of paper chromosomes never differ, and whether pictures change depends on random numbers.
MISSED = {'realtime': {'previous_prior'}, 'quality': {'origins_of_tiles'},
          'paper_live': {'copy_taken', 'fill_fitness_around', 'most_possible',
                         'origins_of_tiles'}}


@pytest.mark.parametrize('profile', MISSED)
def test_no_kernel_is_left_to_the_frames_of_a_camera_that_moves(profile):
    # First all is compiled and kept: a kernel that is compiled later also shows those it calls.
    StereoMatcher(MatcherConfig.from_profile(profile, disparities=24)).warm_up(120, 160)

    def found(start):
        return [line.split() for line in printed_by('-c', MATCH, profile, start).splitlines()]

    by_frames, beside_dry_run, _ = found('warm')
    assert by_frames == []
    assert set(beside_dry_run) <= MISSED[profile]
    if profile == 'realtime':
        by_frames, _, imported_to_compile = found('cold')
        assert {'move_map', 'list_genes', 'elect_by_halves'} <= set(by_frames)
        assert imported_to_compile == []


def test_the_command_says_so_where_nothing_can_be_kept(tmp_path):
    done = run_python(
        '-m', COMMAND_LINE, 'warm-up', before=mounting({tmp_path: 'ro', CODE: 'ro'}),
        HOME=str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.splitlines()[-1] == (
        'fuzzy-stereo: there is no folder for compiled kernels; set NUMBA_CACHE_DIR to a '
        'writable one')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_nobody_compiles_on_after_the_command_has_ended(tmp_path, number):
    command = subprocess.Popen(     # of the profile that has the fewest kernels
        [sys.executable, '-m', COMMAND_LINE, 'warm-up', '--profile', 'paper'], cwd=ROOT, text=True,
        env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)}, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE)
    while not (children := psutil.Process(command.pid).children()):
        assert command.stderr.read(1)
    command.send_signal(number)
    command.communicate()
    assert psutil.wait_procs(children, timeout=START)[1] == []


@pytest.fixture(scope='module')
def frames(tmp_path_factory):
    place = tmp_path_factory.mktemp('frames') / 'made'
    assert main(['synthesise', '--output', str(place), '--columns', '160', '--rows', '120',
                 '--disparities', '24', '--frames', '2']) == 0
    return place


PAIR, FOLDERS = ('left/0000.png', 'right/0000.png'), ('left', 'right')


@pytest.mark.parametrize('terminal, words', [
    (True, ('match', *PAIR)),
    (False, ('replay', *FOLDERS, '--output', 'new', '--disparities', 'auto')),
    (False, ('replay', *FOLDERS, '--output', 'new', '--workers', '2'))])
def test_whatever_compiles_says_so_before_it_begins(terminal, words, frames, tmp_path):
    reads, writes = os.openpty() if terminal else os.pipe()
    command = subprocess.Popen(
        [sys.executable, '-m', COMMAND_LINE, *words],
        env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path), 'PYTHONPATH': str(ROOT)},
        cwd=shutil.copytree(frames, tmp_path / 'made'), stdout=subprocess.DEVNULL, stderr=writes)
    os.close(writes)
    said = ''
    while not re.search(rf'{COMPILING}: +0 ?%.* s so far', said):
        said += os.read(reads, 1000).decode()
    assert not [*tmp_path.rglob('*.nbi')]
    command.kill()
    command.wait()
    os.close(reads)
