# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for tests with real nodes, and an empty folder."""
from contextlib import closing, contextmanager, ExitStack
import gc
import os
from pathlib import Path
import resource
import shutil
import signal
import sys

from fuzzed import USUAL
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.kernels import compiled
from fuzzy_stereo_ros.matching.realtime import matcher
from hypothesis import settings
from node_process import NodeProcess, own_domain, ros_environment
import pytest
from repository import ROOT

HERE = Path(__file__).parent
sys.path.append(str(ROOT))      # bench/, which is not installed, after what is
SLOW_FOLDERS = 'fuzz', 'process', 'ros'
# `make fuzz` takes it: so many times the examples of each fuzz test, and what takes minutes.
settings.register_profile('fuzz', max_examples=USUAL * int(os.environ.get('FUZZ_TIMES', 100)),
                          print_blob=True)
# Without it the same examples are drawn each time: where it turns red, the change did it. The
# first example of a kernel may compile it.
settings.register_profile('same', derandomize=True, deadline=None)
settings.load_profile('same')


# A shell has SIGINT ignored in what it runs in the background, and Python inherits that.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Mark the tests of slow folders as slow, but those marked as quick; launches take longer."""
    for item in items:
        folder = item.path.relative_to(HERE).parts[0]
        if folder in SLOW_FOLDERS and not item.get_closest_marker('quick'):
            item.add_marker(pytest.mark.slow)
        if item.path.name == 'test_launch.py':      # one item that launches one case after another
            item.add_marker(pytest.mark.timeout(3 * 600))


def pytest_collection_finish():
    """Let the garbage collector pass over the thousands of tests that were collected."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makemodule(module_path, parent):
    """Let a module that skips itself skip no other ones, although launch_testing imports it."""
    try:
        return (yield)
    except pytest.skip.Exception:
        return pytest.Module.from_parent(parent, path=module_path)


@pytest.fixture(scope='session', autouse=True)
def threads_at_any_size():
    """Let several threads match small scenes, too: users have larger ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matcher, 'FEWEST_SHARED', 0)
        yield


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def copy_kernels(tmp_path, monkeypatch):
    """Return a function that warms up a profile, and lets processes use a copy of the kernels."""
    def copy(profile, *without):
        StereoMatcher(MatcherConfig.from_profile(profile)).warm_up(*WARM_UP_SIZE)
        monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
        return shutil.copytree(compiled.FOLDER, tmp_path / compiled.NAME / compiled.FOLDER.name,
                               ignore=shutil.ignore_patterns(*without))

    return copy


@pytest.fixture
def limit_files():
    """Return a function of the bytes beyond which no file can be written until the test ends."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope='module')
def ros(tmp_path_factory):
    """Set what tests with ROS and the processes they start need in the environment."""
    pytest.importorskip('rclpy', reason='rclpy is not importable: no ROS 2 here')
    with pytest.MonkeyPatch.context() as patch:
        for name, value in ros_environment(tmp_path_factory.mktemp('ros_log')).items():
            patch.setenv(name, value)
        yield


@pytest.fixture
def start_node(ros):
    """Return a function that starts the node as a `NodeProcess`, all in one domain."""
    with own_domain() as domain, ExitStack() as started:
        def start(*arguments):
            node = NodeProcess(domain, *arguments)
            started.callback(node.finish)
            return node

        yield start


@pytest.fixture(scope='module')
def make_bench(ros):
    """Return a context manager: the node, started with arguments, on a `ros_bench.Bench`."""
    from ros_bench import Bench

    @contextmanager
    def make(*arguments, **options):
        with own_domain() as domain, closing(Bench(domain, *arguments, **options)) as bench:
            yield bench

    return make


@pytest.fixture(scope='module')
def bench(request, make_bench):
    """Return one node, with the ARGUMENTS of a module of tests, that has matched its PAIR."""
    with make_bench('--ros-args', *request.module.ARGUMENTS,
                    **getattr(request.module, 'RIG', {})) as bench:
        bench.begin(*request.module.PAIR)
        yield bench
