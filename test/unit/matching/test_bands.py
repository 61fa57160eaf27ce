# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bands of rows, and the pool that works on them."""
import gc
from itertools import count
import os
from pathlib import Path
import sys
import threading
import time
from types import SimpleNamespace

from fuzzy_stereo_ros.matching import bands, StereoMatcher
from fuzzy_stereo_ros.matching.bands import (
    Chain, cut_bands, cut_parts, HelperAffinity, MOST_PARTS, SHORT, ThreadPool, widened)
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, settings, strategies as st
from made_scenes import bits
import numpy as np
import pytest

FOLDER = str(Path(bands.__file__).parent)
PATIENCE = 300      # s


@given(st.integers(1, 5000), st.integers(1, 300), st.integers(1, 200),
       st.sampled_from([SHORT, 1, 2]), st.integers(0, 4))
def test_bands_cover_each_row_once_in_order_to_a_row_of_tiles_and_each_thread_has_its_parts(
        rows, height, threads, each, reach):
    parts = cut_parts(rows, threads, height, each)
    assert len(parts) == max(min(
        int(threads * each) if threads > 1 else 1, rows // 30, MOST_PARTS, -(-rows // height)), 1)
    assert parts == ThreadPool(threads).parts(rows, height, each)
    assert all(first < last for _, first, last in parts)
    for cut in (cut_bands(rows, height=height), parts):
        assert [index for index, _, _ in cut] == list(range(len(cut)))
        assert [row for _, first, last in cut for row in range(first, last)] == list(range(rows))
        assert all(last % height == 0 or last == rows for _, _, last in cut)
        for band in cut:
            assert widened(band, reach, rows) == (
                max(band[1] - reach, 0), min(band[2] + reach, rows))


@pytest.mark.skipif(not hasattr(os, 'sched_getaffinity'), reason='needs Linux')
def test_helpers_keep_off_the_processor_of_the_calling_thread_unless_it_is_the_only_one(
        monkeypatch):
    pool, allowed, done = ThreadPool(3), os.sched_getaffinity(0), []

    def processors():
        pool.each(done.append, range(3))
        return [os.sched_getaffinity(helper.native_id) for helper in pool._helpers]

    for processor in sorted(allowed)[:2]:
        monkeypatch.setattr(bands, '_current_processor', lambda: processor)      # noqa: B023
        assert processors() == 2 * [allowed - {processor} or allowed]
        assert os.sched_getaffinity(0) == allowed
    monkeypatch.undo()
    try:
        os.sched_setaffinity(0, {min(allowed)})     # while the pool works
        assert processors() == 2 * [{min(allowed)}]
        assert ThreadPool(0).threads == 1
    finally:
        os.sched_setaffinity(0, allowed)
    assert ThreadPool(0).threads == len(allowed)
    assert all(used <= allowed for used in processors())
    assert done.count(0) == done.count(1) == done.count(2) > 2
    pool.close()


def test_helpers_change_over_within_frames_when_other_programs_begin_and_end():
    places, random = HelperAffinity(), np.random.default_rng(1)
    idle, busy = {True: 12, False: 15}, {True: 26, False: 20}      # time of a frame if apart
    for times in (idle, busy, idle, busy):
        taken = []
        for _ in range(400):
            taken.append(times[places.apart])
            places.add(times[places.apart] * (1 + 0.1 * random.standard_normal()))
        assert np.median(taken[100:]) == min(times.values())


def test_a_pool_measures_each_frame_once_a_thread_helps(monkeypatch):
    pool, alone, added = ThreadPool(2), ThreadPool(1), []
    for one in (pool, alone):
        monkeypatch.setattr(one.places, 'add', added.append)
    pool.each(lambda item: None, range(3))      # before the first frame
    shared = [pool.shared]
    for calls in (2, 0, 1):
        for one in (pool, alone):
            one.begin_frame()
            for _ in range(calls):
                one.each(lambda item: None, range(3))
        shared.append(pool.shared)
    pool.begin_frame()
    assert added == list(np.diff(shared)) and added[0] > added[1] == 0
    pool.close()


def test_nobody_waits_for_a_helper_that_does_other_work_and_it_ends_with_its_pool():
    pool, gate, done = ThreadPool(2), threading.Event(), []
    pool.each(done.append, range(2))
    (queue,) = pool._queues
    queue.put(SimpleNamespace(assist=lambda: gate.wait(20)))
    pool.each(done.append, range(2, 5))
    assert sorted(done) == [0, 1, 2, 3, 4] and not gate.is_set()
    gate.set()
    helper, = pool._helpers
    del pool
    helper.join(20)
    assert not helper.is_alive()


@pytest.mark.parametrize('threads', [1, 2, 5])
@settings(max_examples=40)
@given(st.lists(st.floats(0, 1), max_size=60))
def test_an_item_begins_once_the_items_it_needs_are_done(threads, shares):
    needs = [round(share * index) for index, share in enumerate(shares)]
    pool, done = ThreadPool(threads), set()

    def work(item):
        assert done.issuperset(range(needs[item - 100]))
        done.add(item - 100)
    pool.run(work, range(100, 100 + len(needs)), needs)
    pool.close()
    assert done == set(range(len(needs)))


@pytest.mark.parametrize('threads', [1, 2, 5])
@settings(max_examples=20)
@given(st.lists(st.integers(0, 5), max_size=40))
def test_mapped_returns_what_a_function_returns_for_each_item_in_order(threads, items):
    pool = ThreadPool(threads)
    assert pool.mapped(range, tuple(items)) == list(map(range, items))
    pool.close()


@pytest.mark.parametrize('needs, last', [([0, 0, 0, 3], [0, 3]), ([0, 1, 0, 3], [0, 1, 3])])
def test_no_thread_waits_while_an_item_may_begin(needs, last):
    pool, done, third = ThreadPool(2), [], threading.Event()

    def work(item):
        if item == 0:
            assert third.wait(20)       # which the other thread does meanwhile
        if item == 2:
            third.set()
        done.append(item)
    pool.run(work, range(4), needs)
    pool.close()
    assert done[-len(last):] == last


def test_each_item_is_done_once_where_threads_change_while_garbage_is_collected():
    """Before Python 3.12 that is possible within tuple(), which then reads beyond a list."""
    def change(*_):
        time.sleep(0.0003)

    pool, usual = ThreadPool(5), gc.get_threshold()
    gc.callbacks.append(change)
    try:
        for threshold in 3 * (*range(1, 20),):      # at each allocation sooner or later
            done = []
            gc.set_threshold(threshold)
            pool.each(lambda item: done.append([item]), range(1000, 1400))     # noqa: B023
            gc.set_threshold(*usual)
            assert sorted(done) == [[item] for item in range(1000, 1400)]
    finally:
        gc.set_threshold(*usual)
        gc.callbacks.remove(change)
        pool.close()


def test_stages_of_a_chain_need_those_before_or_the_bands_that_they_read():
    calls, done, bands = [], [], cut_bands(640)
    chain = Chain(SimpleNamespace(
        threads=2, parts=None, run=lambda *call: calls.append(call)))
    marks = [chain.each(done.append, bands, *rule)
             for rule in ((), (0,), (), (None, 0), (None, 1))]
    chain.each(done.append, bands)
    chain.each(done.append, bands, after=marks[-1])
    chain.run()
    (work, items, needs), = calls
    assert needs == [
        *[0] * 8, *[8] * 4, 9, 10, 11, 12, 14, 15, 16, 16, *[20] * 8]
    for item in items:
        work(item)
    assert done == list(7 * bands)


class Struck(BaseException):
    """An exception that comes at any line, as an interrupt does."""


def struck(strike, ours):
    """Return a function that traces lines and raises at one of them, and the counter of lines."""
    lines = count()

    def trace(frame, event, argument):
        if ours(frame) and event == 'line' and next(lines) == strike:
            raise Struck
        return trace if ours(frame) else None
    return trace, lines


# A helper that waits for its next call may end; another one takes its place.
@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
@settings(max_examples=100)
@given(st.integers(0, 400), st.integers(1, 4), st.lists(st.floats(0, 1), max_size=12))
def test_an_exception_at_any_line_of_any_thread_ends_the_call_for_all_threads(
        strike, threads, shares):
    needs = [round(share * index) for index, share in enumerate(shares)]
    pool, working, done, told = ThreadPool(threads), [], [], []

    def work(item):
        working.append(item)
        kernel.wait(0.0002)
        done.append(item)

    def call():
        sys.settrace(trace)
        try:
            pool.run(work, range(len(needs)), needs)
            told.append(None)
        except Struck as error:
            told.append(error)
        finally:
            sys.settrace(None)
            told.append(len(working))

    kernel = threading.Event()
    trace, _ = struck(strike, lambda frame: frame.f_code.co_filename == bands.__file__
                      or frame.f_code is work.__code__)
    threading.settrace(trace)       # of helpers
    caller = threading.Thread(target=call, daemon=True)
    caller.start()
    caller.join(PATIENCE)
    threading.settrace(None)
    assert not caller.is_alive()
    assert told[0] is not None or sorted(done) == list(range(len(needs)))
    done.clear()
    pool.run(done.append, range(9), range(9))
    assert done == list(range(9))
    assert told[1] == len(working)      # nobody has gone on
    pool.close()


def test_an_interrupt_at_any_line_ends_a_match_on_four_threads_and_the_next_one_is_as_before():
    def ours(frame):        # an interrupt finds the main thread wait while kernels are loaded
        file = frame.f_code.co_filename
        return file.startswith(FOLDER) and 'kernels' not in file

    left, right, *_ = make_pair(160, 240, 32, noise=2.0)
    matcher = StereoMatcher(disparities=32, threads=4, warm_start=False, fill=True)
    expected, number, interrupted = bits(matcher.match(left, right)), None, 0
    for share in (0, *np.random.default_rng(0).random(30)):     # at first lines are counted
        trace, lines = struck(number and int(share * number), ours)
        sys.settrace(trace)
        try:
            matcher.match(left, right)
        except Struck:
            interrupted += 1
        finally:
            sys.settrace(None)
        number = number or next(lines)
        assert bits(matcher.match(left, right)) == expected
    assert number > 1000 and interrupted > 15
