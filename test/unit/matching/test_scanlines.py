# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scanline passes: the sum of four directions, and the label of least cost."""
from census_scene import seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.scanlines.tasks import ACROSS, COMPLETE
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    SearchResult)
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import choose_of_target
from fuzzy_stereo_ros.matching.realtime import scanlines
from fuzzy_stereo_ros.matching.realtime.possibility import HALF_SIZE
from fuzzy_stereo_ros.matching.realtime.scanlines import (
    OVERLAP, Scanlines, SHIFT)
from hypothesis import given, settings, strategies as st
import numba
import numpy as np
import pytest
import reference_census as twins

GUARD = 64      # bytes


def guarded(like):
    """Return an array like another amid GUARD bytes that nobody may write, and all of it."""
    whole = np.full(like.nbytes + 2 * GUARD, 0xA5, np.uint8)
    return whole[GUARD:-GUARD].view(like.dtype).reshape(like.shape), whole


class Scanned:
    """A pair searched, and the twin's sums of it."""

    # The working memory begins as noise, so that nothing is read that was not written before; what
    # lies between its parts, and around the chosen maps, must stay as it was.

    def __init__(self, shape, disparities, tile=64, min_disparity=0, threads=1, channels=0):
        left, right = small_pair(*shape, disparity=min(4, shape[1] - 1), channels=channels)
        self.disparities = disparities
        self.possibility = seen(left, right, disparities, min_disparity, HALF_SIZE)
        self.scanlines = Scanlines(self.possibility, tile)
        maps, self._guarded = zip(*map(guarded, self.scanlines.chosen))
        self.scanlines.chosen = SearchResult(*maps)
        self.pool = ThreadPool(threads)
        self.scanlines._reserve(threads)
        self.search()
        self.pool.close()
        self._pair = left, right, min_disparity

    def search(self):
        for memory in (*self.scanlines._memory, self.scanlines.memory):
            memory[:] = np.random.default_rng(1).integers(0, 256, memory.size)
        before = self._unused()
        self.scanlines.search(self.pool)
        assert self._unused() == before
        for whole in self._guarded:
            assert np.all(whole[:GUARD] == 0xA5)
            assert np.all(whole[-GUARD:] == 0xA5)

    def _unused(self):
        """Return the bytes of the working memory that belong to none of its parts."""
        scanlines, unused = self.scanlines, []
        shared = scanlines._shared.values()
        # threads take and return working memory in any order
        own = sorted(({*places} - {*shared, *scanlines._numbers.values()}
                      for places in scanlines._free), key=min)
        memories = sorted(scanlines._memory, key=lambda memory: memory.ctypes.data)
        for places, memory in zip((shared, *own), (scanlines.memory, *memories)):
            starts = sorted(place - memory.ctypes.data for place in places)
            unused += [memory[start - SHIFT:start].tobytes() for start in starts[1:]]
            unused.append(memory[-SHIFT:].tobytes())
        return unused

    def twin(self):
        """Return the sums (R, C, D)."""
        left, right, min_disparity = self._pair
        costs = twins.box_costs(twin_costs(
            left, right, self.disparities, min_disparity, HALF_SIZE), HALF_SIZE.box)
        grey = self.possibility.left.grey[:, :left.shape[1]]
        across, down = twins.jump_penalties(grey, twins.jump_table(HALF_SIZE))
        return twins.summed_passes(
            costs, None, across, down, HALF_SIZE.small, self.scanlines.tile, OVERLAP)


def check(scanned):
    chosen, expected = scanned.scanlines.chosen, twins.chosen(scanned.twin())
    for name, values in zip(('labels', 'offsets', 'sums', 'margins'), expected):
        np.testing.assert_array_equal(getattr(chosen, name), values, name)
    extra = chosen.target.shape[1] - chosen.labels.shape[1]
    np.testing.assert_array_equal(
        chosen.target, twins.chosen_by_target(expected[0], expected[2], extra), 'target')


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.integers(1, 24),
       st.integers(1, 130) | st.sampled_from([255, 256, 257, 512]), st.integers(1, 50),
       st.integers(-60, 9) | st.sampled_from([-2048, -200, 40]), st.sampled_from([0, 3]))
