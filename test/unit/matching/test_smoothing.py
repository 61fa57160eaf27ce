# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What of a pair is smoothed before matching: what JPEG quantised, and what is too sharp."""
from census_scene import padded
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility import sharpness
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.over_frames.pictures import NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, COARSE_SIZE, FULL_SIZE, JPEG_SIZE)
from fuzzy_stereo_ros.matching.realtime.smoothing import MEAN, SHARPENED
from fuzzy_stereo_ros.matching.realtime.views import Views
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census as twins

SIZE = 136, 171     # no multiples of a block


def texture(seed=0, smooth=1.5):
    """Return a picture with texture of several scales: uint8 (R, C)."""
    draw = np.random.default_rng(seed)
    coarse, fine = (cv2.GaussianBlur(draw.normal(size=SIZE), None, sigma)
                    for sigma in (4 * smooth, smooth))
    picture = 120 + 25 * (coarse / coarse.std() + fine / fine.std()) + draw.normal(size=SIZE)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def compressed(image, quality):
    return cv2.imdecode(cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1],
                        cv2.IMREAD_UNCHANGED)


def read(left, right):
    """Return the `Views` of a pair, read and smoothed."""
    views = Views(MatcherConfig(disparities=16), *left.shape[:2], NoiseEstimate)
    views.read(ThreadPool(1), left, right)
    views.smooth(ThreadPool(1))
    return views


def luminances(views):
    """Return the luminance of both views as the images have them: [uint16 (R, C)]."""
    left, right = (view.luminance[MARGIN:-MARGIN, MARGIN:view.columns + MARGIN]
                   for view in (views.full.left, views.full.right))
    return [left, right[:, ::-1]]


def fine(image):
    """Return the luminance of an image as it is: int64 (R, C)."""
    image = image.astype(np.int64)
    return 256 * image if image.ndim == 2 else 64 * (image @ (1, 2, 1))


@settings(max_examples=40)
@given(st.integers(0, 2**20), st.integers(1, 40), st.integers(1, 150),
       st.sampled_from([MEAN, SHARPENED]), st.integers(0, 7), st.integers(1, 5))
def test_what_is_measured_of_a_picture_and_how_it_is_smoothed_are_those_of_the_twins(
        seed, rows, columns, share, begin, apart):
    draw = np.random.default_rng(seed)
    image = 256 * (draw.integers(0, 9, (rows, columns)) + draw.integers(0, 40, (rows, 1)))
    counts, sums = np.zeros(3, np.int64), np.zeros(2, np.int64)
    for first in range(0, rows, 16):
        rows_of_band = first, min(first + 16, rows)
        sharpness.count_coefficients(
            padded(image), begin, columns, apart, 256, counts, *rows_of_band)
        sharpness.add_steps(padded(image), columns, sums, *rows_of_band)
    np.testing.assert_array_equal(sums, twins.steps(image))
    np.testing.assert_allclose(
        counts, twins.coefficient_counts(image[:, begin:] / 256, apart), atol=1)

    image = draw.integers(0, 2**16, (rows, columns))
    smoothed, grey = np.zeros_like(padded(image)), np.zeros((rows, columns + SLACK), np.uint8)
    sharpness.smooth(padded(image), columns, share, smoothed, grey, 0, rows)
    expected = twins.smoothed(image, share)
    np.testing.assert_array_equal(smoothed, padded(expected))
    np.testing.assert_array_equal(grey[:, :columns], twins.eight_bits(expected))


@pytest.mark.parametrize('channels', [0, 3])
@pytest.mark.parametrize('quality, model', [
    (50, COARSE_SIZE), (65, COARSE_SIZE), (80, JPEG_SIZE), (95, FULL_SIZE)])
def test_jpeg_is_seen_both_views_are_smoothed_and_matched_by_a_model_of_their_own(
        quality, model, channels):
    """In which jumps are cheaper at the edges before smoothing."""
    images = [texture(seed) for seed in (0, 1)]
    if channels:
        images = [np.stack([image, image - image // 8, image // 2], axis=2) for image in images]
    images = [compressed(image, quality) for image in images]
    views = read(*images)
    assert views._smoothing.compressed == (model is not FULL_SIZE)
    assert views.full.model == model
    for view, image, found in zip(
            (views.full.left, views.full.right), images, luminances(views)):
        assert view.least_step == model.least_step
        np.testing.assert_array_equal(found, twins.smoothed(
            fine(image), model is not FULL_SIZE))
    views.describe(ThreadPool(1), CensusPicture.describe)
    expected = twins.jump_penalties(twins.eight_bits(fine(images[0])), twins.jump_table(model))
    np.testing.assert_array_equal(views.full.penalties.across, expected[0])
    np.testing.assert_array_equal(views.full.penalties.down, expected[1])


@pytest.mark.parametrize('change', [
    lambda image: image, lambda image: image // 2,
    lambda image: cv2.GaussianBlur(image, None, 1.5),
    lambda image: np.full_like(image, 90), lambda image: np.rint(image / 32).astype(np.uint8) * 32,
    lambda image: np.random.default_rng(2).integers(0, 256, image.shape).astype(np.uint8),
], ids=['clean', 'darker', 'blurred', 'plain', 'eight greys', 'noise alone'])
def test_pictures_alike_in_both_views_stay_as_they_are_to_the_bit(change):
    left, right = (change(texture(seed)) for seed in (0, 1))
    views = read(left, right)
    assert not views._smoothing.compressed
    for image, found in zip((left, right), luminances(views)):
        np.testing.assert_array_equal(found, fine(image))


@pytest.mark.parametrize('sigma, share', [(0.6, 0), (1.2, SHARPENED)])
@pytest.mark.parametrize('blurred', [0, 1])
def test_the_sharper_view_is_smoothed_and_a_much_blurred_one_sharpened(blurred, sigma, share):
    pair = [texture(seed, smooth=0.6) for seed in (0, 1)]
    pair[blurred] = cv2.GaussianBlur(pair[blurred], None, sigma)
    for side, (image, luminance) in enumerate(zip(pair, luminances(read(*pair)))):
        np.testing.assert_array_equal(luminance, twins.smoothed(
            fine(image), share if side == blurred else MEAN))
