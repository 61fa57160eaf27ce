# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile quality from outside: bits, kinds of images, references, history, deadline."""
from dataclasses import replace

from fuzzy_stereo_ros.evaluation import score
from fuzzy_stereo_ros.made_scenes import made_pair
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
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


def test_the_history_has_a_row_a_generation_and_its_best_never_falls():
    history = matched(scene(), generations=6).history
    assert len(history) == 6
    fitness = [row.best_fitness for row in history]
    assert fitness == sorted(fitness) and 0 < fitness[-1] < 1
    assert all(row.mean_fitness <= row.best_fitness for row in history)
    assert [list(row.gains) for row in history] == [
        ['leaning'], ['leaning_where_weak'], ['independent'], ['cold'], ['leaning'],
        ['leaning_where_weak']]


def test_without_generations_it_is_the_realtime_map_smoothed():
    pair = scene()
    realtime = matched(pair, MatcherConfig(disparities=24, threads=1, fill=True))
    close = abs(matched(pair, generations=0).disparity - realtime.disparity) <= 1.0
    assert close.mean() > 0.99


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
    refused = np.isnan(sparse.disparity)
    assert 0 < refused.mean() < 0.5
    np.testing.assert_array_equal(dense.confidence[refused], 0)
    np.testing.assert_array_equal(dense.disparity[~refused], sparse.disparity[~refused])
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
    assert [len(population) for population in seen] == [2, 3, 3, 3]
    assert all(population.dtype.kind == 'i' and population.max() < 24 for population in seen)
