# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is read of a pair: luminance, census, gradient, penalties, noise, and what is smoothed."""
from census_scene import padded, small_pair
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility import sharpness
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift, NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, COARSE_SIZE, FULL_SIZE, JPEG_SIZE)
from fuzzy_stereo_ros.matching.realtime.smoothing import MEAN, SHARPENED
from fuzzy_stereo_ros.matching.realtime.views import Views
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census as twins


@settings(max_examples=200)
@given(st.integers(1, 12), st.integers(1, 9) | st.integers(1, 80), st.sampled_from([0, 3]),
       st.sampled_from([(np.uint8, 9), (np.uint8, 11), (np.uint16, 1), (np.uint16, 13)]),
       st.booleans(), st.sampled_from([0, 3, -2, 100, -100]), st.booleans(),
       st.sampled_from([0, 5000, 30000]), st.sampled_from([0, 2000]))
def test_an_image_of_any_size_and_kind_is_read_and_described_as_by_the_twins(
        rows, columns, channels, kind, fits, shift, mirrored, tolerance, least_step):
    """Moved, too bright for 16 bits, or denoised but for the nearest pixels; padding too."""
    (dtype, places), shape = kind, (rows, columns)
    image = small_pair(*shape, channels=channels, dtype=dtype)[0]
    image[0, 0], image[-1, -1] = np.iinfo(dtype).max, 0
    places = luminance_shift(image, image) if fits else places
    view = CensusPicture(*shape, mirrored, 32)
    view.read(image, shift, places, 0, rows)
    view.least_step = least_step
    for first in range(0, rows, 4):
        view.describe(first, min(first + 4, rows), tolerance)
    fine = twins.luminance(image, shift, places)
    far = twins.denoised(fine, tolerance)
    codes = (twins.census(fine, least_step) & 255) + (twins.census(far, least_step) & ~255)
    np.testing.assert_array_equal(view.luminance, padded(fine[:, ::-1] if mirrored else fine))
    planes = view.census.astype(np.int64)
    grey = twins.eight_bits(fine)
    for values, expected in (
            (view.grey, grey), (view.slopes, twins.gradient(grey)),
            (planes[:, 0] + (planes[:, 1] << 8) + (planes[:, 2] << 16), codes)):
        inside = values[:, :columns]
        np.testing.assert_array_equal(inside[:, ::-1] if mirrored else inside, expected)


@pytest.mark.parametrize('dtype, channels, brightest, places', [
    (np.uint8, 0, 0, 15), (np.uint8, 0, 63, 10), (np.uint8, 0, 64, 8), (np.uint8, 0, 255, 8),
    (np.uint8, 3, 3, 12), (np.uint8, 3, 255, 6),
    (np.uint16, 0, 0, 15), (np.uint16, 0, 1023, 6), (np.uint16, 0, 1024, 5),
    (np.uint16, 0, 65535, 0), (np.uint16, 3, 4095, 2), (np.uint16, 3, 65535, -2)])
def test_a_pair_is_brought_to_16_bits_by_its_brightest_pixel(dtype, channels, brightest, places):
    shape = (2, 2, 3)[:2 + (channels > 0)]
    dark, bright = np.zeros(shape, dtype), np.zeros(shape, dtype)
    bright[0, 1] = brightest
    assert luminance_shift(dark, bright) == luminance_shift(bright, dark) == places


@pytest.mark.parametrize('bright, places', [(0, 8), (99, 8), (100, 8), (101, 4)])
def test_a_dark_pair_is_brought_to_16_bits_but_for_few_bright_pixels(bright, places):
    dark = np.full((250, 400), 200, np.uint16)
    lit = dark.copy()
    lit.reshape(-1)[:bright] = 4095
    assert luminance_shift(dark, lit) == luminance_shift(lit, dark) == places


@given(st.lists(st.tuples(st.sampled_from([0, 3]), st.integers(0, 16)), min_size=2, max_size=6))
def test_no_grey_pair_loses_bits_after_pairs_of_any_kind_and_brightness(pairs):
    places = None
    for channels, bits in pairs:
        image = np.full((2, 3, 3)[:2 + (channels > 0)], 2**bits - 1, np.uint16)
        places = luminance_shift(image, image, places)
        assert places >= (-2 if channels else 0)


@pytest.mark.parametrize('sigma', [1.0, 2.0, 4.0])
def test_noise_is_found_to_a_tenth_on_a_picture_that_rises_slowly(sigma):
    grey = 60 + np.add.outer(np.arange(96) / 9, np.arange(160) / 7)
    noise = np.random.default_rng(3).normal(0, sigma, grey.shape)
    view = CensusPicture(96, 160, False, 0)
    view.read(np.rint(grey + noise).astype(np.uint8), 0, 8, 0, 96)
    estimate = NoiseEstimate(96, 160)
    for first in range(0, 96, 32):
        estimate.measure(view, first, first + 32)
    estimate.estimate()
    assert 0.8 * sigma < estimate.level < 1.1 * sigma


SIZE = 136, 171     # no multiples of a block


def texture(seed=0, smooth=1.5):
    """Return a picture with texture of several scales: uint8 (R, C)."""
    draw = np.random.default_rng(seed)
    coarse, fine = (cv2.GaussianBlur(draw.normal(size=SIZE), None, sigma)
                    for sigma in (4 * smooth, smooth))
    picture = 120 + 25 * (coarse / coarse.std() + fine / fine.std()) + draw.normal(size=SIZE)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def read(left, right):
    """Return the `Views` of a pair, read and smoothed."""
    views = Views(MatcherConfig(disparities=16), *left.shape[:2])
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
    images = [cv2.imdecode(cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1],
                           cv2.IMREAD_UNCHANGED) for image in images]
    views = read(*images)
    assert views._smoothing.compressed == (model is not FULL_SIZE)
    assert views.full.model == model
    for view, image, found in zip(
            (views.full.left, views.full.right), images, luminances(views)):
        assert view.least_step == model.least_step
        np.testing.assert_array_equal(found, twins.smoothed(
            fine(image), model is not FULL_SIZE))
    views.noise = quality / 10      # of which steps of grey are no edges; it counts up to 8
    views.describe(ThreadPool(1))
    expected = twins.jump_penalties(
        twins.eight_bits(fine(images[0])), twins.jump_table(model, min(views.noise, 8)))
    np.testing.assert_array_equal(views.full.penalties.across, expected[0])
    np.testing.assert_array_equal(views.full.penalties.down, expected[1])
    expected = twins.jump_penalties(
        views.half.left.grey[:, :views.half.columns],
        twins.jump_table(views.half.model, min(views.noise, 8) / 2))
    np.testing.assert_array_equal(views.half.penalties.across, expected[0])
    np.testing.assert_array_equal(views.half.penalties.down, expected[1])


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
