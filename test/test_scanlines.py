# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scanline passes: one step, the carrying between windows, and the sum of the four directions."""
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import Crew, OVERLAP
from fuzzy_stereo_ros.matching.census_possibility import FULL_SIZE, HALF_SIZE
from fuzzy_stereo_ros.matching.kernels.scanlines import realign, step
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.scanline_guess import gene_type, prior_of, ScanlineGuess
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
import reference_census as twins

RULES = (1, 4), (0, 4)
bytes_of_labels = st.integers(1, 3).flatmap(lambda blocks: arrays.arrays(
    np.uint8, (2, LANES * blocks), elements=st.integers(0, 255)))


# ---- one step ----


@settings(max_examples=200, deadline=None)
@given(bytes_of_labels, st.integers(0, 255), st.integers(0, 255))
def test_a_step_is_that_of_the_twin_and_saturates(paths_and_costs, jump, small):
    before, costs = paths_and_costs
    least, blocks = before.min(), before.size // LANES
    expected = twins.pass_along(np.stack([before, costs]).astype(np.int64)[None],
                                np.array([[0, jump]]), small)[0, 1]
    path = np.full(before.size + 7, 99, np.uint8)
    path[7:] = before
    found = step(path, 7, blocks, least, np.uint8(jump), np.uint8(small), costs, 0)
    assert path[7:].tolist() == expected.tolist()
    assert found == expected.min()
    assert np.all(path[:7] == 99)


@settings(max_examples=100, deadline=None)
@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 200), st.integers(0, 200))
def test_paths_are_carried_to_another_window_with_255_where_it_is_new(
        blocks, new_blocks, low, new_low):
    path = np.arange(1, LANES * blocks + 1).astype(np.uint8)
    everything = np.full(400, 255, np.uint8)
    everything[low:low + path.size] = path
    out = np.zeros(LANES * new_blocks + 3, np.uint8)
    scratch = np.zeros(LANES * blocks + 128, np.uint8)
    realign(path, 0, blocks, low, out, 3, new_blocks, new_low, scratch)
    assert out[3:].tolist() == everything[new_low:new_low + LANES * new_blocks].tolist()
    assert not out[:3].any()


# ---- whole images ----


class Scanned:
    """A pair searched, and the twin's sums of it."""

    def __init__(self, shape, disparities, tile=0, model=FULL_SIZE, min_disparity=0,
                 windows_seed=None, priors=False, threads=1, channels=0):
        left, right = small_pair(*shape, disparity=min(4, shape[1] - 1), channels=channels)
        self.disparities = disparities
        self.possibility = seen(left, right, disparities, min_disparity, model)
        self.guess = ScanlineGuess(self.possibility, tile)
        if windows_seed is not None:
            self._choose_windows(np.random.default_rng(windows_seed))
        self.priors = [self._prior(shape, seed) for seed in (1, 2)] if priors else []
        self.crew = Crew(threads)
        self.search()
        self._pair = left, right, min_disparity, model

    def search(self):
        self.guess.search(self.crew, *self.priors)

    def _prior(self, shape, seed):
        return prior_of(random_map(shape, self.disparities, seed, gene_type(self.disparities)),
                        random_map(shape, 3, seed), self.disparities, *RULES)

    def _choose_windows(self, chance):
        windows, most = self.guess.windows, self.guess.most_blocks
        windows.blocks[:] = chance.integers(1, most + 1, windows.blocks.shape)
        last = np.maximum(self.disparities - LANES * windows.blocks, 0)
        windows.low[:] = chance.integers(0, last + 1)
        self.guess.pack()

    def twin(self):
        """Return sums (R, C, D) and the windows: low, high, tile."""
        left, right, min_disparity, model = self._pair
        windows, labels = self.guess.windows, self.disparities
        costs = twin_costs(left, right, labels, min_disparity, model)
        if model.box:
            costs = twins.box_costs(costs, model.box)
        for prior in self.priors:
            costs = costs + twins.prior_costs(prior.labels, prior.weights, RULES, labels)
        high = np.minimum(windows.low + LANES * windows.blocks, labels)
        search = windows.low, high, windows.width
        grey = self.possibility.left.grey[:, :left.shape[1]]
        across, down = twins.jump_penalties(grey, twins.jump_table(model))
        sums = twins.summed_passes(
            costs, twins.outside_windows(costs.shape, *search), across, down, model.small,
            [band[1:] for band in self.guess.bands], OVERLAP)
        return sums, search


