# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bands of rows, and the pool that works on them."""
import threading

from fuzzy_stereo_ros.matching.bands import cut_bands, ThreadPool
from hypothesis import given, strategies as st
import pytest


@given(st.integers(1, 5000), st.integers(1, 300))
def test_bands_cover_each_row_once_and_in_order_and_end_with_a_row_of_tiles(rows, height):
    bands = cut_bands(rows, height)
    assert [index for index, _, _ in bands] == list(range(len(bands)))
    assert [row for _, first, last in bands for row in range(first, last)] == list(range(rows))
    assert all(last % height == 0 or last == rows for _, _, last in bands)


@given(st.integers(1, 5000), st.sampled_from([1, 8, 64]))
def test_bands_are_of_like_size(rows, height):
    bands = cut_bands(rows, height)
    for _, first, last in bands:
        assert abs(last - first - rows / len(bands)) < height + 1


def test_a_thread_pool_counts_the_time_of_its_calls():
    pool = ThreadPool(2)
    assert pool.shared == 0
    pool.each(lambda item: None, range(3))
    first = pool.shared
    pool.each(lambda item: threading.Event().wait(0.02), range(2))
    assert pool.shared > first + 15 and first > 0
    pool.close()


@pytest.mark.parametrize('rows, count', [
    (1, 1), (127, 1), (128, 2), (639, 2), (640, 4), (1279, 4), (1280, 8), (4000, 8)])
def test_larger_images_are_cut_into_more_bands(rows, count):
    assert len(cut_bands(rows)) == count


@pytest.mark.parametrize('threads', [1, 2, 3])
def test_a_thread_pool_does_all_the_work_before_it_returns(threads):
    pool, done = ThreadPool(threads), []
    pool.each(done.append, range(20))
    pool.close()
    assert sorted(done) == list(range(20))


def test_two_threads_work_at_the_same_time():
    pool, both = ThreadPool(2), threading.Barrier(2, timeout=20)
    pool.each(lambda _: both.wait(), range(2))
    pool.close()


@pytest.mark.parametrize('threads', [1, 2])
def test_an_error_of_the_work_is_raised(threads):
    pool = ThreadPool(threads)
    with pytest.raises(ZeroDivisionError):
        pool.each(lambda item: 1 // item, [2, 1, 0])
    pool.close()


def test_0_threads_means_one_per_core():
    pool = ThreadPool(0)
    assert pool.threads >= 1
    pool.close()


def test_the_threads_of_a_deleted_thread_pool_end():
    before = set(threading.enumerate())
    pool = ThreadPool(3)
    helpers = set(threading.enumerate()) - before
    assert len(helpers) == 2
    del pool
    for helper in helpers:
        helper.join(20)
        assert not helper.is_alive()
