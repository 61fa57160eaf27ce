# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every variant of the ablation changes the matcher; the correlation knows better from worse."""
from bench import variants
from bench.truth import spearman
from bench.variants import REALTIME
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from made_scenes import FEW, known, noisy
import numpy as np
import pandas as pd
import pytest

# Planes need plain regions, which this scene has not: other tests hold what is without them.
WITHOUT_PLANES = [one for one in REALTIME[1:] if one.part not in ('crossover', 'mutation')
                  and not one.name.endswith(('line crossover', 'no evolution from frame to frame',
                                             'no vote of plain regions',
                                             'no planes of plain regions', variants.NOT_FOLLOWED))]


def matched(stages=None, frames=1, **changes):
    """Return the matcher and what came of it after frames of one scene."""
    matcher = StereoMatcher(
        MatcherConfig(disparities=FEW, threads=1, **changes), stages)
    pair, random, noise = known(noise=6.0), np.random.default_rng(7), 4.0 * (frames > 1)
    for _ in range(frames):
        match = matcher.match(*noisy((pair.left, pair.right), noise, random))
    return matcher, match


@pytest.mark.parametrize('variant', WITHOUT_PLANES, ids=lambda one: one.name)
def test_every_variant_is_another_matcher_than_the_default(variant):
    default, other = (matched(stages, 3, **changes)[0].algorithm.population
                      for stages, changes in ((None, {}), (variant.stages, variant.changes)))
    assert (default.genes[0] != other.genes[0]).any()


def test_the_correlation_is_one_where_fitter_is_better_and_minus_one_where_it_is_worse():
    better = pd.DataFrame({'fitness': np.arange(8.0), 'error': 10 - np.arange(8.0)**2})
    assert spearman(better) == pytest.approx(1)
    assert spearman(better.assign(error=-better.error)) == pytest.approx(-1)
    assert np.isnan(spearman(better[:3]))
    assert np.isnan(spearman(better.assign(fitness=1.0)))
