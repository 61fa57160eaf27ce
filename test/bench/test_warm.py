# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Warm is better than cold on streets, and has no bias."""
from bench import warm
from bench.datasets import available_sequences
from bench.request import Request
from made_scenes import small_scene
import numpy as np
import pytest


@pytest.mark.slow
def test_warm_is_better_than_cold_on_a_street_of_pictures():
    pytest.importorskip('skimage', reason='the pictures are those of scikit-image')
    street, = (one for one in available_sequences(None, [small_scene()])[0]
               if (one.group, one.name) == ('made, pictured street, noise 3', 'seed 2'))
    found, = warm.measure(Request().ours, street, 0)
    assert found['warm'] < 0.98 * found['cold'], found


@pytest.mark.slow
@pytest.mark.parametrize('kind', ['contrast 8, 0.02 px a frame', 'contrast 5, 0.05 px a frame'])
def test_what_comes_nearer_slowly_in_little_contrast_has_no_bias(kind):
    found = [row['warm'] for one in warm.slow_ones(False) if one.group == kind
             for row in warm.approach(Request().ours, one, 0)]
    assert len(found) == len(warm.MADE_SEEDS)
    assert abs(np.mean(found)) < 0.15
