# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""fill_holes fills small rejected regions as fill does, and leaves the rest as it is."""
from bench.conditions import misaligned
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest

HOLES = 12      # px


@pytest.fixture(scope='module')
def pairs():
    """Return frames of a noisy scene with holes of many sizes, whose rows do not fit."""
    frames = [make_pair(120, 200, 32, 4, objects=6, noise=noise) for noise in (4.0, 5.0)]
    return [(one.left, misaligned(one.right, tilt=1.5)) for one in frames]


def matched(pairs, profile, **changes):
    matcher = StereoMatcher(MatcherConfig.from_profile(profile, **{
        'disparities': 32, 'generations': 2, 'threads': 1, **changes}))
    return [matcher.match(*pair) for pair in pairs][-1]


def regions(rejected):
    """Yield the places of each 4-connected region, by a search from pixel to pixel."""
    left = set(zip(*map(np.ndarray.tolist, np.nonzero(rejected))))
    while left:
        found, new = [], [left.pop()]
        while new:
            row, column = new.pop()
            found.append((row, column))
            for near in ((row + 1, column), (row - 1, column), (row, column + 1),
                         (row, column - 1)):
                if near in left:
                    left.remove(near)
                    new.append(near)
        yield tuple(np.transpose(found))


@pytest.mark.parametrize(('profile', 'threshold'), [
    *(pytest.param(name, 0.0, marks=[pytest.mark.slow] * (name == 'quality'))
      for name in PROFILES), ('realtime', 0.5)])
def test_small_holes_are_filled_and_all_else_stays_as_it_is(pairs, profile, threshold):
    plain, filled, found = (
        matched(pairs, profile, confidence_threshold=threshold, **changes)
        for changes in ({}, {'fill': True}, {'fill_holes': HOLES}))
    expected, sizes = plain.disparity.copy(), []
    for region in regions(np.isnan(plain.disparity)):
        sizes.append(len(region[0]))
        if sizes[-1] <= HOLES:
            expected[region] = filled.disparity[region]
    assert max(sizes) > HOLES
    assert np.isnan(expected).sum() < np.isnan(plain.disparity).sum()
    np.testing.assert_array_equal(found.disparity, expected)
    np.testing.assert_array_equal(found.confidence, plain.confidence)
