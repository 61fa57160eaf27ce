# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Warm has no bias."""
from bench.datasets import MADE, MADE_SEEDS
from bench.draws import with_draw
from bench.layers import BACKGROUND, make_layers
from bench.request import Request
from bench.scoring import ScoredPair
import numpy as np
import pytest

OUTLIER = 2.0       # px from which an error is no bias


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