def test_any_size_of_images_and_tiles_is_that_of_the_twin(
        rows, columns, disparities, tile, min_disparity, channels):
    check(Scanned((rows, columns), disparities, tile, min_disparity, channels=channels))


@pytest.mark.parametrize('disparities', [256, 257])
def test_labels_of_a_byte_and_of_two_in_wide_images_are_those_of_the_twin(disparities):
    check(Scanned((3, 300), disparities, channels=3))


@pytest.fixture(params=[0, 5000, 4 << 20])
def step_size(request, monkeypatch):
    """Have steps of one row of tiles, of some, and of all."""
    monkeypatch.setattr(scanlines, 'STRIP_BYTES', request.param)


@pytest.mark.parametrize('shape, disparities, tile, options', [
    *(((rows, 12), 40, tile, {}) for rows in (127, 128, 150) for tile in (1000, 64, 20, 6)),
    ((641, 5), 5, 64, {'threads': 3})])
def test_rows_of_tiles_are_those_of_the_twin_however_many_are_a_step(
        step_size, shape, disparities, tile, options):
    check(Scanned(shape, disparities, tile, **options))


@pytest.mark.parametrize('rows, tile', [(480, 64), (31, 64), (100, 20), (64, 1), (97, 16)])
def test_each_item_waits_for_the_rows_it_needs_and_for_those_whose_memory_it_takes(
        step_size, rows, tile):
    made = Scanlines(seen(*small_pair(rows, 130), 5, model=HALF_SIZE), tile)
    tiles, kept = -(-130 // tile), made._numbers['kept']
    begun, completed, chosen = [0], [[0] * tiles], 0     # rows, and rows of tiles, after each task
    for index, (kind, first, last, column, need) in enumerate(made._tasks.tolist()):
        assert need <= index
        after = completed[-1].copy()
        if kind == ACROSS:
            assert first == begun[-1]
            assert (last - 1) // tile - min(completed[need]) < kept
        elif kind == COMPLETE:
            assert begun[need] >= min(tile * last + OVERLAP, rows)
            assert first == completed[-1][column] == completed[need][column]
            after[column] = last
        else:
            assert first == chosen
            assert tile * min(completed[need]) >= last
            chosen = last
        begun.append(last if kind == ACROSS else begun[-1])
        completed.append(after)
    assert begun[-1] == chosen == rows
    assert completed[-1] == [-(-rows // tile)] * tiles


@pytest.mark.parametrize('most', [1, 7])
def test_a_kernel_that_may_take_few_tasks_is_called_until_all_are_done(most):
    whole, some = (Scanned((150, 40), 40, 16) for _ in range(2))
    some.pool.shares = lambda needs: ([most] * -(-len(needs) // most), [0] * len(needs))
    some.search()
    for values, expected in zip(some.scanlines.chosen, whole.scanlines.chosen):
        np.testing.assert_array_equal(values, expected)


costs = st.integers(0, 255)


def check_target(labels, sums, extra=0):
    """Check a row against the twin; nothing else may change."""
    columns, size = labels.size, extra + labels.size
    target, rivals = np.full(size + 6, 99, np.uint8), np.full(size + 6, 999, np.uint16)
    numba.njit(choose_of_target)(
        labels.ctypes.data, labels.itemsize, sums.ctypes.data, columns, rivals.ctypes.data + 2 * 3,
        target.ctypes.data + 3, size)
    expected = twins.chosen_by_target(labels[None], sums[None], extra)[0]
    assert target.tolist() == [99] * 3 + expected.tolist() + [99] * 3
    assert np.all(rivals[:3] == 999)
    assert np.all(rivals[-3:] == 999)


def test_pixels_farther_than_256_labels_apart_compete_for_the_target_too():
    labels = np.zeros(600, np.uint16)
    labels[[10, 267, 523, 599]] = 5, 262, 518, 599 - 5
    for dearer in ([5, 5, 5, 5], [4, 5, 5, 5], [5, 5, 4, 5], [255, 255, 255, 255]):
        sums = np.full(600, 7, np.uint8)
        sums[[10, 267, 523, 599]] = dearer
        check_target(labels, sums)
