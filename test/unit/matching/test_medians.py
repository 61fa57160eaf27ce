# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The membership median and the median of 5 x 5 that follows it."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import cut_bands, ThreadPool
from fuzzy_stereo_ros.matching.kernels.refinement import filling
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.refinement import ALIKE, Refinement
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_refinement as twins

SHAPES = [(1, 1), (1, 9), (9, 1), (2, 2), (8, 31), (7, 32), (6, 33), (3, 65)]
KINDS = [(np.uint8, 1), (np.uint8, 2), (np.uint8, 256), (np.uint16, 257), (np.uint16, 4096)]


def median_of(labels, grey, reach, disparities, bands=None):
    rows, columns = labels.shape
    radius = filling.RADIUS
    padded, padded_grey = (np.full((rows + 2 * radius, columns + 2 * radius + 2 * LANES), 99,
                                   labels.dtype) for _ in range(2))
    out = np.zeros((rows, columns + 2 * LANES), labels.dtype)
    members = np.zeros(filling.NEIGHBOURS * LANES, labels.dtype)
    bits = max((disparities - 1).bit_length(), 1)
    bands = bands or [(0, rows)]
    for band in bands:
        filling.pad_map(labels, columns, padded, *band)
        filling.pad_map(grey, columns, padded_grey, *band)
    for band in bands:
        filling.membership_median(padded, padded_grey, reach, bits, columns, out, members, *band)
    return out[:, :columns]


@pytest.mark.parametrize('dtype, disparities', KINDS)
@pytest.mark.parametrize('shape', SHAPES)
def test_the_membership_median_is_that_of_the_twin(shape, dtype, disparities):
    labels = random_map(shape, disparities, 1, dtype)
    grey = random_map(shape, 40, 2)
    np.testing.assert_array_equal(median_of(labels, grey, 10, disparities),
                                  twins.membership_median(labels, grey, 10))


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 9), st.integers(1, 40), st.integers(0, 255), st.integers(1, 256),
       st.integers(1, 256), st.integers(0, 99))
def test_any_reach_and_spread_of_labels_and_grey(rows, columns, reach, spread, greys, seed):
    labels = random_map((rows, columns), spread, seed)
    grey = random_map((rows, columns), greys, seed + 1)
    np.testing.assert_array_equal(median_of(labels, grey, reach, 256),
                                  twins.membership_median(labels, grey, reach))


def test_a_map_without_jumps_stays_as_it_is():
    labels = random_map((20, 40), 2, 3) + np.uint8(7)
    grey = random_map((20, 40), 256, 4)
    np.testing.assert_array_equal(median_of(labels, grey, 10, 64), labels)


def test_a_wrong_border_of_disparity_moves_to_the_grey_edge():
    grey = np.where(np.arange(40) < 20, 50, 150).astype(np.uint8) * np.ones((20, 1), np.uint8)
    truth = np.where(grey > 100, 30, 5).astype(np.uint8)
    wrong = np.roll(truth, 2, axis=1)
    wrong[:, :2] = 5
    np.testing.assert_array_equal(median_of(wrong, grey, 10, 64)[:, 5:35], truth[:, 5:35])


@pytest.mark.parametrize('edges', [(0, 1, 11), (0, 5, 11), (0, 10, 11), (0, 3, 7, 11)])
def test_bands_give_what_the_whole_gives(edges):
    labels, grey = random_map((11, 37), 64, 5), random_map((11, 37), 60, 6)
    np.testing.assert_array_equal(
        median_of(labels, grey, 10, 64, list(zip(edges, edges[1:]))),
        median_of(labels, grey, 10, 64))


@pytest.mark.parametrize('dtype, disparities', [(np.uint8, 60), (np.uint16, 300)])
@pytest.mark.parametrize('shape', [(2, 2), (3, 9), (5, 5), (17, 40)])
def test_smoothing_is_both_medians_one_after_the_other(shape, dtype, disparities):
    labels, grey = random_map(shape, disparities, 7, dtype), random_map(shape, 50, 8)
    refinement = Refinement(shape[1], disparities, dtype, cut_bands(shape[0]))
    np.testing.assert_array_equal(
        refinement.smooth(ThreadPool(1), labels, labels, grey),
        twins.median_of_25(twins.membership_median(labels, grey, ALIKE)))
