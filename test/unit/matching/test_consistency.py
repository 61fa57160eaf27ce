# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Left-right consistency and speckles."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    check_consistency, CONSISTENT, INVALID, OUTSIDE)
from fuzzy_stereo_ros.matching.realtime.possibility import extra_columns
from fuzzy_stereo_ros.matching.speckles import reject_speckles
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
import reference_refinement as twins

KINDS = [(np.uint8, 256), (np.uint16, 600)]
validity_of_pixels = st.sampled_from([CONSISTENT, OUTSIDE, INVALID])


def checked(labels, target, disparities, inside):
    validity = np.full(labels.shape, 9, np.uint8)
    check_consistency(labels, target, disparities, inside, validity, 0, len(labels))
    return validity


def inside_of(min_disparity, columns):
    return min_disparity, min_disparity + columns - 1


def despeckled(labels, validity, step, smallest):
    validity = validity.copy()
    reject_speckles(ThreadPool(1), labels, validity, step, smallest)
    return validity


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(KINDS), st.integers(1, 5), st.integers(1, 40),
       st.integers(-50, 5) | st.sampled_from([-200, -2048, 2048]), st.integers(1, 30))
def test_validities_are_those_of_the_twin(kind, rows, columns, min_disparity, spread):
    dtype, limit = kind
    extra, inside = extra_columns(min_disparity, spread), inside_of(min_disparity, columns)
    labels = random_map((rows, columns), min(spread, limit), 1, dtype)
    target = random_map((rows, extra + columns), min(spread, 256), 2)
    np.testing.assert_array_equal(checked(labels, target, limit, inside),
                                  twins.validities(labels, target, inside))


@pytest.mark.parametrize('label', [0, 1, 255, 256, 257, 400, 511])
@pytest.mark.parametrize('away, validity', [
    (-2, INVALID), (-1, CONSISTENT), (0, CONSISTENT), (1, CONSISTENT), (2, INVALID)])
def test_labels_agree_within_one_pixel_modulo_256(label, away, validity):
    labels = np.full((1, 600), label, np.uint16)
    target = np.full((1, 600), (label + away) % 256, np.uint8)
    assert checked(labels, target, 600, (0, 599))[0, 599] == validity


def test_what_points_beyond_the_target_cannot_be_checked():
    labels = np.full((1, 9), 3, np.uint8)
    target = np.full((1, 9), 3, np.uint8)
    assert checked(labels, target, 8, (0, 8))[0].tolist() == [OUTSIDE] * 3 + [CONSISTENT] * 6
    assert checked(labels, target, 8, (2, 10))[0].tolist() == [OUTSIDE] * 5 + [CONSISTENT] * 4
    wider = np.full((1, 13), 3, np.uint8)
    assert checked(labels, wider, 8, (-4, 4))[0].tolist() == [CONSISTENT] * 8 + [OUTSIDE]
    assert checked(labels, wider, 8, (-2, 6))[0].tolist() == [OUTSIDE] + [CONSISTENT] * 8
    assert checked(labels, wider, 8, (-50, -42))[0].tolist() == [OUTSIDE] * 9


def test_only_the_rows_asked_for_are_checked():
    labels = np.zeros((5, 3), np.uint8)
    validity = np.full((5, 3), 9, np.uint8)
    check_consistency(labels, labels, 4, (0, 2), validity, 1, 3)
    assert validity[:, 0].tolist() == [9, CONSISTENT, CONSISTENT, 9, 9]


@st.composite
def labels_and_validity(draw, dtype=np.uint8):
    shape = draw(st.integers(1, 12)), draw(st.integers(1, 12))
    values = draw(st.sampled_from([2, 4, 256]))
    labels = draw(arrays.arrays(dtype, shape, elements=st.integers(0, values - 1)))
    return labels, draw(arrays.arrays(np.uint8, shape, elements=validity_of_pixels))


@settings(max_examples=150, deadline=None)
@given(labels_and_validity(), st.integers(0, 2), st.integers(2, 30))
def test_speckles_are_those_of_flood_fill(maps, step, smallest):
    np.testing.assert_array_equal(despeckled(*maps, step, smallest),
                                  twins.without_speckles(*maps, step, smallest))


@settings(max_examples=100, deadline=None)
@given(labels_and_validity(), st.integers(0, 2), st.integers(2, 30))
def test_what_is_left_after_the_speckles_has_none(maps, step, smallest):
    labels, validity = maps
    once = despeckled(labels, validity, step, smallest)
    np.testing.assert_array_equal(once, despeckled(labels, once, step, smallest))


@pytest.mark.parametrize('shape', [(25, 40), (1, 300), (300, 1), (300, 40), (700, 9)])
def test_speckles_of_16_bit_labels_are_those_of_flood_fill(shape):
    labels = random_map(shape, 3, 4, np.uint16) + np.uint16(300)
    validity = random_map(shape, 3, 5)
    np.testing.assert_array_equal(despeckled(labels, validity, 1, 15),
                                  twins.without_speckles(labels, validity, 1, 15))


def test_a_spiral_is_one_component():
    """Its arms are joined only at its end, so that labels given on the way must be merged."""
    spiral = np.array([[1, 1, 1, 1, 1, 1, 1],
                       [0, 0, 0, 0, 0, 0, 1],
                       [1, 1, 1, 1, 1, 0, 1],
                       [1, 0, 0, 0, 1, 0, 1],
                       [1, 0, 1, 1, 1, 0, 1],
                       [1, 0, 0, 0, 0, 0, 1],
                       [1, 1, 1, 1, 1, 1, 1]], np.uint8)
    labels = (50 * spiral).astype(np.uint8)
    validity = np.zeros(labels.shape, np.uint8)
    size = int(spiral.sum())
    kept, gone = despeckled(labels, validity, 1, size), despeckled(labels, validity, 1, size + 1)
    assert np.all(kept[spiral == 1] == CONSISTENT)
    assert np.all(gone == INVALID)
