# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Generations from frame to frame: what a sequence inherits, and what it does not."""

from bench.draws import with_noise
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from made_scenes import wrong
import numpy as np
import pytest

CONFIG = MatcherConfig(disparities=32, threads=1, fill=True)
FRAMES = 12


def faint(image):
    """Return an image of little contrast, whose surfaces are regions of like grey."""
    return (112 + image // 8).astype(np.uint8)


def still(config, frames=FRAMES, noise=0.5, seed=3, stages=None):
    """Return the matches of a faint scene that stands still under fresh noise, and the matcher."""
    made = make_pair(160, 240, 32, seed, objects=4, colour=True)
    made = made._replace(left=faint(made.left), right=faint(made.right))
    random, matcher = np.random.default_rng(0), StereoMatcher(config, stages)
    return [matcher.match(*(with_noise(image, noise, random) for image in (made.left, made.right)))
            for _ in range(frames)], matcher, made


@pytest.mark.parametrize('noise', [0, 0.5])
def test_a_scene_that_stands_still_gets_better_and_never_worse_than_cold(noise):
    matches, _, made = still(CONFIG, noise=noise)
    bad = [wrong(match, made) for match in matches]
    assert bad[-1] <= bad[0] + 0.1
    assert noise == 0 or bad[-1] < bad[0]


def test_a_frame_of_another_scene_inherits_nothing():
    matcher = still(CONFIG)[1]
    other = make_pair(160, 240, 32, 9, objects=4, colour=True)
    match = matcher.match(other.left, other.right)
    cold = StereoMatcher(CONFIG).match(other.left, other.right)
    np.testing.assert_array_equal(match.disparity, cold.disparity)
