# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the previous frame's best chromosome is trusted, and how its genes grow old."""
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.kernels.consistency import CONSISTENT, OUTSIDE, REFUSED
from fuzzy_stereo_ros.matching.kernels.trust import (
    grow_older, lean_on_previous, TILE, tile_costs, trusted_cells)
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
def test_leant_on_is_what_is_trusted_and_flat_and_more_where_of_age(shape):
    half = shape[0] // 2, shape[1] // 2
    trusted, smooth, age = (random_map(size, limit, limit) for size, limit in (
        (half, 2), (half, 2), (shape, 4)))
    weights = np.full(shape, 9, np.uint8)
    for band in ((0, 1), (1, shape[0])):
        lean_on_previous(trusted, smooth, age, 2, weights, *band)
    leant = twins.doubled(trusted & smooth, shape)
    np.testing.assert_array_equal(weights, np.where(leant == 1, 1 + (age >= 2), 0))


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_a_gene_grows_older_where_it_was_leant_on_and_stayed_within_one_pixel(dtype):
    labels = np.array([[7, 7, 7, 7, 7, 7, 0]], dtype)
    previous = np.array([[7, 8, 6, 9, 5, 7, 1]], dtype)
    weights = np.array([[1, 2, 1, 1, 1, 0, 1]], np.uint8)
    before = np.array([[0, 3, 255, 4, 4, 4, 254]], np.uint8)
    age = np.full((1, 7), 99, np.uint8)
    grow_older(labels, previous, weights, before, age)
    assert age.tolist() == [[1, 4, 255, 0, 0, 0, 255]]
