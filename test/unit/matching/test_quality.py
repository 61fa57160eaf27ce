# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile quality from outside: bits, kinds of images, references, history, deadline."""
from dataclasses import replace

from fuzzy_stereo_ros.benchmarks.variants import trust_everything
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.crossover import Regions
from fuzzy_stereo_ros.matching.evolution import Budget, Random
from fuzzy_stereo_ros.matching.quality.matcher import Stages
from fuzzy_stereo_ros.matching.quality.operators import NoEvidence, OPERATORS
from fuzzy_stereo_ros.synthetic.scenes import made_pair
import numpy as np
import pytest

CONFIG = MatcherConfig.from_profile('quality', disparities=24, threads=1, fill=True)


def scene(rows=60, columns=100, seed=0, **options):
    return made_pair(rows, columns, 24, seed, **{'noise': 2.0, **options})


def matched(pair, config=CONFIG, **changes):
    return StereoMatcher(replace(config, **changes)).match(pair.left, pair.right)


def wrong(match, pair):
    """Return the percent of the visible pixels that are off by more than one pixel."""
    return score(match.disparity, pair.truth, pair.visible).bad_dense[1.0]


def test_the_same_pair_gives_the_same_bits_whatever_the_number_of_threads():
    pair = scene(150)
    first, *others = (matched(pair, threads=threads) for threads in (1, 1, 2))
    for other in others:
        np.testing.assert_array_equal(first.disparity, other.disparity)
        np.testing.assert_array_equal(first.confidence, other.confidence)
        assert [(row.best_fitness, row.mean_fitness, row.gains) for row in first.history] == [
            (row.best_fitness, row.mean_fitness, row.gains) for row in other.history]


def test_what_was_matched_before_leaves_no_trace():
    matcher, pair, other = StereoMatcher(CONFIG), scene(), scene(seed=4)
    matcher.match(other.left, other.right)
    np.testing.assert_array_equal(matcher.match(pair.left, pair.right).disparity,
                                  matched(pair).disparity)


def test_a_made_scene_is_found():
    for seed in range(3):
        pair = scene(90, 140, seed)
        assert wrong(matched(pair), pair) < 5


def test_the_history_has_a_row_a_generation_and_crossovers_lose_nothing():
    history = matched(scene(), generations=6, population=2).history
    assert len(history) == 6
    for row in history:
        assert list(row.gains) == list(OPERATORS)
        assert 0 < row.best_fitness < 1 and row.mean_fitness <= row.best_fitness
        assert all(gain >= 0 for name, gain in row.gains.items() if name != 'trust')


def test_generations_make_the_planes_fitter():
    matcher, pair = StereoMatcher(replace(CONFIG, generations=1)), scene()
    first = matcher.match(pair.left, pair.right).history[0]
    assert sum(gain for name, gain in first.gains.items() if name != 'trust') > 0.007


def test_evolution_may_go_on_from_the_truth():
    matcher, pair = StereoMatcher(CONFIG), scene(90, 140, 1)
    matcher.match(pair.left, pair.right)
    result = matcher.algorithm.fittest()
    ends = [matcher.algorithm.evolved_from(pair.truth, Random((5,)), Budget(number, 0, 0))
            for number in (0, 2)]
    assert np.abs(ends[0] - pair.truth).mean() < 0.2
    errors = [np.mean(abs(end - pair.truth)[pair.visible] > 1) for end in (*ends, result)]
    assert errors[0] <= errors[1] <= errors[2]
    assert (ends[0] != ends[1]).any()


def test_disparity_and_confidence_are_of_32_bits():
    match = matched(scene())
    assert match.disparity.dtype == match.confidence.dtype == np.float32


def test_the_seed_of_numbers_changes_the_planes():
    pair = scene()
    assert (matched(pair).disparity != matched(pair, seed=1).disparity).any()


def test_one_chromosome_and_many_evolve():
    pair = scene()
    assert wrong(matched(pair, population=2), pair) < 8
    assert wrong(matched(pair, population=4), pair) < 8


def test_without_generations_it_is_the_seed():
    pair = scene()
    seed = matched(pair, generations=0)
    assert seed.generations == 0 and wrong(seed, pair) < 8


def test_stages_can_be_exchanged():
    pair = scene()
    for stages in (Stages(flat=True), Stages(evidence=NoEvidence), Stages(operators={}),
                   Stages(trusted=trust_everything),
                   Stages(crossover=lambda rows, columns, _: Regions(rows, columns))):
        found = StereoMatcher(CONFIG, stages).match(pair.left, pair.right)
        assert wrong(found, pair) < 8
        assert (found.disparity != matched(pair).disparity).any()


