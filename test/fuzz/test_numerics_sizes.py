# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Known answers of whole matches where integers are narrow: many disparities, deep images."""
from fuzzed import examples
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from hypothesis import given, strategies as st
import numpy as np
import pytest

FULL = 2**16 - 1
BORDER = 6      # px, where windows reach beyond the image
COUNTS = st.integers(1, 512) | st.sampled_from([1, 2, 31, 33, 255, 256, 257, 512])
LEVELS = st.sampled_from([(0, 255), (0, FULL), (FULL - 4096, FULL), (0, 1), (30000, 34000)])


@pytest.mark.parametrize('profile', ['realtime', 'quality'])
@examples(40)
@given(disparities=COUNTS, least=st.sampled_from([0, 0, -2048, -300, -17, 17, 300, 2048]),
       place=st.sampled_from([0, -1]), levels=LEVELS, seed=st.integers(0, 99))
def test_the_first_and_the_last_disparity_of_any_range_are_found_in_any_grey_levels(
        profile, disparities, least, place, levels, seed):
    """Of random patches of 2 x 2 pixels in few or many grey levels, of 8 or 16 bits."""
    disparities = min(disparities, 24) if levels[1] == 1 else disparities
    config = MatcherConfig.from_profile(
        profile, threads=1, generations=1, speckle_size=0, disparities=disparities,
        min_disparity=least)
    shift = range(least, least + disparities)[place]
    margin, columns = abs(shift), max(disparities, abs(shift)) + 99
    whole = np.random.default_rng(seed).integers(
        *levels, (15, columns // 2 + margin + 1), np.uint8 if levels[1] == 255 else np.uint16,
        endpoint=True).repeat(2, axis=0).repeat(2, axis=1)
    left, right = (np.ascontiguousarray(whole[:, begin:begin + columns])
                   for begin in (margin, margin + shift))
    found = StereoMatcher(config).match(left, right).disparity[
        :, max(0, shift) + BORDER:columns - max(0, -shift) - BORDER]
    assert np.mean(np.abs(found - shift) < 0.5) > 0.8
