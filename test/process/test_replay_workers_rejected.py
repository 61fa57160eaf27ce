# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Workers that are not there or cannot match end `fuzzy-stereo replay` with one sentence."""
import os
import signal
import sys

from dask_processes import dask_processes
from fuzzy_stereo_ros import __version__
from fuzzy_stereo_ros.replay import segments
from made_bags import disparities, write_bag
import pytest
from replayed import rejection, replay, run

OTHER_VERSION = "import fuzzy_stereo_ros; fuzzy_stereo_ros.__version__ = '0.0.7'"
WITHOUT_PACKAGE = "import sys; sys.modules['fuzzy_stereo_ros'] = None"
OTHER_OPENCV = "import cv2; cv2.__version__ = '4.0'"
INTERRUPTED = 130
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
    """Work in a folder with a bag."""
    write_bag(folder / 'bag')
    return folder


@pytest.fixture
def rejected(folder, capfd):
    """Return a function that gives all that a replay in vain says, after which nothing is left."""
    def sentence(*options):
        text = rejection(capfd, 'bag', options=options)
        assert sorted(path.name for path in folder.iterdir()) == ['bag']
        return text

    return sentence


def test_options_that_ask_for_no_workers_are_rejected(rejected):
    assert rejected('--workers', 0) == '--workers is 0; allowed are whole numbers from 1'
    assert rejected('--workers', 2, '--scheduler', 'tcp://127.0.0.1:1') == (
        '--workers starts workers, --scheduler uses those of a cluster: give one of them')


def test_without_dask_the_sentence_says_what_to_install(rejected, monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    assert rejected('--workers', 2) == (
        'distributed is not installed: '
        "pip install 'fuzzy_stereo_ros[cluster]'")


@pytest.mark.parametrize('address', ['tcp://127.0.0.1:1', 'foo://bar:1'])
def test_an_address_without_scheduler_is_rejected(rejected, monkeypatch, address):
    monkeypatch.setattr(segments, 'CONNECT_SECONDS', 1)     # nobody is there to answer later
    assert rejected('--scheduler', address).startswith(
        f'--scheduler is {address}, where no Dask scheduler answers: ')


def test_an_address_that_is_none_leaves_nothing_that_ends_at_length(folder):
    ended = run(PLAIN, 0, 'bag', '--scheduler', 'nothing')
    sentence, = (line for line in ended.stderr.splitlines() if 'compiled kernels' not in line)
    assert sentence.endswith("answers: missing port number in address 'nothing'")


def test_workers_that_cannot_match_are_rejected(
        folder, rejected, tmp_path_factory, capfd, monkeypatch):
    with dask_processes(tmp_path_factory.mktemp('dask')) as processes:
        name = processes.address
        options = '--scheduler', name
        with monkeypatch.context() as patch:
            patch.setattr(segments, 'NO_WORKER_SECONDS', 1)
            assert rejected(*options) == (
                f'{name} has no workers: start some with `dask worker {name}` where '
                'fuzzy_stereo_ros is installed')
        for before, found in (
                (OTHER_VERSION, '0.0.7)'), (WITHOUT_PACKAGE, 'ModuleNotFoundError(')):
            _, address = processes.worker(before)
            assert rejected(*options).startswith(
                f'the worker {address} lacks fuzzy_stereo_ros {__version__} (it has {found}')
            processes.client.retire_workers([address])
        processes.worker(OTHER_OPENCV)
        assert replay('bag', options=options) == 0
        assert 'has opencv 4.0 (here ' in capfd.readouterr().err
        assert len(disparities(folder / 'out')) == 6


def test_a_scheduler_without_the_package_is_rejected(rejected, tmp_path_factory):
    with dask_processes(tmp_path_factory.mktemp('dask'), WITHOUT_PACKAGE) as processes:
        processes.worker()
        sentence = rejected('--scheduler', processes.address)
        assert sentence.startswith(f'{processes.address} cannot match (')
        assert f'): install fuzzy_stereo_ros {__version__} there' in sentence


def test_pairs_that_kill_worker_after_worker_end_it(rejected, tmp_path_factory):
    with dask_processes(tmp_path_factory.mktemp('dask'),
                        DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES='0') as processes:
        processes.worker(DEADLY)
        assert rejected('--scheduler', processes.address) == (
            f'workers of {processes.address} died over the same pairs, 1 in all: check their logs '
            'and their memory; no pair could be matched before that')


def test_where_no_worker_is_left_it_does_not_wait_for_ever(
        rejected, tmp_path_factory, monkeypatch):
    monkeypatch.setattr(segments, 'NO_WORKER_SECONDS', 1)
    with dask_processes(tmp_path_factory.mktemp('dask')) as processes:
        processes.worker(DEADLY)
        assert rejected('--scheduler', processes.address) == (
            f'{processes.address} has had no worker for 1 s; no pair could be matched before '
            'that')


def test_an_interruption_while_workers_start_ends_after_their_start(
        folder, capfd, monkeypatch):
    events = []

    def cluster(options, log, opened):
        opened.callback(closed)
        os.kill(os.getpid(), signal.SIGINT)
        events.append('started')

    def closed():
        os.kill(os.getpid(), signal.SIGINT)
        events.append('closed')

    monkeypatch.setattr(segments, '_open_cluster', cluster)
    handler = signal.getsignal(signal.SIGINT)
    assert replay('bag', options=['--workers', 1]) == INTERRUPTED
    assert events == ['started', 'closed']
    assert signal.getsignal(signal.SIGINT) is handler
    assert capfd.readouterr().err == ''
    assert [path.name for path in folder.iterdir()] == ['bag']
