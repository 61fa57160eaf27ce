# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Filling of rejected pixels from the background, and the previous best's genes."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import INVALID
from fuzzy_stereo_ros.matching.kernels.refinement.filling import fill_columns, fill_rows
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_refinement as twins

kinds = st.sampled_from([(np.uint8, 256), (np.uint16, 600)])
sizes = st.integers(1, 12)


@st.composite
def maps(draw):
    """Return labels and a validity, from nothing rejected to everything."""
    (dtype, limit), shape = draw(kinds), (draw(sizes), draw(sizes))
    seed, share = draw(st.integers(0, 10000)), draw(st.sampled_from([0, 0.1, 0.5, 0.9, 1]))
    labels = random_map(shape, limit, seed, dtype)
    chance = np.random.default_rng(seed)
    validity = random_map(shape, INVALID, seed)
    validity[chance.random(shape) < share] = INVALID
    return labels, validity


def by_rows(labels, validity):
    filled = np.full_like(labels, 77)
    fill_rows(labels, validity, filled, 0, len(labels))
    return filled


def by_columns(labels, validity, rows):
    filled = np.full_like(labels, 77)
    fill_columns(labels, validity, rows, filled, np.zeros_like(labels[0]), 0, 1)
    fill_columns(labels, validity, rows, filled, np.zeros_like(labels[0]), 1, labels.shape[1])
    return filled


@settings(max_examples=150, deadline=None)
@given(maps())
def test_rows_are_filled_as_by_the_twin(given_maps):
    np.testing.assert_array_equal(by_rows(*given_maps), twins.filled_by_rows(*given_maps))


@settings(max_examples=150, deadline=None)
@given(maps())
def test_columns_are_filled_as_by_the_twin(given_maps):
    rows = by_rows(*given_maps)
    np.testing.assert_array_equal(
        by_columns(*given_maps, rows), twins.filled_by_columns(*given_maps, rows))


@settings(max_examples=50, deadline=None)
@given(maps())
def test_what_is_not_refused_keeps_its_label(given_maps):
    labels, validity = given_maps
    rows = by_rows(labels, validity)
    for filled in (rows, by_columns(labels, validity, rows)):
        np.testing.assert_array_equal(filled[validity != INVALID], labels[validity != INVALID])


@pytest.mark.parametrize('left, right, expected', [
    (20, 50, [20, 20, 20, 20]), (50, 20, [50, 50, 20, 20]), (49, 50, [49, 49, 49, 49]),
    (50, 50, [50, 50, 50, 50])])
def test_a_strip_hidden_by_its_right_end_is_background_else_the_nearer_end_counts(
        left, right, expected):
    labels = np.array([[9, left, 9, 9, 9, 9, right, 9]], np.uint8)
    validity = np.where(labels == 9, INVALID, 0).astype(np.uint8)
    assert by_rows(labels, validity).tolist() == [[left, left, *expected, right, right]]


def test_a_run_much_wider_than_the_jump_is_no_hidden_strip():
    labels = np.array([[20, *[9] * 6, 21]], np.uint8)
    validity = np.where(labels == 9, INVALID, 0).astype(np.uint8)
    assert by_rows(labels, validity).tolist() == [[20, 20, 20, 20, 21, 21, 21, 21]]


@pytest.mark.parametrize('first', [0, 2])
def test_a_row_without_labels_takes_the_one_above_in_its_band(first):
    labels = np.arange(12, dtype=np.uint8).reshape(4, 3)
    validity = np.full((4, 3), INVALID, np.uint8)
    validity[first] = 0
    filled = np.full_like(labels, 77)
    fill_rows(labels, validity, filled, first, 4)
    for row in range(first, 4):
        assert filled[row].tolist() == labels[first].tolist()
    assert np.all(filled[:first] == 77)
    validity[:] = INVALID
    fill_rows(labels, validity, filled, first, 4)
    assert not filled[first:].any()
