# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bad input to `fuzzy-stereo replay` is one sentence, exit code 2, and nothing written."""
from functools import partial
import io
import sys

from command_output import contents
from fuzzy_stereo_ros import __version__
from fuzzy_stereo_ros.replay import segments
from made_bags import disparities, TOPICS, write_bag
import pytest
from replayed import rejection, replay, run

OTHER_VERSION = "import fuzzy_stereo_ros; fuzzy_stereo_ros.__version__ = '0.0.7'"
WITHOUT_PACKAGE = "import sys; sys.modules['fuzzy_stereo_ros'] = None"
OTHER_OPENCV = "import cv2; cv2.__version__ = '4.0'"
PLAIN = """\
import sys
from fuzzy_stereo_ros.commands.command_line import main
sys.exit(main(sys.argv[2:]))
"""
DEADLY = """\
import os
from fuzzy_stereo_ros.replay import segments
segments.match_or_reject = lambda pair, matcher: os._exit(1)
"""


@pytest.fixture
def folder(folder):
    """Work in a folder with a bag and a video."""
    write_bag(folder / 'bag')
    (folder / 'before.avi').write_text('the one before')
    return folder


@pytest.fixture
def rejected(folder, capfd):
    """Return a function that gives the sentence of a replay, after which nothing is written."""
    def rejected(*bags, **options):
        before = contents()
        sentence = rejection(capfd, *bags, **options)
        assert contents() == before
        return sentence

    return rejected


def test_pairs_that_are_all_bad_leave_nothing_and_the_video_before(rejected, folder):
    def uncalibrated(number, messages):
        for topic in TOPICS[1::2]:
            messages[topic].k[0] = messages[topic].p[0] = 0

    write_bag(folder / 'zero', change=uncalibrated)
    assert rejected('zero', options=['--keep']).startswith(
        'zero: none of 6 pairs could be matched; the first: left camera_info: the camera is not '
        'calibrated (P[0] is 0, ')
    for options in ([], ['--format', 'none']):
        assert 'none of 6 pairs could be matched' in rejected('bag', disparities=200, options=[
            '--video', 'before.avi', '--overwrite', *options])


def test_the_bar_is_shown_on_a_terminal_alone(folder, capsys, monkeypatch):
    assert replay('bag') == 0
    assert capsys.readouterr().err == ''
    terminal = io.StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setattr(sys, 'stderr', terminal)
    assert replay('bag', output='terminal') == 0
    assert '6/6' in terminal.getvalue()
    assert ' pairs/s' in terminal.getvalue()


# ---- workers that are not there or cannot match ----


@pytest.fixture
def scheduler(tmp_path_factory):
    """Return a context manager: a scheduler of Dask."""
    processes = pytest.importorskip('dask_processes', reason='distributed is not installed')
    return partial(processes.dask_processes, tmp_path_factory.mktemp('dask'))


@pytest.mark.slow
@pytest.mark.parametrize('address', ['tcp://127.0.0.1:1', 'foo://bar:1'])
def test_an_address_without_scheduler_is_rejected(rejected, monkeypatch, address):
    monkeypatch.setattr(segments, 'CONNECT_SECONDS', 1)     # nobody is there to answer later
    assert rejected('bag', options=['--scheduler', address]).startswith(
        f'--scheduler is {address}, where no Dask scheduler answers: ')


@pytest.mark.slow
def test_an_address_that_is_none_leaves_nothing_that_ends_at_length(folder):
    ended = run(PLAIN, 0, 'bag', '--scheduler', 'nothing')
    sentence, = (line for line in ended.stderr.splitlines() if 'compiled kernels' not in line)
    assert sentence.endswith("answers: missing port number in address 'nothing'")


@pytest.mark.slow
def test_workers_that_cannot_match_are_rejected(
        folder, rejected, scheduler, capfd, monkeypatch):
    with scheduler() as processes:
        name = processes.address
        options = '--scheduler', name
        with monkeypatch.context() as patch:
            patch.setattr(segments, 'NO_WORKER_SECONDS', 1)
            assert rejected('bag', options=options) == (
                f'{name} has no workers: start some with `dask worker {name}` where '
                'fuzzy_stereo_ros is installed')
        for before, found in (
                (OTHER_VERSION, '0.0.7)'), (WITHOUT_PACKAGE, 'ModuleNotFoundError(')):
            _, address = processes.worker(before)
            assert rejected('bag', options=options).startswith(
                f'the worker {address} lacks fuzzy_stereo_ros {__version__} (it has {found}')
            processes.client.retire_workers([address])
        processes.worker(OTHER_OPENCV)
        assert replay('bag', options=options) == 0
        assert 'has opencv 4.0 (here ' in capfd.readouterr().err
        assert len(disparities(folder / 'out')) == 6


@pytest.mark.slow
def test_a_scheduler_without_the_package_is_rejected(rejected, scheduler):
    with scheduler(WITHOUT_PACKAGE) as processes:
        processes.worker()
        sentence = rejected('bag', options=['--scheduler', processes.address])
        assert sentence.startswith(f'{processes.address} cannot match (')
        assert f'): install fuzzy_stereo_ros {__version__} there' in sentence


@pytest.mark.slow
def test_pairs_that_kill_worker_after_worker_end_it(rejected, scheduler):
    with scheduler(DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES='0') as processes:
        processes.worker(DEADLY)
        assert rejected('bag', options=['--scheduler', processes.address]) == (
            f'workers of {processes.address} died over the same pairs, 1 in all: check their logs '
            'and their memory; no pair could be matched before that')


@pytest.mark.slow
def test_where_no_worker_is_left_it_does_not_wait_for_ever(
        rejected, scheduler, monkeypatch):
    monkeypatch.setattr(segments, 'NO_WORKER_SECONDS', 1)
    with scheduler() as processes:
        processes.worker(DEADLY)
        assert rejected('bag', options=['--scheduler', processes.address]) == (
            f'{processes.address} has had no worker for 1 s; no pair could be matched before '
            'that')
