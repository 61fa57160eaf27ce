# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cold is the same rig without the frame before; warm is better on streets, and has no bias."""
from dataclasses import replace
from functools import partial

from bench import warm
from bench.conditions import misaligned
from bench.datasets import available_sequences
from bench.request import Request
from bench.scoring import ScoredSequence
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from made_scenes import known as made_known, small_scene
import numpy as np
import pytest

TILT = 1.5      # px
CORNER = slice(0, 90), slice(30, 120)       # too small to measure the rows in


def test_a_cold_frame_of_the_same_rig_keeps_the_measured_rows():
    whole = made_known(size=(160, 220, 24))
    left = np.full_like(whole.left, 100)
    left[CORNER] = whole.left[CORNER]
    seen = replace(whole, left=left, counts=np.zeros(left.shape, bool))
    seen.counts[30:80, 60:110] = True
    frames = [replace(one, right=misaligned(whole.right, tilt=TILT))
              for one in (whole, whole, whole, seen)]
    alone, after = (
        warm.measure(ScoredSequence('tilted', 'corner', MIDDLEBURY, 24, partial(list, some),
                                    scored=range(len(some) - 1, len(some))), Request())['cold']
        for some in (frames[3:], frames))
    assert alone > 10
    assert after < 6


@pytest.mark.slow
def test_warm_is_better_than_cold_on_a_street_of_pictures():
    pytest.importorskip('skimage', reason='the pictures are those of scikit-image')
    street, = (one for one in available_sequences(None, [small_scene()])[0]
               if (one.group, one.name) == ('made, pictured street, noise 3', 'seed 2'))
    found = warm.measure(street, Request())
    assert found['warm'] < 0.98 * found['cold'], found


@pytest.mark.slow
@pytest.mark.parametrize('contrast, speed', [(8, 0.02), (5, 0.05)])
def test_what_comes_nearer_slowly_in_little_contrast_has_no_bias(contrast, speed):
    found = [warm.approach(warm.Approach(contrast, speed, seed), Request())['warm'].mean()
             for seed in warm.MADE_SEEDS]
    assert abs(np.mean(found)) < 0.15
