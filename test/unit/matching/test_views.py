# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is read of images: luminance, halving, census, gradient, penalties, noise."""
from census_scene import padded, small_pair
from fuzzy_stereo_ros.matching.kernels.possibility import features
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift, NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.possibility import CensusPicture
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census as twins

SHAPES = [(5, 7), (1, 1), (1, 9), (9, 1), (2, 2), (6, 33), (3, 64), (4, 65)]
REACH = 32
BOTH_WAYS = pytest.mark.parametrize('mirrored', [False, True])


def view_of(image, mirrored=False, shift=0, places=None):
    """Return a view that has read and described an image."""
    rows, columns = image.shape[:2]
    view = CensusPicture(rows, columns, mirrored, REACH)
    view.read(image, shift, luminance_shift(image, image) if places is None else places, 0, rows)
    view.describe(0, rows)
    return view


def unmirrored(values, view):
    """Return the columns of an array (.., C or more) of a view as the image has them."""
    inside = values[..., :view.columns]
    return inside[..., ::-1] if view.mirrored else inside


def codes_of(view):
    """Return the three byte planes of the census as numbers of 24 bits."""
    planes = unmirrored(view.census, view).astype(np.int64)
    return planes[:, 0] + (planes[:, 1] << 8) + (planes[:, 2] << 16)


def image_of(shape, channels=0, dtype=np.uint8, seed=0):
    return small_pair(*shape, seed=seed, channels=channels, dtype=dtype)[0]


# ---- grey, census and gradient ----


def check(image, mirrored, shift=0, places=None):
    """Check all that is read of an image, padding too, against the twins."""
    view = view_of(image, mirrored, shift, places)
    luminance = twins.luminance(
        image, shift, luminance_shift(image, image) if places is None else places)
    seen = luminance[:, ::-1] if mirrored else luminance
    np.testing.assert_array_equal(view.luminance, padded(seen))
    np.testing.assert_array_equal(unmirrored(view.grey, view), twins.eight_bits(luminance))
    np.testing.assert_array_equal(codes_of(view), twins.census(luminance))
    np.testing.assert_array_equal(
        unmirrored(view.slopes, view), twins.gradient(twins.eight_bits(luminance)))
    return luminance


@BOTH_WAYS
@pytest.mark.parametrize('shape, shift', [
    *((shape, 0) for shape in (*SHAPES, (2, 32), (2, 31), (3, 70))),
    *(((5, 7), shift) for shift in (3, -2, 100, -100))])
@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('channels', [0, 3])
def test_an_image_of_any_size_and_kind_moved_by_any_shift_is_read_as_by_the_twins(
        channels, dtype, shape, shift, mirrored):
    image = image_of(shape, channels, dtype)
    image[0, 0], image[-1, -1] = np.iinfo(dtype).max, 0
    check(image, mirrored, shift)


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


@BOTH_WAYS
@pytest.mark.parametrize('channels', [0, 3])
@pytest.mark.parametrize('dtype, places', [
    (np.uint16, 1), (np.uint16, 7), (np.uint16, 13), (np.uint8, 9), (np.uint8, 11)])
def test_what_is_brighter_than_16_bits_of_fine_grey_is_white(dtype, places, channels, mirrored):
    image = image_of((5, 37), channels, dtype)
    image[2, 3] = np.iinfo(dtype).max
    assert (check(image, mirrored, places=places) == 65535).any()


@pytest.mark.parametrize('bright, places', [(0, 8), (99, 8), (100, 8), (101, 4)])
def test_a_dark_pair_is_brought_to_16_bits_but_for_few_bright_pixels(bright, places):
    dark = np.full((250, 400), 200, np.uint16)
    lit = dark.copy()
    lit.reshape(-1)[:bright] = 4095
    assert luminance_shift(dark, lit) == luminance_shift(lit, dark) == places


# ---- noise ----


ROWS, COLUMNS = 96, 160


def estimated(image):
    """Return the noise that is found in an image, grey levels."""
    rows, columns = image.shape[:2]
    full = CensusPicture(rows, columns, False, 0)
    half = CensusPicture(rows // 2, columns // 2, False, 0)
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


@settings(max_examples=60)
@given(st.integers(0, 2**20), st.integers(1, 9), st.integers(1, 70), st.integers(0, 30000))
def test_pixels_within_the_tolerance_take_the_mean_of_nine(seed, rows, columns, tolerance):
    draw = np.random.default_rng(seed)
    image = draw.integers(0, 2**16, (rows, columns))
    denoised = np.zeros_like(padded(image))
    features.denoise(padded(image), tolerance, columns, denoised, 0, rows)
    np.testing.assert_array_equal(denoised[:, :columns + 2 * MARGIN], np.pad(
        twins.denoised(image, tolerance), MARGIN, 'edge'))


@pytest.mark.parametrize('least_step', [0, 2000])
@pytest.mark.parametrize('mirrored', [False, True])
def test_the_census_compares_the_nearest_as_they_are_and_the_others_denoised(mirrored, least_step):
    image = np.random.default_rng(8).integers(0, 256, (11, 45)).astype(np.uint8)
    view = CensusPicture(*image.shape, mirrored, 32)
    view.read(image, 0, 8, 0, view.rows)
    view.denoise(5000, 0, view.rows)
    view.least_step = least_step
    view.describe(0, view.rows)
    planes = view.census[..., :view.columns].astype(np.int64)
    codes = planes[:, 0] + (planes[:, 1] << 8) + (planes[:, 2] << 16)
    grey = 256 * image.astype(np.int64)
    near, far = (twins.census(image, least_step) for image in (grey, twins.denoised(grey, 5000)))
    expected = (near & 255) + (far & ~255)
    np.testing.assert_array_equal(codes[:, ::-1] if mirrored else codes, expected)