def check(scanned):
    sums, search = scanned.twin()
    chosen = scanned.guess.chosen
    for name, expected in zip(('labels', 'offsets', 'sums', 'margins'),
                              twins.chosen(sums, *search)):
        np.testing.assert_array_equal(getattr(chosen, name), expected, name)
    target = twins.chosen_by_target(sums, *search)
    pointed_at = target >= 0
    np.testing.assert_array_equal(chosen.target[pointed_at], target[pointed_at] % 256)


@pytest.mark.parametrize('shape', [(1, 1), (1, 9), (9, 1), (2, 2), (5, 7), (13, 37)])
@pytest.mark.parametrize('disparities', [1, 31, 32, 33])
def test_chosen_labels_of_every_size_are_those_of_the_twin(shape, disparities):
    check(Scanned(shape, disparities))


@pytest.mark.parametrize('disparities', [255, 256, 257, 512])
def test_chosen_labels_are_those_of_the_twin_up_to_many_disparities(disparities):
    check(Scanned((3, 300), disparities, channels=3))


@pytest.mark.parametrize('min_disparity', [-20, -3, 4, 40])
def test_chosen_labels_from_another_smallest_disparity_are_those_of_the_twin(min_disparity):
    check(Scanned((6, 35), 20, min_disparity=min_disparity))


@pytest.mark.parametrize('shape', [(1, 9), (2, 2), (7, 20)])
@pytest.mark.parametrize('disparities', [1, 33, 70])
def test_the_half_size_model_sums_boxes_and_is_that_of_the_twin(shape, disparities):
    check(Scanned(shape, disparities, model=HALF_SIZE))


@pytest.mark.parametrize('disparities', [33, 128, 300])
@pytest.mark.parametrize('shape, tile', [((9, 21), 8), ((17, 30), 6), ((5, 7), 4), ((1, 20), 4)])
def test_tiles_that_search_windows_of_their_own_are_those_of_the_twin(shape, tile, disparities):
    for seed in range(3):
        check(Scanned(shape, disparities, tile, windows_seed=seed))


@pytest.mark.parametrize('disparities, tile', [(1, 0), (33, 0), (100, 8), (300, 8)])
def test_priors_take_part_in_the_passes(disparities, tile):
    check(Scanned((9, 25), disparities, tile, windows_seed=4, priors=True))


@pytest.mark.parametrize('tile', [0, 64, 20])
@pytest.mark.parametrize('rows', [127, 128, 133])
def test_the_bands_of_larger_images_start_their_paths_outside(rows, tile):
    scanned = Scanned((rows, 12), 40, tile, windows_seed=2)
    assert len(scanned.guess.bands) == (2 if rows >= 128 else 1)
    check(scanned)


@pytest.mark.parametrize('model', [FULL_SIZE, HALF_SIZE])
def test_four_bands_at_both_sizes_are_those_of_the_twin(model):
    scanned = Scanned((641, 5), 5, model=model, threads=3)
    assert len(scanned.guess.bands) == 4
    check(scanned)


def test_what_was_searched_before_leaves_no_trace():
    scanned = Scanned((40, 50), 64, tile=16, windows_seed=1)
    before = [values.copy() for values in scanned.guess.chosen]
    windows = scanned.guess.windows.low.copy(), scanned.guess.windows.blocks.copy()
    scanned.guess.search_everything()
    scanned.search()
    assert not np.array_equal(scanned.guess.chosen.labels, before[0])
    scanned.guess.windows.low[:], scanned.guess.windows.blocks[:] = windows
    scanned.guess.pack()
    scanned.search()
    for values, expected in zip(scanned.guess.chosen, before):
        np.testing.assert_array_equal(values, expected)


def test_a_shifted_scene_is_found():
    left, right = small_pair(40, 60, disparity=7)
    guess = ScanlineGuess(seen(left, right, 32), 0)
    guess.search(Crew(1))
    inside = np.s_[4:-4, 12:-4]
    assert np.mean(guess.chosen.labels[inside] == 7) > 0.98
