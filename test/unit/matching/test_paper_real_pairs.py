# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile `paper` against its Table I, on the real pairs; skipped where they are not here."""
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np
import pytest
import real_pairs

TABLE_I = {'tsukuba': 2.74, 'venus': 2.5, 'teddy': 14.7, 'cones': 7.78}
FEW = {'population': 20, 'generations': 20}


def wrong(name, **changes):
    """Return the percent of pixels seen by both that are off by more than one pixel."""
    pair = real_pairs.middlebury(name)
    config = MatcherConfig.from_profile('paper', disparities=pair.disparities, reference='left',
                                        **changes)
    match = StereoMatcher(config).match(pair.left, pair.right)
    assert not np.isnan(match.disparity).any()
    return score(match.disparity, pair.truth, pair.visible, (1.0,)).bad_dense[1.0]


def test_from_noise_tsukuba_is_below_table_i_with_the_papers_population():
    assert wrong('tsukuba') < 2.0


@pytest.mark.parametrize('name, most', [('venus', 1.3), ('teddy', 8.5), ('cones', 3.4)])
def test_from_winner_takes_all_few_generations_are_below_table_i(name, most):
    assert most < TABLE_I[name]
    assert wrong(name, initial_population='winner_takes_all', **FEW) < most


def test_the_literal_reading_stays_noise():
    assert wrong('tsukuba', reading='literal', neighbourhood=5, **FEW) > 70
