# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every profile on real pairs with ground truth, cold; skipped where they are not here."""
from functools import cache

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
import numpy as np
import pytest
from real_pairs import middlebury, motorcycle


@cache
def on_the_motorcycle(profile='realtime', **changes):
    """Return the scores of a match of the motorcycle."""
    return scores(motorcycle(), profile, **changes)


def scores(pair, profile, whole=False, **changes):
    """Return the scores of a match; whole: that of disparities in whole pixels, as the truth."""
    matcher = StereoMatcher(profile, disparities=pair.disparities, **{'fill': True, **changes})
    disparity = matcher.match(pair.left, pair.right).disparity
    return score(np.rint(disparity) if whole else disparity, pair.truth, pair.visible)


# Bounds are within a tenth of what is measured, so that what gets worse is seen.
@pytest.mark.parametrize('profile', [
    'realtime', *(pytest.param(name, marks=pytest.mark.slow) for name in ('paper', 'quality'))])
@pytest.mark.parametrize('name, table_i, at_most', [
    ('tsukuba', 2.74, (2.3, 2.0, 1.35)), ('venus', 2.5, (0.77, 1.3, 0.6)),
    ('teddy', 14.7, (4.5, 8.5, 2.7)), ('cones', 7.78, (3.15, 3.4, 2.65))])
def test_each_pair_of_the_paper_has_fewer_wrong_pixels_than_its_table_1_says(
        name, table_i, at_most, profile):
    """Of `paper` tsukuba from noise, the others from winner takes all in few generations."""
    few = {} if profile != 'paper' or name == 'tsukuba' else {
        'initial_population': 'winner_takes_all', 'population': 20, 'generations': 20}
    bound = dict(zip(('realtime', 'paper', 'quality'), at_most))[profile]
    pair, whole = middlebury(name), name == 'tsukuba'
    found = scores(pair, profile, whole, **few).bad_dense[1.0]
    assert found < bound < table_i
    assert profile != 'quality' or found < scores(pair, 'realtime', whole).bad_dense[1.0]


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
    assert sparse.bad_sparse[1.0] < 3.0     # of the tuned 3WAY of OpenCV 5.6 %
