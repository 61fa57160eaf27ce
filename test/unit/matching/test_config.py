# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The configuration of the matcher: for reduced images, and what is heeded of it."""
from dataclasses import fields, replace
import re
import sys

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from hypothesis import given, strategies as st
import numpy as np
import pytest

ranges = st.tuples(st.integers(-2048, 2048), st.integers(1, 4096))
scales = st.one_of(st.sampled_from([1.0, 0.5, 0.25]), st.floats(0.05, 1.0))


@given(ranges, scales, st.floats(0, 1))
def test_every_disparity_of_the_full_size_lies_in_the_range_of_the_reduced_one(
        searched, scale, share):
    first, count = searched
    small = MatcherConfig(min_disparity=first, disparities=count).at_scale(scale)
    disparity = (first + share * (count - 1)) * scale
    assert small.min_disparity <= disparity <= small.min_disparity + small.disparities - 1


@given(st.sampled_from([1, 0.5, 0.25, 0.01]))
def test_parameters_in_pixels_shrink_and_all_others_stay(scale):
    """What is off stays off, and nothing else is switched off."""
    config = MatcherConfig.from_profile(
        'quality', speckle_size=100, speckle_range=4, fill_holes=8, neighbourhood=21, seed=5)
    for one in (config, replace(config, speckle_size=0, fill_holes=0)):
        assert replace(one.at_scale(scale), min_disparity=0, disparities=64) == replace(
            one, min_disparity=0, disparities=64,
            speckle_size=one.speckle_size and max(round(100 * scale**2), 1),
            speckle_range=max(round(4 * scale), 1),
            fill_holes=one.fill_holes and max(round(8 * scale**2), 1),
            neighbourhood=max(round(21 * scale), 1) | 1)


@pytest.mark.parametrize('scale', [0, -1, 1.5, float('nan')])
def test_a_scale_that_does_not_reduce_is_rejected(scale):
    with pytest.raises(ValueError, match=f'scale is {scale}; allowed are numbers above 0 up to 1'):
        MatcherConfig().at_scale(scale)


class Watched(MatcherConfig):
    """A configuration that notes what is read of it, but for copies and keys of caches."""

    read = set()

    def __getattribute__(self, name):
        if sys._getframe(1).f_code.co_name not in (
                'replace', '__post_init__', '__hash__', '__eq__'):
            Watched.read.add(name)
        return super().__getattribute__(name)


@pytest.mark.parametrize('algorithm', ['realtime', 'quality', 'paper'])
def test_parameters_of_some_algorithms_name_them(algorithm):
    random = np.random.default_rng(0)
    config = Watched(algorithm=algorithm, disparities=8, generations=3, population=4)
    Watched.read.clear()
    matcher = StereoMatcher(config)
    for stamp in (1, 2):
        matcher.match(*random.integers(0, 256, (2, 32, 48), np.uint8), stamp=stamp)
    heeded = {field.name for field in fields(MatcherConfig) if field.name in Watched.read}
    named = {field.name: re.search(r'\(((realtime|quality|paper)\b[a-z ]*)',
                                   field.metadata['row'].sentence)
             for field in fields(MatcherConfig)}
    assert heeded == {name for name, algorithms in named.items()
                      if algorithms is None or algorithm in algorithms[1].split()}
