# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The noise of a pair: how it is estimated, and how the census does without it."""
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels.possibility import features
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.realtime.matcher import Stages
from fuzzy_stereo_ros.matching.realtime.possibility import View
from fuzzy_stereo_ros.matching.realtime.views import NoiseEstimate
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census as twins

ROWS, COLUMNS = 96, 160


def estimated(image):
    """Return the noise that is found in an image, grey levels."""
    rows, columns = image.shape[:2]
    full, half = View(rows, columns, False, 0), View(rows // 2, columns // 2, False, 0)
    full.read(image, 0, 8 if image.ndim == 2 else 6, 0, rows)
    full.halve(half, 0, half.rows)
    estimate = NoiseEstimate(rows, columns)
    for first in range(0, rows, 32):
        estimate.measure(full, half, first, min(first + 32, rows))
    return estimate.level


def smooth_image():
    """Return grey that rises slowly, float (R, C)."""
    return 60 + np.add.outer(np.arange(ROWS) / 9, np.arange(COLUMNS) / 7)


@pytest.mark.parametrize('sigma', [1.0, 2.0, 4.0])
def test_noise_is_found_to_a_tenth_on_a_plain_picture(sigma):
    noise = np.random.default_rng(3).normal(0, sigma, (ROWS, COLUMNS))
    found = estimated(np.rint(smooth_image() + noise).astype(np.uint8))
    assert 0.8 * sigma < found < 1.1 * sigma


def test_texture_is_not_taken_for_noise():
    draw = np.random.default_rng(4)
    coarse = draw.integers(40, 200, (ROWS // 4, COLUMNS // 4)).astype(float)
    texture = coarse.repeat(4, axis=0).repeat(4, axis=1)
    assert estimated(texture.astype(np.uint8)) == 0


def test_noise_is_found_where_a_picture_is_plain_although_most_of_it_is_not():
    draw = np.random.default_rng(5)
    image = smooth_image()
    image[:64] += draw.integers(-40, 40, (16, COLUMNS // 4)).repeat(4, axis=0).repeat(4, axis=1)
    found = estimated(np.rint(image + draw.normal(0, 2.0, image.shape)).astype(np.uint8))
    assert 1.4 < found < 2.2


def test_the_smallest_images_have_an_estimate():
    for shape in ((2, 2), (2, 9), (17, 2)):
        assert estimated(np.full(shape, 9, np.uint8)) == 0


@settings(max_examples=60)
@given(st.integers(0, 2**20), st.integers(1, 9), st.integers(1, 70), st.integers(0, 30000))
def test_pixels_within_the_tolerance_take_the_mean_of_nine(seed, rows, columns, tolerance):
    draw = np.random.default_rng(seed)
    image = draw.integers(0, 2**16, (rows, columns))
    fine = np.pad(image, MARGIN, 'edge').astype(np.uint16)
    fine = np.pad(fine, ((0, 0), (0, SLACK)), 'edge')
    calmed = np.zeros_like(fine)
    features.calm(fine, tolerance, columns, calmed, 0, rows)
    expected = twins.calmed(image, tolerance)
    np.testing.assert_array_equal(calmed[MARGIN:-MARGIN, MARGIN:MARGIN + columns], expected)
    np.testing.assert_array_equal(calmed[:, :columns + 2 * MARGIN],
                                  np.pad(expected, MARGIN, 'edge'))


@pytest.mark.parametrize('mirrored', [False, True])
def test_the_census_compares_the_nearest_as_they_are_and_the_others_calmed(mirrored):
    image = np.random.default_rng(8).integers(0, 256, (11, 45)).astype(np.uint8)
    view = View(*image.shape, mirrored, 32)
    view.read(image, 0, 8, 0, view.rows)
    view.calm(5000, 0, view.rows)
    view.describe(0, view.rows)
    planes = view.census[..., :view.columns].astype(np.int64)
    codes = planes[:, 0] + (planes[:, 1] << 8) + (planes[:, 2] << 16)
    grey = 256 * image.astype(np.int64)
    expected = (twins.census(grey) & 255) + (twins.census(twins.calmed(grey, 5000)) & ~255)
    np.testing.assert_array_equal(codes[:, ::-1] if mirrored else codes, expected)


def test_a_pair_without_noise_is_matched_as_if_nobody_asked():
    draw = np.random.default_rng(6)
    scene = draw.integers(40, 200, (ROWS // 4, COLUMNS // 4)).repeat(4, axis=0).repeat(4, axis=1)
    left, right = scene.astype(np.uint8), np.roll(scene, -6, axis=1).astype(np.uint8)

    class Silent(NoiseEstimate):
        def of(self, pool, full, half):
            return 0.0

    maps = [StereoMatcher(MatcherConfig(disparities=16, threads=1), Stages(noise=noise)).match(
        left, right).disparity for noise in (NoiseEstimate, Silent)]
    np.testing.assert_array_equal(*maps)