def test_a_uniform_pair_is_rejected_and_noise_is_not_sure():
    uniform = np.full((60, 100, 3), 90, np.uint8)
    noise = np.random.default_rng(0).integers(0, 255, (2, 60, 100, 3)).astype(np.uint8)
    config = replace(CONFIG, fill=False)
    nothing = StereoMatcher(config).match(uniform, uniform)
    assert np.isnan(nothing.disparity).all() and (nothing.confidence == 0).all()
    unlike = StereoMatcher(config).match(*noise)
    assert np.isnan(unlike.disparity).mean() > 0.9 and unlike.confidence.max() < 0.4


def test_no_generation_starts_after_the_deadline():
    assert matched(scene(), deadline_ms=0.01).generations == 0


@pytest.mark.parametrize('shift', [-5, 0, 4])
def test_the_smallest_disparity_may_be_anything(shift):
    wide = scene(50, 160).left
    left, right = wide[:, 30:130], wide[:, 30 + shift:130 + shift]
    found = StereoMatcher(replace(CONFIG, disparities=16, min_disparity=-8)).match(left, right)
    assert np.median(abs(found.disparity - shift)) < 0.1
    assert found.disparity.min() >= -8 and found.disparity.max() <= 7


def test_the_right_reference_is_the_left_one_of_the_mirrored_and_exchanged_pair():
    pair = scene()
    mirrored = pair._replace(left=pair.right[:, ::-1], right=pair.left[:, ::-1])
    np.testing.assert_array_equal(matched(pair, reference='right').disparity,
                                  matched(mirrored).disparity[:, ::-1])


@pytest.mark.parametrize('kind', ['grey', 'sixteen bits', 'grey of sixteen bits'])
def test_grey_and_sixteen_bits_are_matched_as_well(kind):
    pair = scene(60, 120)
    left, right = pair.left, pair.right
    if 'grey' in kind:
        left, right = (image if image.ndim == 2 else image.mean(axis=2).astype(np.uint8)
                       for image in (left, right))
    if 'sixteen' in kind:
        left, right = (image.astype(np.uint16) * 16 for image in (left, right))
    assert wrong(StereoMatcher(CONFIG).match(left, right), pair) < 8


@pytest.mark.parametrize('shape', [(2, 2), (2, 40), (40, 2), (5, 33), (31, 17)])
@pytest.mark.parametrize('disparities', [1, 2])
def test_any_size_is_matched(shape, disparities):
    image = np.random.default_rng(3).integers(0, 255, (*shape, 3)).astype(np.uint8)
    found = StereoMatcher(replace(CONFIG, disparities=disparities)).match(image, image)
    assert found.disparity.shape == shape
    assert np.isfinite(found.disparity).all()
    assert found.disparity.min() >= 0 and found.disparity.max() <= disparities - 1


def test_what_is_refused_is_invalid_or_filled_without_confidence():
    pair = scene()
    dense, sparse = matched(pair), matched(pair, fill=False)
    rejected = np.isnan(sparse.disparity)
    assert 0 < rejected.mean() < 0.5
    np.testing.assert_array_equal(dense.confidence[rejected], 0)
    np.testing.assert_array_equal(dense.disparity[~rejected], sparse.disparity[~rejected])
    assert (dense.confidence >= 0).all() and (dense.confidence <= 1).all()


def test_confidence_tells_right_from_wrong():
    pair = scene(90, 140, noise=6.0)
    match = matched(pair)
    error = abs(match.disparity - pair.truth) > 1
    seen = pair.visible & np.isfinite(pair.truth)
    assert match.confidence[seen & error].mean() < match.confidence[seen & ~error].mean()


def test_pixels_below_the_threshold_of_confidence_are_invalid():
    match = matched(scene(), fill=False, confidence_threshold=0.5)
    known = np.isfinite(match.disparity)
    assert known.any() and (match.confidence[known] >= 0.5).all()


def test_an_observer_sees_the_members_as_labels():
    seen = []
    pair = scene()
    StereoMatcher(CONFIG).match(pair.left, pair.right, None,
                                lambda _, population: seen.append(population.copy()))
    assert [len(population) for population in seen] == [1, 1, 1, 1]
    assert all(population.dtype.kind == 'i' and population.max() < 24 for population in seen)
