# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the half-size map tells the full search: windows of labels, weak texture, a prior."""
from census_scene import random_map, small_pair
from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.census_possibility import fine_places, HALF_SIZE
from fuzzy_stereo_ros.matching.coarse_guess import CoarseGuess, SPECKLE
from fuzzy_stereo_ros.matching.kernels.consistency import REFUSED
from fuzzy_stereo_ros.matching.kernels.narrowing import (
    flat, lean_on_half, tile_windows, weak_texture)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.scanline_guess import gene_type
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census
import reference_refinement
import reference_search as twins

sizes = st.integers(2, 40)
SHAPES = [(2, 2), (3, 3), (2, 9), (9, 2), (13, 21), (16, 40)]


def windows_of(half, previous, trusted, disparities, tile, grow, margin):
    tiles = -(-previous.shape[0] // tile), -(-previous.shape[1] // tile)
    low, blocks = np.full(tiles, -1), np.full(tiles, -1)
    tile_windows(half, previous, trusted, disparities, tile, grow, margin, low, blocks)
    return low, blocks


@settings(max_examples=150, deadline=None)
@given(sizes, sizes, st.sampled_from([1, 2, 31, 33, 64, 100, 256, 257, 500]),
       st.sampled_from([4, 8, 16, 64]), st.sampled_from([0, 2, 8]), st.integers(0, 6),
       st.integers(1, 500), st.integers(0, 999))
def test_a_tile_searches_the_labels_around_it_and_no_block_too_many(
        rows, columns, disparities, tile, grow, margin, spread, seed):
    dtype, spread = gene_type(disparities), min(spread, disparities)
    half = random_map((rows // 2, columns // 2), -(-spread // 2), seed, dtype)
    previous = random_map((rows, columns), spread, seed + 1, dtype)
    trusted = (random_map((rows, columns), 20, seed + 2) == 0).astype(np.uint8)
    low, blocks = windows_of(half, previous, trusted, disparities, tile, grow, margin)
    for at in np.ndindex(low.shape):
        wanted = twins.labels_around_tile(half, tile, at, grow)
        wanted += twins.trusted_in_tile(previous, trusted, tile, at)
        wanted = wanted or [0, disparities - 1]
        least = max(min(wanted) - margin, 0)
        largest = min(max(wanted) + margin, disparities - 1)
        first, number = low[at], blocks[at]
        assert 0 <= first <= least
        assert largest < first + LANES * number
        assert number == -(-(largest - least + 1) // LANES)
        assert first + LANES * number <= max(disparities, LANES * number)
        assert number <= -(-disparities // LANES)


def test_a_window_stands_in_the_middle_of_what_it_must_hold():
    half = np.full((8, 8), 50, np.uint8)
    nothing = np.zeros((16, 16), np.uint8)
    low, blocks = windows_of(half, nothing, nothing, 256, 16, 0, 4)
    assert blocks.tolist() == [[1]]
    assert low.tolist() == [[96 - (32 - 10) // 2]]       # 96 .. 105 are wanted


@settings(max_examples=60, deadline=None)
@given(sizes, sizes, st.integers(1, 256), st.integers(0, 700), st.integers(0, 999))
def test_weak_texture_is_that_of_the_twin(rows, columns, greys, limit, seed):
    grey = random_map((rows, columns), greys, seed)
    padded = np.pad(grey, ((0, 0), (0, 64)))
    half = rows // 2, columns // 2
    steps, weak = np.zeros(half, np.uint16), np.full(half, 9, np.uint8)
    weak_texture(padded, *half, limit, steps, weak)
    np.testing.assert_array_equal(weak, twins.weak_texture(grey, limit))


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', [(1, 1), (1, 9), (9, 1), (2, 2), (8, 11)])
@pytest.mark.parametrize('most', [0, 1, 3])
def test_flat_is_that_of_the_twin(shape, dtype, most):
    labels = random_map(shape, 3 + most, 1, dtype)
    labels[:, shape[1] // 2:] = 7
    smooth = np.full(shape, 9, np.uint8)
    flat(labels, most, smooth)
    np.testing.assert_array_equal(smooth, twins.flat(labels, most))


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', SHAPES)
def test_the_half_map_is_leant_on_where_texture_is_weak_and_it_is_flat_and_not_refused(
        shape, dtype):
    size = shape[0] // 2, shape[1] // 2
    half = random_map(size, 128, 1, np.uint8)
    verdict, weak, smooth = (random_map(size, limit, limit) for limit in (3, 2, 2))
    labels, weights = np.full(shape, 9, dtype), np.full(shape, 9, np.uint8)
    lean_on_half(half, verdict, weak, smooth, labels, weights)
    np.testing.assert_array_equal(labels, twins.doubled(2 * half, shape))
    leant = (weak == 1) & (smooth == 1) & (verdict != REFUSED)
    np.testing.assert_array_equal(weights, twins.doubled(leant, shape))


# ---- the half-size chromosome as a whole ----


def half_map_of_twins(left, right, disparities, places, first_inside):
    """Return labels, verdict and chosen labels of the half-size search, put together of twins."""
    halves = []
    for image in (left, right):
        fine = reference_census.fine_grey(image, 0, places)
        halves.append((reference_census.halved(fine, rounded=False), reference_census.halved(
            reference_census.eight_bits(fine), rounded=True)))
    features = [(reference_census.census(fine), reference_census.gradient(grey))
                for fine, grey in halves]
    half_disparities = -(-disparities // 2)
    costs = reference_census.box_costs(reference_census.match_costs(
        *features, half_disparities, (HALF_SIZE.census_cut, HALF_SIZE.slope_cut)), HALF_SIZE.box)
    across, down = reference_census.jump_penalties(
        halves[0][1], reference_census.jump_table(HALF_SIZE))
    rows = len(costs)
    sums = reference_census.summed_passes(costs, np.zeros(costs.shape, bool), across, down,
                                          HALF_SIZE.small, [(0, rows)], 0)
    everything = np.array([[0]]), np.array([[half_disparities]]), max(costs.shape)
    labels = reference_census.chosen(sums, *everything)[0].astype(np.uint8)
    target = reference_census.chosen_by_target(sums, *everything) % 256
    verdict = reference_refinement.verdicts(labels, target, first_inside // 2)
    verdict = reference_refinement.without_speckles(labels, verdict, 1, SPECKLE)
    filled = reference_refinement.filled_by_rows(labels, verdict)
    return reference_refinement.median_of_25(filled), verdict


@pytest.mark.parametrize('shape', [(2, 2), (3, 9), (41, 61), (50, 40)])
@pytest.mark.parametrize('disparities, first_inside', [(1, 0), (17, 5), (70, 0)])
def test_the_half_size_chromosome_is_put_together_as_by_the_twins(
        shape, disparities, first_inside):
    left, right = small_pair(*shape, channels=3)
    places = fine_places(left, right)
    coarse, half = CoarseGuess(*shape, disparities), (shape[0] // 2, shape[1] // 2)
    for view, image in ((coarse.possibility.left, left), (coarse.possibility.right, right)):
        full = type(view)(*shape, view.mirrored, 96)
        full.read(image, 0, places, 0, shape[0])
        full.halve(view, 0, half[0])
    coarse.possibility.describe(0, half[0])
    coarse.search(Crew(1), first_inside)
    labels, verdict = half_map_of_twins(left, right, disparities, places, first_inside)
    np.testing.assert_array_equal(coarse.verdict, verdict)
    np.testing.assert_array_equal(coarse.labels, labels)
