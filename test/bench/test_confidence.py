# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a confidence is worth; a costmap gets nearly half of a map, little of it wrong."""
from bench.confidence import heading, kept_and_wrong, PRESETS, WRONG, wrong_and_confidence
from bench.datasets import available_scenes
from fuzzy_stereo_ros.evaluation.matchers import Ours
from made_scenes import small_scene
import numpy as np
import pytest
from repository import ROOT
import yaml

OURS = Ours('ours')
SHARE = 0.45        # that costmap keeps of what mapping keeps, at the least
MOST_WRONG = 2      # percent, by 1 px


@pytest.mark.parametrize('preset', PRESETS)
def test_a_preset_of_config_has_the_threshold_of_the_table(preset):
    content = yaml.safe_load((ROOT / 'config' / f'{preset}.yaml').read_text())
    assert content == {'/**': {'ros__parameters': {'confidence_threshold': PRESETS[preset]}}}


@pytest.mark.parametrize('scenes', [
    available_scenes(None, 'made/')[0],
    [small_scene(seed, size=(240, 320, 48), objects=6, contrast=0.1, noise=2)
     for seed in (1, 2)]], ids=['made scenes', 'faint textures with noise'])
def test_a_costmap_keeps_nearly_half_of_a_map_and_little_is_wrong(scenes):
    """As the presets of mapping and of costmap keep it, on average over scenes."""
    figures = []
    for scene in scenes:
        known = scene.read()
        match = OURS.matcher(scene.disparities).match(known.left, known.right)
        wrong, confidence = wrong_and_confidence(match, known, scene)
        figures.append(kept_and_wrong(confidence, wrong))
    mean = {name: np.mean([of_scene[name] for of_scene in figures]) for name in figures[0]}
    assert mean[heading('costmap')] >= SHARE * mean[heading('mapping')]
    assert mean[heading('costmap', WRONG)] <= MOST_WRONG
