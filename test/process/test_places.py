# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Node and commands start wherever they may write nothing, and say what they do without."""
from pathlib import Path

from fuzzy_stereo_ros.matching import kernels
from mounted import as_stranger, mounting, READ_ONLY
from node_process import NodeProcess, own_domain
import pytest
from repository import COMMAND_LINE, run_python

CODE = Path(kernels.__file__).parent / '__pycache__'
LOGS = 'no folder for log files can be written to ('
KERNELS = 'no folder for compiled kernels can be written to ('
PLACES = 'HOME', 'NUMBA_CACHE_DIR', 'ROS_HOME', 'ROS_LOG_DIR', 'XDG_CACHE_HOME'


@pytest.fixture
def bare(monkeypatch):
    """Take away all that names a place to write to; return a function that sets some."""
    for name in PLACES:
        monkeypatch.delenv(name, raising=False)
    return monkeypatch.setenv


def stranger_without_kernels():
    """Return what starts a command as another user, who finds no kernels to read."""
    return [*mounting({CODE: 'mode=755'}), *as_stranger()]


def started(before=()):
    """Start the node, end it when it loads the kernels, and return what it logged."""
    with own_domain() as domain:
        node = NodeProcess(domain, before=before)
        try:
            node.logged('loading the kernels')
        finally:
            code = node.finish()
    assert code == 0
    assert 'Traceback' not in node.log()
    return node.log()


def told_once(log, sentence):
    """Return the line of a log with a sentence, which must be a warning and alone."""
    (line,) = (line for line in log.splitlines() if sentence in line)
    assert '[WARN]' in line
    return line


def test_the_node_starts_where_all_is_read_only_and_says_both(ros, bare, tmp_path):
    bare('HOME', str(tmp_path))
    log = started(mounting({tmp_path: READ_ONLY, CODE: READ_ONLY}))
    assert f'{LOGS}{tmp_path}/.ros/log: Read-only file system): logs are only printed; set ' \
        'ROS_LOG_DIR' in told_once(log, LOGS)
    assert 'rcutils' not in log
    line = told_once(log, KERNELS)
    assert f'{tmp_path}/.cache/fuzzy_stereo_ros: Read-only file system' in line
    assert 'set NUMBA_CACHE_DIR' in line


def test_the_node_of_a_user_without_home_and_name_starts(ros, bare):
    log = started(stranger_without_kernels())
    assert 'HOME is not set' in told_once(log, LOGS)
    assert f'{CODE}: Permission denied' in told_once(log, KERNELS)


@pytest.mark.parametrize('words', [
    ('match', 'left.png', 'right.png', '--disparities', '16', '--output', 'never.pfm'),
    ('replay', 'no_bag', '--disparities', '16', '--output', 'never')])
def test_commands_that_match_tell_first_that_kernels_are_kept_nowhere(bare, words):
    done = run_python('-m', COMMAND_LINE, *words, before=stranger_without_kernels())
    assert (done.returncode, done.stdout) == (2, '')
    first, second = done.stderr.splitlines()
    assert first.startswith(f'fuzzy-stereo: {KERNELS}')
    assert 'they are compiled at each start' in first
    assert second.startswith('fuzzy-stereo: ')
