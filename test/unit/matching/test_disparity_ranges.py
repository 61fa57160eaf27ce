# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the half-size map tells the full search: windows of labels, weak texture, a prior."""
from census_scene import random_map, read_moved, small_pair
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.scanlines.disparity_ranges import (
    flat, half_prior, texture_steps, tile_windows, weak_texture)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift
from fuzzy_stereo_ros.matching.realtime.half_size import HalfSize, SPECKLE, TILE
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, CensusPossibility, extra_columns, HALF_SIZE)
from fuzzy_stereo_ros.matching.realtime.scanlines import (
    gene_type, OVERLAP)
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census
import reference_refinement
import reference_search as twins

sizes = st.integers(2, 40)
SHAPES = [(2, 2), (3, 3), (2, 9), (9, 2), (13, 21), (16, 40)]


def windows_of(half, shape, disparities, tile, grow, margin, half_disparities=None):
    half_disparities = half_disparities or -(-disparities // 2)
    tiles = -(-shape[0] // tile), -(-shape[1] // tile)
    low, blocks = np.full(tiles, -1), np.full(tiles, -1)
    for part in ((0, 1), (1, len(low))):
        tile_windows(half, half_disparities, disparities, tile, grow, margin, low, blocks, *part)
    return low, blocks


@settings(max_examples=150, deadline=None)
@given(sizes, sizes, st.sampled_from([1, 2, 31, 33, 64, 70, 96, 97, 100, 256, 257, 500]),
       st.sampled_from([4, 8, 16, 64]), st.sampled_from([0, 2, 8]), st.integers(0, 6),
       st.integers(1, 500), st.integers(0, 999))
def test_a_tile_searches_the_labels_around_it_and_no_block_too_many(
        rows, columns, disparities, tile, grow, margin, spread, seed):
    dtype, spread = gene_type(disparities), min(spread, disparities)
    half = random_map((rows // 2, columns // 2), -(-spread // 2), seed, dtype)
    low, blocks = windows_of(half, (rows, columns), disparities, tile, grow, margin)
    for at in np.ndindex(low.shape):
        wanted = twins.labels_around_tile(half, tile, at, grow)
        wanted = wanted or [0, disparities - 1]
        least = max(min(wanted) - margin, 0)
        largest = min(max(wanted) + margin, disparities - 1)
        first, number = low[at], blocks[at]
        assert 0 <= first <= least
        assert largest < first + LANES * number
        fewest, most = -(-(largest - least + 1) // LANES), -(-disparities // LANES)
        assert number == (4 if fewest == 3 else fewest)     # three take longer than four
        assert first + LANES * number <= max(disparities, LANES * number)
        assert number <= (4 if most == 3 else most)


def test_a_window_stands_in_the_middle_of_what_it_must_hold():
    half = np.full((8, 8), 50, np.uint8)
    low, blocks = windows_of(half, (16, 16), 256, 16, 0, 4)
    assert blocks.tolist() == [[1]]
    assert low.tolist() == [[96 - (32 - 10) // 2]]       # 96 .. 105 are wanted


@pytest.mark.parametrize('nearest, last', [(28, 64), (29, 64), (30, 72), (31, 72)])
def test_a_tile_whose_half_map_reaches_its_end_is_searched_to_the_last_label(nearest, last):
    half = np.array([[0, nearest]] * 2, np.uint8)
    low, blocks = windows_of(half, (4, 4), 72, 4, 0, 4, half_disparities=32)
    assert low.tolist() == [[0]]
    assert min(72, 32 * blocks[0, 0]) == last


@settings(max_examples=60, deadline=None)
@given(sizes, sizes, st.integers(1, 256), st.integers(0, 700), st.integers(0, 999))
def test_weak_texture_is_that_of_the_twin(rows, columns, greys, limit, seed):
    grey = random_map((rows, columns), greys, seed)
    padded = np.pad(grey, ((0, 0), (0, 64)))
    half = rows // 2, columns // 2
    steps, weak = np.zeros(half, np.uint16), np.full(half, 9, np.uint8)
    for first, last in ((0, 1), (1, half[0])):
        texture_steps(padded, steps, first, last)
    for first, last in ((0, 1), (1, half[0])):
        weak_texture(steps, limit, weak, first, last)
    np.testing.assert_array_equal(weak, twins.weak_texture(grey, limit))


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', [(1, 1), (1, 9), (9, 1), (2, 2), (8, 11)])
@pytest.mark.parametrize('most', [0, 1, 3])
def test_flat_is_that_of_the_twin(shape, dtype, most):
    labels = random_map(shape, 3 + most, 1, dtype)
    labels[:, shape[1] // 2:] = 7
    smooth = np.full(shape, 9, np.uint8)
    for first, last in ((0, 1), (1, shape[0])):
        flat(labels, most, smooth, first, last)
    np.testing.assert_array_equal(smooth, twins.flat(labels, most))


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', SHAPES)
def test_the_half_map_is_a_prior_where_texture_is_weak_and_it_is_flat_and_not_rejected(
        shape, dtype):
    size = shape[0] // 2, shape[1] // 2
    half = 1 + random_map(size, 120, 1, np.uint8)
    validity, weak, smooth = (random_map(size, limit, limit) for limit in (3, 2, 2))
    chosen = np.where(random_map(size, 2, 4) == 1, half, 100)
    offsets = random_map(size, 16, 5, np.int8) - np.int8(8)
    labels, weights = np.full(shape, 9, dtype), np.full(shape, 9, np.uint8)
    margins = random_map(size, 9, 6)
    for first, last in ((0, 1), (1, size[0])):
        half_prior(half, (chosen, offsets, margins, validity), weak, smooth, 4, (labels, weights),
                   first, last)
    luminance = 2 * half + np.where(chosen == half, np.rint(offsets / 8), 0)
    np.testing.assert_array_equal(labels, twins.doubled(luminance, shape))
    reliance = (weak == 1) & (smooth == 1) & (validity != INVALID) & (margins >= 4)
    np.testing.assert_array_equal(weights, twins.doubled(reliance, shape))


# ---- the half-size chromosome as a whole ----


def half_map_of_twins(left, right, disparities, places, min_disparity):
    """Return labels, validity and chosen labels of the half-size search, put together of twins."""
    halves, extra = [], extra_columns(min_disparity, disparities)
    for image, moved in ((left, (0, places)), (right, (min_disparity, places, extra))):
        luminance = reference_census.luminance(image, *moved)
        halves.append((reference_census.halved(luminance, rounded=False), reference_census.halved(
            reference_census.eight_bits(luminance), rounded=True)))
    features = [(reference_census.census(luminance), reference_census.gradient(grey))
                for luminance, grey in halves]
    half_disparities = -(-disparities // 2)
    costs = reference_census.box_costs(reference_census.match_costs(
        *features, half_disparities, HALF_SIZE), HALF_SIZE.box)
    across, down = reference_census.jump_penalties(
        halves[0][1], reference_census.jump_table(HALF_SIZE))
    sums = reference_census.summed_passes(costs, np.zeros(costs.shape, bool), across, down,
                                          HALF_SIZE.small, TILE, OVERLAP)
    everything = np.array([[0]]), np.array([[half_disparities]]), max(costs.shape)
    chosen = reference_census.chosen(sums, *everything)
    labels = chosen[0].astype(np.uint8)
    target = reference_census.chosen_by_target(labels, chosen[2], extra // 2)
    inside = min_disparity // 2, (min_disparity + left.shape[1] - 1) // 2
    validity = reference_refinement.validities(labels, target, inside)
    validity = reference_refinement.without_speckles(labels, validity, 1, SPECKLE)
    filled = reference_refinement.filled_by_rows(labels, validity)
    return reference_refinement.median_of_25(filled), validity


@pytest.mark.parametrize('shape', [(2, 2), (3, 9), (41, 61), (50, 40), (220, 12)])
@pytest.mark.parametrize('disparities, min_disparity', [
    (1, 0), (17, 5), (70, 0), (17, -6), (18, -3), (9, -20), (8, -20), (16, -200), (1, -1)])
def test_the_half_size_chromosome_is_put_together_as_by_the_twins(
        shape, disparities, min_disparity):
    left, right = small_pair(*shape, channels=3)
    places = luminance_shift(left, right)
    extra = extra_columns(min_disparity, disparities)
    half_rows = shape[0] // 2
    possibility = CensusPossibility(
        half_rows, shape[1] // 2, -(-disparities // 2), HALF_SIZE,
        (min_disparity // 2, (min_disparity + shape[1] - 1) // 2), extra // 2)
    full = CensusPicture(*shape, False, 96), CensusPicture(shape[0], shape[1] + extra, True, 96)
    full[0].read(left, 0, places, 0, shape[0])
    read_moved(full[1], right, min_disparity, places)
    for view, half in zip(full, (possibility.left, possibility.right)):
        view.halve(half, 0, half_rows)
    possibility.describe(CensusPicture.describe, 0, half_rows)
    half_size, pool = HalfSize(possibility, *shape, disparities), ThreadPool(1)
    half = half_size.search(pool, full[0].grey, 0.0)
    labels, validity = half_map_of_twins(left, right, disparities, places, min_disparity)
    np.testing.assert_array_equal(half.validity, validity)
    np.testing.assert_array_equal(half.labels, labels)


def test_noise_is_not_taken_for_texture():
    shape, disparities = (60, 120), 16
    possibility = CensusPossibility(shape[0] // 2, shape[1] // 2, disparities // 2, HALF_SIZE)
    half_size, pool = HalfSize(possibility, *shape, disparities), ThreadPool(1)
    random = np.random.default_rng(1)
    grey = np.zeros((shape[0], shape[1] + LANES), np.uint8)
    for noise in (1, 5, 9):
        grey[:] = np.rint(128 + noise * random.standard_normal(grey.shape))
        half_size.search(pool, grey, float(noise))
        assert half_size.weak.mean() > 0.95
    grey[:, 2::4] = grey[:, 3::4] = 200
    half_size.search(pool, grey, 9.0)
    assert half_size.weak.mean() < 0.05
