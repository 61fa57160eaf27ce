# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is read of images: luminance, halving, census, gradient, penalties, noise."""
from census_scene import padded, small_pair
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift, NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.possibility import CensusPicture
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census as twins


@settings(max_examples=400)
@given(st.integers(1, 12), st.integers(1, 9) | st.integers(1, 80), st.sampled_from([0, 3]),
       st.sampled_from([(np.uint8, 9), (np.uint8, 11), (np.uint16, 1), (np.uint16, 13)]),
       st.booleans(), st.sampled_from([0, 3, -2, 100, -100]), st.booleans(),
       st.sampled_from([None, 0, 5000, 30000]), st.sampled_from([0, 2000]))
def test_an_image_of_any_size_and_kind_is_read_and_described_as_by_the_twins(
        rows, columns, channels, kind, fits, shift, mirrored, tolerance, least_step):
    """Moved, too bright for 16 bits, or denoised but for the nearest pixels; padding too."""
    (dtype, places), shape = kind, (rows, columns)
    image = small_pair(*shape, channels=channels, dtype=dtype)[0]
    image[0, 0], image[-1, -1] = np.iinfo(dtype).max, 0
    places = luminance_shift(image, image) if fits else places
    view = CensusPicture(*shape, mirrored, 32)
    view.read(image, shift, places, 0, rows)
    if tolerance is not None:
        view.denoise(tolerance, 0, rows)
    view.least_step = least_step
    view.describe(0, rows)
    fine = twins.luminance(image, shift, places)
    far = fine if tolerance is None else twins.denoised(fine, tolerance)
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


ROWS, COLUMNS = 96, 160


def estimated(image):
    """Return the noise that is found in an image, grey levels."""
    full, half = (CensusPicture(ROWS // size, COLUMNS // size, False, 0) for size in (1, 2))
    full.read(image, 0, 8, 0, ROWS)
    full.halve(half, 0, half.rows)
    estimate = NoiseEstimate(ROWS, COLUMNS)
    for first in range(0, ROWS, 32):
        estimate.measure(full, half, first, first + 32)
    return estimate.level


@pytest.mark.parametrize('sigma', [1.0, 2.0, 4.0])
def test_noise_is_found_to_a_tenth_on_a_picture_that_rises_slowly(sigma):
    grey = 60 + np.add.outer(np.arange(ROWS) / 9, np.arange(COLUMNS) / 7)
    noise = np.random.default_rng(3).normal(0, sigma, grey.shape)
    found = estimated(np.rint(grey + noise).astype(np.uint8))
    assert 0.8 * sigma < found < 1.1 * sigma
