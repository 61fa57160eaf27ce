# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Freed memory goes back to the system, and changes of parameters do not pile it up."""
import ctypes
from queue import SimpleQueue
import sys

from fuzzy_stereo_ros import pair_matcher
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from made_scenes import shifted_pair
from node_process import START
from numba._dispatcher import compute_fingerprint
from numba.core.dispatcher import Dispatcher
import pytest
from repository import printed_by

MEASURING = """
import fuzzy_stereo_ros.node
from fuzzy_stereo_ros.program import give_back_memory
import psutil
import threading

def own_megabytes():
    memory = psutil.Process().memory_info()
    return (memory.rss - memory.shared) / 1e6
"""
# Blocks too small to be mapped one by one; the last one keeps those below from being let go.
SCATTERED = MEASURING.replace('.node', '') + """
kept = []

def scatter():
    blocks = [bytearray(b'x' * 100_000) for _ in range(500)]
    kept.append(blocks.pop())

thread = threading.Thread(target=scatter)
thread.start()
thread.join()
before = own_megabytes()
give_back_memory()
print(before - own_megabytes())
"""
# What is free at the end of an arena; the first line is that with which the node begins.
AT_THE_END = MEASURING + """
def fill():
    blocks = [bytearray(b'x' * 100_000) for _ in range(300)]
    filled.set()
    free.wait()
    del blocks
    freed.set()
    end.wait()

before = own_megabytes()
events = filled, free, freed, end = [threading.Event() for _ in range(4)]
large = bytearray(b'x' * 30_000_000)    # once mapped and freed, glibc lets go of less from then on
del large
thread = threading.Thread(target=fill)
thread.start()
filled.wait()
free.set()
freed.wait()
give_back_memory()
print(own_megabytes() - before)
end.set()
thread.join()
"""
# What is in use once all is compiled and Python's own lists of free objects are full, and later.
MATCHES = 500
MATCHING = f"""
import sys
sys.path[:0] = ['test/support']
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from made_scenes import shifted_pair
from bench.soak.soaked_node import held

matcher = StereoMatcher(MatcherConfig(disparities=24, threads=1))
for _ in range(2):
    for _ in range({MATCHES}):
        matcher.match(*shifted_pair(3, 96, 192))
    print(held()['megabytes'])
"""
HAS_TRIM = hasattr(ctypes.CDLL(None), 'malloc_trim')


def printed(program):
    """Return the numbers that a program prints in a process of its own."""
    return [float(number) for number in printed_by('-c', program).split()]


@pytest.mark.skipif(not HAS_TRIM, reason='the C library has no malloc_trim')
def test_what_another_thread_has_freed_goes_back_to_the_system_and_though_it_is_the_last():
    assert printed(SCATTERED)[0] > 30
    assert abs(printed(AT_THE_END)[0]) < 10


def test_a_matcher_that_is_replaced_and_images_of_another_size_are_given_back(monkeypatch):
    called = []
    ready = SimpleQueue()
    made = pair_matcher.PairMatcher(
        MatcherConfig(disparities=8), on_ready=lambda *news: ready.put(news))
    made.warm_up()
    monkeypatch.setattr(pair_matcher, 'give_back_memory', lambda: called.append(True))

    def match(rows):
        left, right = shifted_pair(3, rows)
        made.match(StereoPair(
            left, right, centred_calibration(100.0, 0.1, 0.0, *left.shape), stamp=None))
        return len(called)

    assert [match(rows) for rows in (40, 40, 60, 60)] == [1, 1, 2, 2]
    made.request(MatcherConfig(disparities=16))
    assert ready.get(timeout=START)[1] is None
    assert [match(60), match(60)] == [4, 4]     # prepared, and taken
    assert made.close()


def test_of_two_image_sizes_a_matcher_holds_one_at_a_time(monkeypatch):
    held = []

    class Noting(RealtimeMatcher):
        def __init__(self, *given):
            held.append(matcher.algorithm)
            super().__init__(*given)

    monkeypatch.setitem(ALGORITHMS, 'realtime', Noting)
    matcher = StereoMatcher(MatcherConfig(disparities=8))
    for rows in (40, 60):
        matcher.match(*shifted_pair(3, rows))
    assert held == [None, None]
    assert isinstance(matcher.algorithm, Noting)


CONFIGS = [MatcherConfig(disparities=16),
           MatcherConfig.from_profile('quality', disparities=16),
           MatcherConfig.from_profile('paper', disparities=16, population=4, generations=2)]
AT_ONCE = 40        # bytes of an argument's fingerprint that numba before 0.60 remembers


class Watched:
    """A kernel, or a module of them, that notes the fingerprints of tuples it is called with."""

    def __init__(self, wrapped, found):
        self._wrapped, self._found = wrapped, found

    def __getattr__(self, name):
        inner = getattr(self._wrapped, name)
        return Watched(inner, self._found) if isinstance(inner, Dispatcher) else inner

    def __call__(self, *arguments):
        self._found |= {(self._wrapped.__name__, compute_fingerprint(one))
                        for one in arguments if isinstance(one, tuple)}
        return self._wrapped(*arguments)


@pytest.mark.parametrize('config', CONFIGS)
def test_kernels_are_called_with_no_tuple_that_older_numba_would_keep_for_ever(
        config, monkeypatch):
    found = set()
    for name, module in [*sys.modules.items()]:
        if name.startswith('fuzzy_stereo_ros.matching.') and '.kernels' not in name:
            for place, one in vars(module).items():
                if isinstance(one, Dispatcher) or (
                        '.matching.kernels.' in getattr(one, '__name__', '')):
                    monkeypatch.setattr(module, place, Watched(one, found))
    matcher = StereoMatcher(config)
    for _ in range(2):
        matcher.match(*shifted_pair(3, 48, 64))
    assert found or config.algorithm == 'paper'
    assert [one for one in found if len(one[1]) > AT_ONCE] == []


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), 'mallinfo2'),
                    reason='the C library does not tell what is in use')
def test_a_match_leaves_nothing_behind():
    before, after = printed(MATCHING)
    assert (after - before) * 1e6 < 100 * MATCHES
