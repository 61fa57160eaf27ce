# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Known answers of whole matches where integers are narrow: many disparities, deep images."""
from dataclasses import replace

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np
import pytest

FULL = 2**16 - 1
BORDER = 6      # px, where windows reach beyond the image


@pytest.fixture(params=['realtime', 'quality'])
def config(request):
    return MatcherConfig.from_profile(request.param, threads=1, generations=1, speckle_size=0)


def texture(rows, columns, kind=np.uint8, seed=0):
    """Return random patches of 2 x 2 pixels."""
    patches = np.random.default_rng(seed).integers(
        0, np.iinfo(kind).max, (rows // 2 + 1, columns // 2 + 1), kind, endpoint=True)
    return patches.repeat(2, axis=0).repeat(2, axis=1)[:rows, :columns]


def shifted(shift, rows, columns, kind=np.uint8):
    """Return a pair that has the disparity `shift` where the left image's pixels are seen."""
    margin = abs(shift)
    whole = texture(rows, columns + 2 * margin, kind)
    return (np.ascontiguousarray(whole[:, margin:margin + columns]),
            np.ascontiguousarray(whole[:, margin + shift:margin + shift + columns]))


def share_found(match, shift):
    """Return the share of the pixels seen by both, borders apart, that have the disparity."""
    columns = match.disparity.shape[1]
    seen = match.disparity[:, max(0, shift) + BORDER:columns - max(0, -shift) - BORDER]
    return np.mean(np.abs(seen - shift) < 0.5)


@pytest.mark.parametrize('disparities', [1, 2, 31, 33, 255, 256, 257, 512])
@pytest.mark.parametrize('place', [0, -1], ids=['first', 'last'])
def test_the_first_and_the_last_of_any_number_of_disparities_are_found(
        config, disparities, place):
    shift = range(disparities)[place]
    pair = shifted(shift, 21, disparities + 63)
    match = StereoMatcher(replace(config, disparities=disparities)).match(*pair)
    assert share_found(match, shift) > 0.98


@pytest.mark.parametrize('min_disparity', [-2048, -300, -17, 17, 300, 2048])
def test_a_disparity_is_found_from_any_smallest_one(config, min_disparity):
    shift = min_disparity + 5
    pair = shifted(shift, 21, abs(min_disparity) + 70)
    match = StereoMatcher(replace(
        config, disparities=16, min_disparity=min_disparity)).match(*pair)
    assert share_found(match, shift) > 0.98


@pytest.mark.parametrize('low, high', [(0, FULL), (FULL - 4096, FULL), (0, 1), (30000, 34000)])
def test_sixteen_bits_saturate_nowhere(config, low, high):
    """The two greys lie far apart, or near to an end or the middle of 16 bits."""
    images = [np.where(image > 127, np.uint16(high), np.uint16(low))
              for image in shifted(9, 31, 101)]
    match = StereoMatcher(replace(config, disparities=24)).match(*images)
    assert share_found(match, 9) > 0.98
