# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Warm is better than cold on streets, and has no bias."""
from bench import warm
from bench.datasets import available_sequences, MADE, MADE_SEEDS
from bench.draws import with_draw
from bench.layers import BACKGROUND, make_layers
from bench.request import Request
from bench.scoring import ScoredPair
from made_scenes import small_scene
import numpy as np
import pytest

OUTLIER = 2.0       # px from which an error is no bias


@pytest.mark.slow
def test_warm_is_better_than_cold_on_a_street_of_pictures():
    pytest.importorskip('skimage', reason='the pictures are those of scikit-image')
    street, = (one for one in available_sequences(None, [small_scene()])[0]
               if (one.group, one.name) == ('made, pictured street, noise 3', 'seed 2'))
    found, = warm.measure(Request().ours, street, 0)
    assert found['warm'] < 0.98 * found['cold'], found


@pytest.mark.slow
@pytest.mark.parametrize('contrast, speed', [(8, 0.02), (5, 0.05)])     # grey levels, px a frame
def test_what_comes_nearer_slowly_in_little_contrast_has_no_bias(contrast, speed):
    biases = []
    for seed in MADE_SEEDS:
        matcher = Request().ours.matcher(MADE['disparities'], warm_start=True)
        frames = with_draw([ScoredPair(*made) for made in make_layers(
            MADE['rows'], MADE['columns'], 40, seed, contrast, 1.5, approach=speed)], 2.0, 0)
        for number, made in enumerate(frames):
            off = matcher.match(made.left, made.right).disparity - made.truth
            counts = made.counts & (made.truth > BACKGROUND) & (abs(off) < OUTLIER)
            if number >= 4:
                biases.append(off[counts].mean())
    assert abs(np.mean(biases)) < 0.15
