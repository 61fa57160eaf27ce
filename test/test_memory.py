# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Freed memory goes back to the system, and changes of parameters do not pile it up."""
import ctypes
import gc
from queue import SimpleQueue
import subprocess
import sys

from fuzzy_stereo_ros import memory, rig
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.guided_search import GuidedSearch
from fuzzy_stereo_ros.memory import give_back_memory, share_free_memory
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from node_process import ROOT, shifted_pair, START
from numba.core.dispatcher import Dispatcher
import pytest

# Blocks too small to be mapped one by one; the last one keeps those below from being let go.
SCATTERED = """
import os, sys, threading
from fuzzy_stereo_ros.measured_process import MeasuredProcess
from fuzzy_stereo_ros.memory import give_back_memory

kept = []

def scatter():
    blocks = [bytearray(b'x' * 100_000) for _ in range(500)]
    kept.append(blocks.pop())

thread = threading.Thread(target=scatter)
thread.start()
thread.join()
before = MeasuredProcess(os.getpid()).own_megabytes()
give_back_memory()
print(before - MeasuredProcess(os.getpid()).own_megabytes())
"""
# What is free at the end of an arena; the first lines are those with which the node begins.
AT_THE_END = """
import os, sys
from fuzzy_stereo_ros import memory
if sys.argv[1] == 'shared':
    import fuzzy_stereo_ros.node
import threading
from fuzzy_stereo_ros.measured_process import MeasuredProcess

def fill():
    blocks = [bytearray(b'x' * 100_000) for _ in range(300)]
    filled.set()
    free.wait()
    del blocks
    freed.set()
    end.wait()

before = MeasuredProcess(os.getpid()).own_megabytes()
events = filled, free, freed, end = [threading.Event() for _ in range(4)]
large = bytearray(b'x' * 30_000_000)    # once mapped and freed, glibc lets go of less from then on
del large
thread = threading.Thread(target=fill)
thread.start()
filled.wait()
free.set()
freed.wait()
memory.give_back_memory()
print(MeasuredProcess(os.getpid()).own_megabytes() - before)
end.set()
thread.join()
"""
HAS_TRIM = hasattr(ctypes.CDLL(None), 'malloc_trim')


@pytest.mark.skipif(not HAS_TRIM, reason='the C library has no malloc_trim')
def test_what_another_thread_has_freed_goes_back_to_the_system():
    done = subprocess.run([sys.executable, '-c', SCATTERED], cwd=ROOT, text=True,
                          capture_output=True, check=True)
    assert float(done.stdout) > 30


@pytest.mark.skipif(not HAS_TRIM, reason='the C library has no malloc_trim')
@pytest.mark.parametrize('how, kept', [('shared', range(-10, 10)), ('apart', range(20, 60))])
def test_what_a_thread_of_the_node_has_freed_goes_back_though_it_is_the_last(how, kept):
    done = subprocess.run([sys.executable, '-c', AT_THE_END, how], cwd=ROOT, text=True,
                          capture_output=True, check=True)
    assert int(float(done.stdout)) in kept


def test_without_such_a_call_nothing_happens(monkeypatch):
    monkeypatch.setattr(memory.ctypes, 'CDLL', lambda name: object())
    assert give_back_memory() is None
    assert share_free_memory() is None


def test_every_matcher_that_is_prepared_gives_back_what_was_freed(monkeypatch):
    called = []
    monkeypatch.setattr(rig, 'give_back_memory', lambda: called.append(True))
    made = rig.Rig(MatcherConfig(disparities=8), PairReader(), lambda config, error: None)
    made.warm_up()
    assert called == [True]
    assert made.close()


def test_a_matcher_that_is_replaced_and_images_of_another_size_are_given_back(monkeypatch):
    called = []
    told = SimpleQueue()
    made = rig.Rig(MatcherConfig(disparities=8), PairReader(), lambda *news: told.put(news))
    made.warm_up()
    monkeypatch.setattr(rig, 'give_back_memory', lambda: called.append(True))

    def match(rows):
        left, right = shifted_pair(3, rows)
        made.match_pair(StereoPair(left, right, calibration=None, stamp=None, frame_id=''))
        return len(called)

    assert [match(rows) for rows in (40, 40, 60, 60)] == [1, 1, 2, 2]
    made.use(MatcherConfig(disparities=16))
    assert told.get(timeout=START)[1] is None
    assert [match(60), match(60)] == [4, 4]     # prepared, and taken
    assert made.close()


def test_of_two_image_sizes_a_matcher_holds_one_at_a_time():
    held = []

    class Search(GuidedSearch):
        def __init__(self, *size):
            held.append(matcher.search)
            super().__init__(*size)

    matcher = StereoMatcher(MatcherConfig(disparities=8), Search)
    for rows in (40, 60):
        matcher.match(*shifted_pair(3, rows))
    assert held == [None, None]
    assert matcher.search is not None


@pytest.mark.parametrize('profile', ['realtime', 'quality', 'paper'])
def test_numba_keeps_nothing_of_a_match(profile):
    matcher = StereoMatcher(MatcherConfig.from_profile(profile, disparities=16))
    pair = shifted_pair(3, 48, 64)

    def kept_after(times):
        for _ in range(times):
            matcher.match(*pair)
        return sum(len(one._types_active_call) for one in gc.get_objects()
                   if isinstance(one, Dispatcher))

    assert kept_after(5) == kept_after(2)
