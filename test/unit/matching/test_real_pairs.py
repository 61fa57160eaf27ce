# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every profile on real pairs with ground truth, cold; skipped where they are not here."""
from functools import cache

import cv2
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import made_scenes
import numpy as np
import pytest
from real_pairs import MIDDLEBURY, middlebury, motorcycle

TABLE_I = {'tsukuba': 2.74, 'venus': 2.5, 'teddy': 14.7, 'cones': 7.78}
# Bounds are within a tenth of what is measured, so that what gets worse is seen.
AT_MOST = {'tsukuba': 2.3, 'venus': 0.77, 'teddy': 4.5, 'cones': 3.15}
QUALITY_AT_MOST = {'tsukuba': 1.35, 'venus': 0.6, 'teddy': 2.6, 'cones': 2.65}


def matched(pair, profile='realtime', **changes):
    config = MatcherConfig.from_profile(
        profile, disparities=pair.disparities, **{'fill': True, **changes})
    return StereoMatcher(config).match(pair.left, pair.right)


@cache
def bad_1(name, profile='realtime'):
    """Return percent wrong by more than 1 px, nonocc, dense; tsukuba's truth is whole-pixel."""
    pair = middlebury(name)
    disparity = matched(pair, profile).disparity
    if name == 'tsukuba':
        disparity = np.rint(disparity)
    return score(disparity, pair.truth, pair.visible).bad_dense[1.0]


@pytest.mark.parametrize('name', MIDDLEBURY)
def test_each_pair_of_the_paper_has_fewer_wrong_pixels_than_its_table_1_says(name):
    assert bad_1(name) < AT_MOST[name] < TABLE_I[name]


@pytest.mark.slow
@pytest.mark.parametrize('name', MIDDLEBURY)
def test_quality_has_fewer_wrong_pixels_than_realtime_on_each_pair_of_the_paper(name):
    assert bad_1(name, 'quality') < min(QUALITY_AT_MOST[name], bad_1(name))


@cache
def on_the_motorcycle(profile='realtime', **changes):
    """Return the scores of a match of the motorcycle."""
    pair = motorcycle()
    return score(matched(pair, profile, **changes).disparity, pair.truth, pair.visible)


@pytest.mark.slow
def test_quality_has_fewer_wrong_pixels_than_realtime_on_the_motorcycle():
    quality = on_the_motorcycle('quality')
    for limit in (0.5, 1.0, 3.0):
        assert quality.bad_dense[limit] < on_the_motorcycle().bad_dense[limit]
    assert quality.bad_dense[1.0] < 3.5
    assert quality.average_error < 0.52


def test_the_motorcycle_is_found_but_for_few_pixels_and_what_stays_valid_is_right():
    dense, sparse = on_the_motorcycle(), on_the_motorcycle(fill=False)
    assert dense.bad_dense[1.0] < 4.15
    assert dense.bad_dense[3.0] < 2.35
    assert dense.average_error < 0.58
    assert sparse.density > 97.3
    assert sparse.bad_sparse[1.0] < 3.0


def test_fewer_valid_pixels_of_the_motorcycle_are_wrong_than_by_semi_global_matching():
    """By the fastest mode of OpenCV as tuned for such scenes, its left border padded."""
    pair = motorcycle()
    matcher = cv2.StereoSGBM_create(0, pair.disparities, 3, 36, 288, 1, 15, 5, 100, 2,
                                    cv2.STEREO_SGBM_MODE_SGBM_3WAY)
    padded = [cv2.copyMakeBorder(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), 0, 0,
                                 pair.disparities, 0, cv2.BORDER_REPLICATE)
              for image in pair[:2]]
    theirs = matcher.compute(*padded)[:, pair.disparities:] / np.float32(16)
    theirs[theirs < 0] = np.nan
    ours, theirs = on_the_motorcycle(fill=False), score(theirs, pair.truth, pair.visible)
    assert ours.bad_sparse[1.0] < theirs.bad_sparse[1.0]
    assert ours.bad_dense[1.0] < theirs.bad_dense[1.0]


FEW = {'population': 20, 'generations': 20}


def wrong(name, **changes):
    """Return what `bad_1` does of the profile paper, whose disparities are whole."""
    pair = middlebury(name)
    return made_scenes.wrong(matched(pair, 'paper', **changes), pair)


def test_from_noise_tsukuba_is_below_table_i_with_the_papers_population():
    assert wrong('tsukuba') < 2.0


@pytest.mark.parametrize('name, most', [('venus', 1.3), ('teddy', 8.5), ('cones', 3.4)])
def test_from_winner_takes_all_few_generations_are_below_table_i(name, most):
    assert most < TABLE_I[name]
    assert wrong(name, initial_population='winner_takes_all', **FEW) < most
