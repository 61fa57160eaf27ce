# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Eq. 1, Eq. 2, the possibility volume and the grey levels they are defined on."""
import cv2
from fuzzy_stereo_ros.matching.fuzzy import CENTRES, matching_possibility, membership
from fuzzy_stereo_ros.matching.kernels.grey_possibility import (
    fill_chosen_possibility, fill_grey_possibility)
from fuzzy_stereo_ros.matching.possibility import grey_levels, possibility_table
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference

intensities = st.floats(0, 255)
sigmas = st.floats(1, 1000)
SHAPES = [(7, 11), (1, 9), (9, 1)]
RANGES = [(4, 0), (5, -3), (6, 2), (30, 0), (3, 40), (3, -40),    # disparities, min_disparity
          (255, -130), (256, -2048), (257, 2048), (512, -260)]


def pair(shape, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (2, *shape)).astype(np.uint8)


@given(intensities, st.sampled_from(CENTRES), sigmas)
def test_membership_is_that_of_the_twin(intensity, centre, sigma):
    assert membership(intensity, centre, sigma) == pytest.approx(
        reference.membership(intensity, centre, sigma), rel=1e-12, abs=1e-300)


@given(st.sampled_from(CENTRES), sigmas)
def test_membership_is_one_at_the_centre_and_falls_away_from_it(centre, sigma):
    away = np.abs(np.arange(256) - centre)
    found = membership(np.arange(256), centre, sigma)[np.argsort(away)]
    assert membership(centre, centre, sigma) == 1
    assert np.all(np.diff(found) <= 0)


def test_membership_one_sigma_from_the_centre_is_exp_of_minus_a_half():
    assert membership(127.5 + 20, 127.5, 20.0) == pytest.approx(0.6065306597126334)


@given(intensities, intensities, sigmas)
def test_possibility_is_that_of_the_twin(first, second, sigma):
    assert matching_possibility(first, second, sigma) == pytest.approx(
        reference.matching_possibility(first, second, sigma), rel=1e-12, abs=1e-300)


@given(intensities, intensities, sigmas)
def test_possibility_is_symmetric_between_0_and_1_and_at_most_that_of_a_pixel_with_itself(
        first, second, sigma):
    possibility = matching_possibility(first, second, sigma)
    assert 0 <= possibility <= 1
    assert possibility == matching_possibility(second, first, sigma)
    assert possibility <= matching_possibility(first, first, sigma)


def test_two_pixels_of_the_same_pure_class_match_fully_and_of_two_classes_hardly():
    for centre in CENTRES:
        assert matching_possibility(centre, centre, 54.0) == 1
    assert matching_possibility(0, 255, 54.0) < 0.07
    assert matching_possibility(0, 127.5, 54.0) < 0.07


def test_at_the_default_sigma_neighbouring_classes_cross_at_one_half():
    between = (CENTRES[0] + CENTRES[1]) / 2
    assert membership(between, CENTRES[0], 54.0) == pytest.approx(0.5, abs=0.005)


def test_the_table_is_eq_2_to_half_a_255th():
    table = possibility_table(54.0)
    for first, second in ((0, 0), (0, 255), (64, 64), (64, 63), (10, 200), (127, 128)):
        exact = reference.matching_possibility(first, second, 54.0)
        assert abs(table[first, second] / 255 - exact) <= 0.5001 / 255


@pytest.mark.parametrize('disparities, min_disparity', RANGES)
@pytest.mark.parametrize('shape', SHAPES)
def test_the_volume_is_that_of_the_twin(shape, disparities, min_disparity):
    left, right = pair(shape)
    found = np.full((*shape, disparities), 99, np.uint8)
    fill_grey_possibility(possibility_table(54.0), left, right, min_disparity, found)
    exact = reference.possibility_volume(left, right, disparities, min_disparity, 54.0)
    np.testing.assert_array_equal(found, np.rint(255 * exact).astype(np.uint8))


def test_a_match_outside_the_target_image_is_not_possible():
    left = right = np.zeros((1, 3), np.uint8)
    found = np.full((1, 3, 3), 99, np.uint8)
    fill_grey_possibility(possibility_table(54.0), left, right, -1, found)
    np.testing.assert_array_equal(found[0], [[255, 255, 0], [255, 255, 255], [0, 255, 255]])


@pytest.mark.parametrize('shape', SHAPES)
def test_what_a_chromosome_chose_is_read_from_the_volume(shape):
    generator = np.random.default_rng(1)
    volume = generator.integers(0, 256, (*shape, 6)).astype(np.uint8)
    chromosome = generator.integers(0, 6, shape).astype(np.uint16)
    chosen = np.zeros(shape, np.uint8)
    fill_chosen_possibility(volume, chromosome, chosen)
    np.testing.assert_array_equal(chosen, reference.chosen_possibility(volume, chromosome))


def test_grey_images_of_8_bits_are_taken_as_they_are_and_colour_as_its_luma():
    left, right = pair((4, 5))
    for grey, image in zip(grey_levels(left, right), (left, right)):
        np.testing.assert_array_equal(grey, image)
    colour = np.random.default_rng(2).integers(0, 256, (4, 5, 3)).astype(np.uint8)
    luma = colour @ [0.114, 0.587, 0.299]  # blue, green, red
    assert np.abs(grey_levels(colour, colour)[0] - luma).max() <= 1
    np.testing.assert_array_equal(
        grey_levels(colour, right)[0], cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY))


@settings(max_examples=30)
@given(st.integers(8, 16), st.integers(0, 100))
def test_images_of_16_bits_keep_their_8_highest_used_bits_the_same_in_both(bits, seed):
    left, right = pair((3, 4), seed).astype(np.uint16)
    left[0, 0] = 255
    left <<= bits - 8
    right <<= bits - 8
    greys = grey_levels(left, right)
    assert all(grey.dtype == np.uint8 for grey in greys)
    np.testing.assert_array_equal(greys[0], left >> (bits - 8))
    np.testing.assert_array_equal(greys[1], right >> (bits - 8))


def test_the_brighter_image_says_how_many_bits_are_lost():
    bright, dark = np.array([[4095]], np.uint16), np.array([[160]], np.uint16)
    for pair_of_16_bits in ((bright, dark), (dark, bright)):
        greys = [int(grey[0, 0]) for grey in grey_levels(*pair_of_16_bits)]
        assert sorted(greys) == [10, 255]


def test_dark_images_of_16_bits_are_not_made_brighter():
    dark = np.array([[3, 200]], np.uint16)
    np.testing.assert_array_equal(grey_levels(dark, dark)[0], dark)
