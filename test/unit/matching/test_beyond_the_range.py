# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is nearer than the range is rejected and counted, and becomes no surface of the range."""
from dataclasses import replace

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.out_of_range import EXTRA_LABELS, reject_beyond, searched
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

CUT, TOP = 36, 35.0      # disparities, three quarters of a scene's, and the last of them


@pytest.fixture(scope='module')
def known():
    return make_pair(120, 200, 48, 4, objects=6, noise=1.5)


def rejected(disparity, min_disparity=0, disparities=CUT):
    """Return the match that is left of disparities, all of confidence 1."""
    # Repeated, so that the margin does not end where the image does.
    disparity = np.tile(np.array(disparity, np.float32), (1, disparities + EXTRA_LABELS))
    match = Match(disparity.copy(), np.ones_like(disparity), [], {}, False)
    return reject_beyond(ThreadPool(1), MatcherConfig(
        min_disparity=min_disparity, disparities=disparities), disparities + EXTRA_LABELS, match)


@pytest.mark.parametrize('profile', ['realtime', 'quality'])
def test_what_is_nearer_than_the_range_is_no_surface_and_not_filled_where_it_was_found(
        known, profile):
    nearer = known.truth > TOP + 0.5
    match, filled = (StereoMatcher(profile, disparities=CUT, fill=fill).match(*known[:2])
                     for fill in (False, True))
    assert nearer.mean() > 0.05
    assert (match.confidence[nearer] >= 0.5).mean() <= 0.05
    assert (match.confidence[nearer] >= 0.8).mean() <= 0.02
    assert np.nanmax(match.disparity) <= TOP
    assert match.beyond == pytest.approx(nearer.mean(), abs=0.05)
    assert match.needed_disparities > CUT
    assert profile == 'quality' or np.isnan(filled.disparity[nearer]).mean() > 0.8
    assert not filled.confidence[np.isnan(filled.disparity)].any()


@given(st.integers(1, 4096), st.integers(1, 9999))
def test_the_margin_ends_where_the_image_and_what_can_be_searched_do(disparities, columns):
    config = MatcherConfig(disparities=disparities)
    most = max(min(columns, 4096), disparities)
    assert searched(config, columns).disparities == min(disparities + EXTRA_LABELS, most)
    assert searched(replace(config, algorithm='paper'), columns).disparities == disparities


@settings(max_examples=50)
@given(st.lists(st.sampled_from([0.0, 34.9, 35.0, 35.4, 35.5, 35.6, 36.4, 43.0, 46.0, np.nan]),
                min_size=1, max_size=40), st.sampled_from([0, -20, 7]))
def test_more_than_half_a_pixel_beyond_the_range_is_rejected(values, lowest):
    values = np.array([values], np.float32) + lowest
    match, top = rejected(values, lowest), TOP + lowest
    values = np.tile(values, (1, CUT + EXTRA_LABELS))
    kept = ~(values > top + 0.5)
    np.testing.assert_array_equal(match.disparity, np.where(
        kept, np.minimum(values, np.float32(top)), np.nan))
    np.testing.assert_array_equal(match.confidence, kept)
    counted = np.isfinite(values) & ~(values > top + EXTRA_LABELS - 0.5)     # not the last label
    assert match.beyond == (~kept & counted).sum() / max(counted.sum(), 1)


@pytest.mark.parametrize('values, disparities, enough', [
    ([3.0, 35.4], CUT, CUT), ([3.0, 38.0], CUT, 48), ([47.0, 38.0], CUT, 48), ([42.0], CUT, 48),
    ([38.0] * 20 + [42.0], CUT, 48), ([3.0, 43.0], CUT, CUT),
    ([102.0] * 3 + [98.0], 96, 128), ([98.0] * 30 + [102.0], 96, 112)])
def test_the_range_that_would_do_holds_what_was_found_or_is_a_third_larger(
        values, disparities, enough):
    assert rejected([values], disparities=disparities).needed_disparities == enough


def test_the_finding_says_how_much_lies_beyond_and_what_to_search(known):
    config = MatcherConfig(disparities=48)
    match = StereoMatcher(config).match(known.left, known.right)
    check = PlausibilityCheck()
    assert check.add(known.left, known.right, match, config) is None
    match = replace(match, beyond=0.032, needed_disparities=80)     # too few features show it
    assert check.add(known.left, known.right, match, config).sentence == (
        '3.2 % of the matches are nearer than the range reaches (disparity above 47) and were '
        'rejected: search 80 disparities or more')
