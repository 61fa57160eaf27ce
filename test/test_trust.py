# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the previous frame's best chromosome is trusted, and how its genes grow old."""
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.kernels.consistency import CONSISTENT, OUTSIDE, REFUSED
from fuzzy_stereo_ros.matching.kernels.trust import (
    keep_unmoved_tiles, lean_on_previous, move_map, move_tile_costs, TILE, tile_costs,
    trusted_cells)
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_search as twins

SHAPES = [(2, 2), (1, 9), (9, 1), (17, 33), (33, 50)]


def costs_of(possibility, labels, first_inside, bands=None):
    rows, columns = labels.shape
    tiles = -(-rows // TILE), -(-columns // TILE)
    costs = np.full(tiles, 99, np.float32)
    for first, last in bands or [(0, tiles[0])]:
        tile_costs(possibility.features, labels, first_inside, costs, first, last)
    return costs


@pytest.mark.parametrize('disparities', [1, 33, 256, 300])
@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('first_inside', [0, 4])
def test_tile_costs_are_those_of_the_twin(shape, disparities, first_inside):
    left, right = small_pair(*shape)
    labels = random_map(shape, min(disparities, 20), 1,
                        np.uint8 if disparities <= 256 else np.uint16)
    volume = twin_costs(left, right, disparities)
    np.testing.assert_array_equal(
        costs_of(seen(left, right, disparities), labels, first_inside),
        twins.tile_costs(volume, labels, first_inside))


def test_tile_costs_of_bands_are_those_of_the_whole():
    left, right = small_pair(70, 20)
    labels = random_map((70, 20), 9, 1)
    possibility = seen(left, right, 33)
    np.testing.assert_array_equal(costs_of(possibility, labels, 0, [(0, 2), (2, 5)]),
                                  costs_of(possibility, labels, 0))


def test_a_tile_where_nothing_can_be_seen_costs_nothing():
    left, right = small_pair(16, 16)
    assert costs_of(seen(left, right, 33), np.full((16, 16), 30, np.uint8), 0) == 0


def trusted_of(labels, verdict, half, half_verdict, now, then, tolerance=0.5, distance=2):
    half_labels, trusted = np.full(half.shape, 99, labels.dtype), np.full(half.shape, 9, np.uint8)
    trusted_cells(labels, verdict, half, half_verdict, now, then, tolerance, distance,
                  half_labels, trusted)
    np.testing.assert_array_equal(
        half_labels, labels[:2 * half.shape[0]:2, :2 * half.shape[1]:2])
    return trusted


@settings(max_examples=80, deadline=None)
@given(st.integers(2, 40), st.integers(2, 40), st.integers(1, 9), st.integers(0, 3),
       st.sampled_from([0.0, 0.5, 2.0]), st.booleans(), st.integers(0, 999))
def test_trust_is_that_of_the_twin(rows, columns, spread, distance, tolerance, wide, seed):
    offset, dtype = (300, np.uint16) if wide else (0, np.uint8)
    half_shape, tiles = (rows // 2, columns // 2), (-(-rows // TILE), -(-columns // TILE))
    labels = random_map((rows, columns), spread, seed, dtype) + dtype(offset)
    half = random_map(half_shape, -(-spread // 2), seed + 1, dtype) + dtype(offset // 2)
    now, then = (random_map(tiles, 8, seed + k).astype(np.float32) / 4 for k in (2, 3))
    maps = (labels, random_map((rows, columns), 3, seed + 4), half,
            random_map(half_shape, 3, seed + 5), now, then)
    np.testing.assert_array_equal(trusted_of(*maps, tolerance, distance),
                                  twins.trusted(*maps, tolerance, distance))


@pytest.mark.parametrize('label, verdict, half_verdict, dearer, trusted', [
    (20, CONSISTENT, CONSISTENT, 0.0, 1), (20, CONSISTENT, CONSISTENT, 0.5, 1),
    (20, CONSISTENT, CONSISTENT, 0.51, 0), (22, CONSISTENT, CONSISTENT, 0.0, 1),
    (23, CONSISTENT, CONSISTENT, 0.0, 0), (17, CONSISTENT, CONSISTENT, 0.0, 0),
    (23, CONSISTENT, REFUSED, 0.0, 1), (23, CONSISTENT, OUTSIDE, 0.0, 1),
    (20, REFUSED, CONSISTENT, 0.0, 0), (20, OUTSIDE, CONSISTENT, 0.0, 0)])
def test_trusted_is_what_was_consistent_is_no_dearer_and_is_not_denied(
        label, verdict, half_verdict, dearer, trusted):
    then = np.full((1, 1), 3, np.float32)
    found = trusted_of(np.full((2, 2), label, np.uint8), np.full((2, 2), verdict, np.uint8),
                       np.full((1, 1), 10, np.uint8), np.full((1, 1), half_verdict, np.uint8),
                       then + np.float32(dearer), then)
    assert found == trusted


@pytest.mark.parametrize('shape', [(2, 2), (3, 3), (11, 16)])
def test_leant_on_is_what_is_trusted_and_flat(shape):
    half = shape[0] // 2, shape[1] // 2
    trusted, smooth = (random_map(half, 2, seed) for seed in (1, 2))
    weights = np.full(shape, 9, np.uint8)
    for band in ((0, 1), (1, shape[0])):
        lean_on_previous(trusted, smooth, weights, *band)
    np.testing.assert_array_equal(weights, twins.doubled(trusted & smooth, shape))


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.integers(-10, 10), st.integers(-10, 10),
       st.integers(0, 99))
def test_a_moved_map_shows_what_was_up_and_left_of_it(rows, columns, down, right, seed):
    source = random_map((rows, columns), 200, seed)
    moved = np.full_like(source, 7)
    for band in ((0, rows // 2), (rows // 2, rows)):
        move_map(source, down, right, 255, moved, *band)
    for row, column in np.ndindex(source.shape):
        inside = 0 <= row - down < rows and 0 <= column - right < columns
        assert moved[row, column] == (source[row - down, column - right] if inside else 255)


@pytest.mark.parametrize('shape', [(1, 1), (1, 5), (4, 1), (5, 6)])
@pytest.mark.parametrize('down, right', [(0, 0), (TILE, -2 * TILE), (8, 4), (-3, 900)])
def test_moved_tile_costs_lie_on_lines_between_the_tiles_centres(shape, down, right):
    costs = random_map(shape, 50, 3).astype(np.float32)
    moved = np.zeros_like(costs)
    move_tile_costs(costs, down, right, moved)
    rows, columns = (np.clip(np.arange(size) - shift / TILE, 0, size - 1)
                     for size, shift in zip(shape, (down, right)))
    along = np.array([np.interp(columns, np.arange(shape[1]), line) for line in costs])
    both = np.array([np.interp(rows, np.arange(shape[0]), line) for line in along.T]).T
    np.testing.assert_allclose(moved, both, rtol=1e-5)


def test_the_tiles_that_are_cheaper_unmoved_are_put_back():
    maps = random_map((20, 40), 9, 1), random_map((20, 40), 3, 2)
    moved = tuple(part + np.uint8(100) for part in maps)
    before = [part.copy() for part in moved]
    costs = np.array([[1, 5, 3], [2, 2, 2]], np.float32)
    moved_costs = np.array([[1, 4, 9], [3, 1, 0]], np.float32)
    keep_unmoved_tiles(costs, moved_costs, maps, moved)
    np.testing.assert_array_equal(moved_costs, [[1, 4, 3], [2, 1, 0]])
    back = np.array([[1, 0, 1], [1, 0, 0]]).repeat(TILE, 0).repeat(TILE, 1)[:20, :40] == 1
    for part, there, source in zip(moved, before, maps):
        np.testing.assert_array_equal(part, np.where(back, source, there))
