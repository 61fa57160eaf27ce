# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile quality from outside: bits, kinds of images, references, history, deadline."""
from dataclasses import replace

from bench.truth import evolved_from
from bench.variants import NoEvidence
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.crossover import Regions
from fuzzy_stereo_ros.matching.quality.matcher import Stages
from fuzzy_stereo_ros.matching.quality.operators import OPERATORS
from made_scenes import matched, scene, wrong
import numpy as np

CONFIG = MatcherConfig.from_profile('quality', disparities=24, threads=1, fill=True)


def test_a_made_scene_is_found():
    for seed in range(3):
        pair = scene(90, 140, seed)
        assert wrong(matched(pair, CONFIG), pair) < 5


def test_the_history_has_a_row_a_generation_and_crossovers_lose_nothing():
    history = matched(scene(), CONFIG, generations=6).history
    assert len(history) == 6
    for row in history:
        assert list(row.gains) == list(OPERATORS)
        assert 0 < row.best_fitness < 1 and row.mean_fitness <= row.best_fitness
        assert all(gain >= 0 for name, gain in row.gains.items() if name != 'trust')


def test_generations_make_the_planes_fitter():
    matcher, pair = StereoMatcher(replace(CONFIG, generations=1)), scene()
    first = matcher.match(pair.left, pair.right).history[0]
    assert sum(gain for name, gain in first.gains.items() if name != 'trust') > 0.006


def test_evolution_may_go_on_from_the_truth():
    matcher, pair = StereoMatcher(CONFIG), scene(90, 140, 1)
    matcher.match(pair.left, pair.right)
    result = matcher.algorithm.population.views[0].disparities
    ends = [evolved_from(pair.truth, matcher, number) for number in (0, 2)]
    assert np.abs(ends[0] - pair.truth).mean() < 0.2
    errors = [np.mean(abs(end - pair.truth)[pair.visible] > 1) for end in (*ends, result)]
    assert errors[0] <= errors[1] <= errors[2]
    assert (ends[0] != ends[1]).any()


def test_stages_can_be_exchanged():
    pair = scene()
    usual = matched(pair, CONFIG)
    for stages in (Stages(evidence=NoEvidence), Stages(operators={}),
                   Stages(crossover=lambda rows, columns, _: Regions(rows, columns))):
        found = StereoMatcher(CONFIG, stages).match(pair.left, pair.right)
        assert wrong(found, pair) < 8
        assert (found.disparity != usual.disparity).any()


def test_a_uniform_pair_is_rejected_and_noise_is_not_sure():
    uniform = np.full((60, 100, 3), 90, np.uint8)
    noise = np.random.default_rng(0).integers(0, 255, (2, 60, 100, 3)).astype(np.uint8)
    config = replace(CONFIG, fill=False)
    nothing = StereoMatcher(config).match(uniform, uniform)
    assert np.isnan(nothing.disparity).all() and (nothing.confidence == 0).all()
    unlike = StereoMatcher(config).match(*noise)
    assert np.isnan(unlike.disparity).mean() > 0.9 and unlike.confidence.max() < 0.4


def test_past_the_deadline_the_map_of_realtime_is_the_result():
    pair = scene(90, 140)
    for fill in (False, True):
        found = matched(pair, CONFIG, deadline_ms=1e-3, fill=fill)
        expected = matched(pair, MatcherConfig.from_profile(
            'realtime', disparities=24, threads=1, fill=True, warm_start=False,
            align_rows=CONFIG.align_rows))
        sure = expected.confidence > 0
        assert sure.mean() > 0.5 and found.generations == 0
        np.testing.assert_array_equal(found.disparity[sure], expected.disparity[sure])
        np.testing.assert_array_equal(found.confidence, expected.confidence)
        assert np.isfinite(found.disparity[~sure]).all() == fill


def test_an_observer_sees_the_map_as_labels():
    seen = []
    pair = scene()
    StereoMatcher(CONFIG).match(pair.left, pair.right, None,
                                lambda _, population: seen.append(population.copy()))
    assert [len(population) for population in seen] == [1, 1, 1, 1]
    assert all(population.dtype.kind == 'i' and population.max() < 24 for population in seen)
