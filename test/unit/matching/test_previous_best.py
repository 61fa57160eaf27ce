# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the previous frame's best chromosome is trusted."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import CONSISTENT, INVALID, OUTSIDE
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.temporal.previous_best import (
    previous_prior, tile_strengths, trusted_cells)
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_averaging as twins
from reference_search import doubled

SHAPES = [(2, 2), (3, 3), (17, 33), (33, 50), (64, 48)]


def trusted_of(labels, validity, half, distance=2):
    half_labels, trusted = np.full(half.shape, 99, labels.dtype), np.full(half.shape, 9, np.uint8)
    for first, last in ((0, 1), (1, half.shape[0])):
        trusted_cells(labels, validity, half, distance, half_labels, trusted, first, last)
    np.testing.assert_array_equal(
        half_labels, labels[:2 * half.shape[0]:2, :2 * half.shape[1]:2])
    return trusted


@settings(max_examples=80, deadline=None)
@given(st.integers(2, 40), st.integers(2, 40), st.integers(1, 9), st.integers(0, 3),
       st.booleans(), st.integers(0, 999))
def test_trusted_is_what_was_consistent_and_agrees_with_the_half_map(
        rows, columns, spread, distance, wide, seed):
    offset, dtype = (300, np.uint16) if wide else (0, np.uint8)
    half_shape = rows // 2, columns // 2
    labels = random_map((rows, columns), spread, seed, dtype) + dtype(offset)
    validity = random_map((rows, columns), 3, seed + 4)
    half = random_map(half_shape, -(-spread // 2), seed + 1, dtype) + dtype(offset // 2)
    expected = np.zeros(half_shape)
    for at in np.ndindex(half_shape):
        there = 2 * at[0], 2 * at[1]
        expected[at] = (validity[there] == CONSISTENT
                        and abs(int(labels[there]) - 2 * int(half[at])) <= distance)
    np.testing.assert_array_equal(trusted_of(labels, validity, half, distance), expected)


@pytest.mark.parametrize('label, validity, trusted', [
    (20, CONSISTENT, 1), (22, CONSISTENT, 1), (18, CONSISTENT, 1), (23, CONSISTENT, 0),
    (17, CONSISTENT, 0), (20, INVALID, 0), (20, OUTSIDE, 0)])
def test_what_was_refused_or_is_denied_is_not_trusted(label, validity, trusted):
    assert trusted_of(np.full((2, 2), label, np.uint8), np.full((2, 2), validity, np.uint8),
                      np.full((1, 1), 10, np.uint8)) == trusted


@pytest.mark.parametrize('shape', SHAPES)
def test_leant_on_is_what_is_trusted_and_flat_as_strongly_as_its_tile_says(shape):
    half, tiles = (shape[0] // 2, shape[1] // 2), (-(-shape[0] // TILE), -(-shape[1] // TILE))
    trusted, smooth = (random_map(half, 2, seed) for seed in (1, 2))
    strengths = random_map(tiles, 4, 3)
    weights = np.full(shape, 9, np.uint8)
    for first, last in ((0, 1), (1, tiles[0])):
        previous_prior(trusted, smooth, strengths, weights, first, last)
    width = 2 * half[1]
    strength = strengths.repeat(TILE, 0).repeat(TILE, 1)[:shape[0], :width]
    expected = doubled(trusted & smooth, shape)[:, :width] * strength
    np.testing.assert_array_equal(weights, np.pad(
        expected, ((0, 0), (0, shape[1] - width)), 'edge'))


@pytest.mark.parametrize('shape', [(1, 1), (1, 4), (4, 1), (9, 12)])
@pytest.mark.parametrize('most', [1, 3])
def test_the_previous_best_counts_more_with_age_and_not_beside_what_changed(shape, most):
    choices = np.minimum(random_map(shape, 12, 1), 2).astype(np.int8) - np.int8(1)
    ages = random_map(shape, 60, 2).astype(np.float32) / 6
    found = np.full(shape, 9, np.uint8)
    tile_strengths(choices, ages, most, found)
    np.testing.assert_array_equal(found, twins.strengths(choices, ages, most))
