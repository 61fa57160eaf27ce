# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Freed memory goes back to the system, and changes of parameters do not pile it up."""
import ctypes
import subprocess
import sys

from fuzzy_stereo_ros import memory, rig
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.memory import give_back_memory
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from node_process import ROOT
import pytest

# Blocks too small to be mapped one by one; the last one keeps those below from being let go.
SCATTERED = """
import os, sys, threading
sys.path.insert(0, 'test')
from soak_figures import megabytes_of
from fuzzy_stereo_ros.memory import give_back_memory

kept = []

def scatter():
    blocks = [bytearray(b'x' * 100_000) for _ in range(500)]
    kept.append(blocks.pop())

thread = threading.Thread(target=scatter)
thread.start()
thread.join()
before = megabytes_of(os.getpid())
give_back_memory()
print(before - megabytes_of(os.getpid()))
"""
HAS_TRIM = hasattr(ctypes.CDLL(None), 'malloc_trim')


@pytest.mark.skipif(not HAS_TRIM, reason='the C library has no malloc_trim')
def test_what_another_thread_has_freed_goes_back_to_the_system():
    done = subprocess.run([sys.executable, '-c', SCATTERED], cwd=ROOT, text=True,
                          capture_output=True, check=True)
    assert float(done.stdout) > 30


def test_without_such_a_call_nothing_happens(monkeypatch):
    monkeypatch.setattr(memory.ctypes, 'CDLL', lambda name: object())
    assert give_back_memory() is None


def test_every_matcher_that_is_prepared_gives_back_what_was_freed(monkeypatch):
    called = []
    monkeypatch.setattr(rig, 'give_back_memory', lambda: called.append(True))
    made = rig.Rig(MatcherConfig(disparities=8), PairReader(), lambda config, error: None)
    made.warm_up()
    assert called == [True]
    assert made.close()
