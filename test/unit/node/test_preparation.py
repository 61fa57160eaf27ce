# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Preparation: the newest wish wins, faults are told, nothing waits for it."""
from queue import SimpleQueue
import threading

from fuzzy_stereo_ros.preparation import FAILED, Preparation, PREPARING, READY
import pytest
from repository import ROOT

SOON = 60.0     # s; nothing here takes long, events are awaited: when to give up


class Bench:
    """A preparation that waits for a permit for each wish: None, or what to raise."""

    def __init__(self):
        self.begun, self.permits, self.told = SimpleQueue(), SimpleQueue(), SimpleQueue()
        self.preparation = Preparation(self.make, lambda *what: self.told.put(what))

    def make(self, wish):
        self.begun.put(wish)
        error = self.permits.get(timeout=SOON)
        if error is not None:
            raise error
        return f'made {wish}'


@pytest.fixture
def bench():
    bench = Bench()
    yield bench
    assert bench.preparation.close(SOON)


def test_what_is_made_is_taken_once_and_asking_does_not_wait(bench):
    assert (bench.preparation.state, bench.preparation.take()) == ('', None)
    bench.preparation.ask('a')
    assert (bench.preparation.state, bench.preparation.take()) == (PREPARING, None)
    bench.permits.put(None)
    assert bench.told.get(timeout=SOON) == ('a', None)
    assert bench.preparation.state == READY
    assert bench.preparation.take() == 'made a'
    assert (bench.preparation.state, bench.preparation.take()) == ('', None)


def test_the_newest_wish_takes_the_place_of_all_before_it(bench):
    bench.preparation.ask('a')
    assert bench.begun.get(timeout=SOON) == 'a'
    bench.preparation.ask('b')
    bench.preparation.ask('c')
    bench.permits.put(None)
    assert bench.begun.get(timeout=SOON) == 'c'
    assert (bench.preparation.state, bench.preparation.take()) == (PREPARING, None)
    bench.permits.put(None)
    assert bench.told.get(timeout=SOON) == ('c', None)
    assert bench.preparation.take() == 'made c'


def test_what_is_ready_and_not_taken_is_dropped_for_a_newer_wish(bench):
    bench.permits.put(None)
    bench.preparation.ask('a')
    bench.told.get(timeout=SOON)
    bench.preparation.ask('b')
    assert bench.preparation.take() is None
    bench.permits.put(None)
    assert bench.told.get(timeout=SOON)[0] == 'b'
    assert bench.preparation.take() == 'made b'


def test_a_fault_is_told_and_the_next_wish_is_made(bench):
    fault = MemoryError('too large')
    bench.permits.put(fault)
    bench.preparation.ask('a')
    assert bench.told.get(timeout=SOON) == ('a', fault)
    assert (bench.preparation.state, bench.preparation.take()) == (FAILED, None)
    bench.permits.put(None)
    bench.preparation.ask('b')
    assert bench.told.get(timeout=SOON) == ('b', None)
    assert bench.preparation.take() == 'made b'


def test_closing_waits_for_what_is_made_and_drops_it():
    bench = Bench()
    bench.preparation.ask('a')
    bench.begun.get(timeout=SOON)
    assert not bench.preparation.close(0.01)
    closer = threading.Thread(target=bench.preparation.close)
    closer.start()
    bench.permits.put(None)
    closer.join(SOON)
    assert not closer.is_alive()
    bench.preparation.ask('b')
    assert bench.preparation.take() is None
    assert bench.told.empty()


def test_no_kernel_is_parallel_as_two_threads_call_them():
    for path in (ROOT / 'fuzzy_stereo_ros').rglob('*.py'):
        text = path.read_text(encoding='utf-8')
        assert 'parallel=True' not in text, path
        assert 'prange' not in text, path
