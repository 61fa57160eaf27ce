# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public face of the matcher in the profile realtime."""
from dataclasses import replace
import gc
import weakref

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.evolution import Random
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
from fuzzy_stereo_ros.synthetic.scenes import made_pair, made_sequence
import numpy as np
import pytest

SECOND = 1_000_000_000
CONFIG = MatcherConfig(disparities=24, threads=1)
PAPER = replace(CONFIG, algorithm='paper', population=4, generations=3)


def scene(rows=60, columns=100, seed=0, **options):
    return made_pair(rows, columns, 24, seed, **{'noise': 2.0, **options})


def matched(pair, config=CONFIG, **changes):
    """Match one pair cold with a matcher of its own."""
    return StereoMatcher(replace(config, **changes)).match(pair.left, pair.right)


def assert_same(one, two):
    """Assert that two matches are equal to the last bit, and so is how they came about."""
    np.testing.assert_array_equal(one.disparity, two.disparity)
    np.testing.assert_array_equal(one.confidence, two.confidence)
    assert one.warm == two.warm
    assert [(row.best_fitness, row.mean_fitness, row.diversity, row.gains)
            for row in one.history] == [
        (row.best_fitness, row.mean_fitness, row.diversity, row.gains) for row in two.history]


def wrong(match, pair):
    """Return the percent of the visible pixels that are off by more than one pixel."""
    return score(match.disparity, pair.truth, pair.visible).bad_dense[1.0]


# ---- memory ----


@pytest.mark.parametrize('profile', ALGORITHMS)
def test_a_matcher_that_nobody_holds_gives_its_memory_back_at_once(profile):
    pair = scene(40, 60)
    matcher = StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=24, threads=1, population=2, generations=1))
    matcher.match(pair.left, pair.right)
    gc.collect()
    gc.disable()
    try:
        algorithm = weakref.ref(matcher.algorithm)
        del matcher
        assert algorithm() is None
    finally:
        gc.enable()


# ---- equal input, equal output ----


def test_the_same_frames_give_the_same_bits_whatever_the_number_of_threads():
    frames = list(made_sequence(645, 90, 24, 3, noise=3.0, pan=2.0))
    matchers = [StereoMatcher(replace(CONFIG, threads=threads)) for threads in (1, 1, 2, 3)]
    for frame in frames:
        first, *others = (matcher.match(frame.left, frame.right) for matcher in matchers)
        for other in others:
            assert_same(first, other)
    for matcher in matchers[1:]:
        for name in ('labels', 'validity', 'pictures', 'ages'):
            np.testing.assert_array_equal(
                getattr(matcher.state, name), getattr(matchers[0].state, name))


def populations(pair, stamp=None, **changes):
    """Return copies of the populations after each generation of the paper's algorithm."""
    matcher, seen = StereoMatcher(replace(PAPER, **changes)), []
    matcher.match(pair.left, pair.right, stamp,
                  lambda _, population: seen.append(population.copy()))
    return seen


@pytest.mark.parametrize('one, two', [
    ({'seed': 0}, {'seed': 1}), ({'stamp': 5}, {'stamp': 6}), ({'stamp': None}, {'stamp': 5})])
def test_chance_comes_from_the_seed_and_the_stamp(one, two):
    pair = scene()
    first, again, other = populations(pair, **one), populations(pair, **one), populations(
        pair, **two)
    assert len(first) == len(again) == 3
    for population, same in zip(first, again):
        np.testing.assert_array_equal(population, same)
    assert not any(np.array_equal(one, two) for one, two in zip(first, other))


def test_without_stamps_the_number_of_the_frame_is_part_of_chance(monkeypatch):
    sources = []

    class Noting(RealtimeMatcher):
        def match(self, left, right, previous, random, *others):
            sources.append(random)
            return super().match(left, right, previous, random, *others)

    monkeypatch.setitem(ALGORITHMS, 'realtime', Noting)
    pair, matcher = scene(), StereoMatcher(replace(CONFIG, seed=3))
    for stamp in (None, None, 10, 2000, None):
        matcher.match(pair.left, pair.right, stamp)
    matcher.restore(replace(matcher.state, frame=6))
    matcher.match(pair.left, pair.right)
    assert sources == [Random((3, word)) for word in (0, 1, 10, 2000, 0, 7)]


def test_another_size_in_between_changes_nothing():
    small, large = scene(), scene(80, 120)
    matcher = StereoMatcher(replace(CONFIG, warm_start=False))
    first = matcher.match(small.left, small.right)
    matcher.match(large.left, large.right)
    assert_same(first, matcher.match(small.left, small.right))


def test_what_was_matched_before_leaves_no_trace_without_warm_start():
    matcher, pair = StereoMatcher(replace(CONFIG, warm_start=False)), scene()
    for seed in range(1, 4):
        other = scene(seed=seed)
        matcher.match(other.left, other.right)
    assert_same(matcher.match(pair.left, pair.right), matched(pair))


# ---- kinds of images ----


def test_the_right_reference_is_the_left_one_of_the_mirrored_and_exchanged_pair():
    pair = scene()
    mirrored = pair._replace(left=pair.right[:, ::-1], right=pair.left[:, ::-1])
    right, left = matched(pair, reference='right'), matched(mirrored)
    np.testing.assert_array_equal(right.disparity, left.disparity[:, ::-1])
    np.testing.assert_array_equal(right.confidence, left.confidence[:, ::-1])


@pytest.mark.parametrize('reference', ['left', 'right'])
@pytest.mark.parametrize('shift', [-9, 0, 6])
def test_a_shifted_image_has_that_disparity_from_either_reference(shift, reference):
    """A point at column c of the right image is at c + d of the left one."""
    wide = scene(50, 160).left
    left, right = wide[:, 30:130], wide[:, 30 + shift:130 + shift]
    match = StereoMatcher(replace(CONFIG, reference=reference, min_disparity=-12)).match(
        left, right)
    inside = match.disparity[3:-3, 25:-25]
    assert np.mean(np.abs(inside - shift) <= 0.25) > 0.97


def columns_in_view(shift):
    """Return which of 100 columns point inside the target image, and which do not."""
    pointed = np.arange(100) - shift
    inside = (pointed >= 0) & (pointed < 100)
    return inside, ~inside


def shifted_by(shift, min_disparity):
    """Match two windows of one image, of true disparity `shift` everywhere."""
    wide = scene(50, 160).left
    return StereoMatcher(replace(CONFIG, disparities=24, min_disparity=min_disparity)).match(
        wide[:, 30:130], wide[:, 30 + shift:130 + shift])


@pytest.mark.parametrize('shift, min_disparity', [
    (9, 0), (9, 4), (-9, -20), (-9, -9), (-9, -32), (-30, -35), (2, -3)])
def test_what_both_images_show_is_found_up_to_the_border(shift, min_disparity):
    match = shifted_by(shift, min_disparity)
    inside, _ = columns_in_view(shift)
    assert np.mean(abs(match.disparity[:, inside] - shift) < 0.5) > 0.97


@pytest.mark.parametrize('shift, min_disparity', [
    (9, 0), (9, 4), (-9, -20), (-9, -9), (-9, -32), (-30, -35), (2, -3)])
def test_what_points_beyond_the_other_image_is_invalid(shift, min_disparity):
    match = shifted_by(shift, min_disparity)
    _, outside = columns_in_view(shift)
    assert np.mean(np.isnan(match.disparity[:, outside])) > 0.9


@pytest.mark.parametrize('min_disparity', [-2048, -200, -123, 100, 2048])
@pytest.mark.parametrize('reference', ['left', 'right'])
def test_where_no_disparity_meets_the_other_image_all_is_invalid(min_disparity, reference):
    pair = scene()
    matcher = StereoMatcher(replace(CONFIG, min_disparity=min_disparity, reference=reference))
    for _ in range(2):
        match = matcher.match(pair.left, pair.right)
        assert np.all(np.isnan(match.disparity))
        assert not match.confidence.any()


@pytest.mark.parametrize('channels', [0, 3])
@pytest.mark.parametrize('rows, columns, disparities, min_disparity', [
    (2, 2, 1, -1), (2, 2, 2, -2048), (3, 5, 5, -3), (2, 70, 33, -20), (17, 63, 63, -64),
    (129, 31, 9, -20), (40, 31, 9, -200), (9, 310, 300, -150)])
def test_every_size_and_smallest_disparity_below_0_gives_a_dense_map_when_filled(
        rows, columns, disparities, min_disparity, channels):
    pair = made_pair(rows, columns, disparities, noise=2.0, min_disparity=min_disparity,
                     colour=channels > 0)
    matcher = StereoMatcher(replace(CONFIG, disparities=disparities, fill=True,
                                    min_disparity=min_disparity))
    for _ in range(2):
        match = matcher.match(pair.left, pair.right)
        assert match.disparity.min() >= min_disparity
        assert match.disparity.max() <= min_disparity + disparities - 1
    assert match.warm


def test_pictures_are_averaged_alike_whatever_the_smallest_disparity_up_to_0():
    frames = list(made_sequence(60, 100, 24, 3, noise=3.0))
    states = []
    for min_disparity in (0, -1, -20, -200):
        matcher = StereoMatcher(replace(CONFIG, min_disparity=min_disparity))
        for frame in frames:
            matcher.match(frame.left, frame.right)
        states.append(matcher.state)
    for state in states[1:]:
        np.testing.assert_array_equal(state.pictures, states[0].pictures)
        np.testing.assert_array_equal(state.ages, states[0].ages)


@pytest.mark.parametrize('places', [0, 4, 8])
@pytest.mark.parametrize('colour', [False, True])
def test_an_image_of_more_bits_is_matched_as_the_same_one_of_8(places, colour):
    pair = scene(colour=colour)
    pair.left[0, 0] = 255
    deep = pair._replace(left=pair.left.astype(np.uint16) << places,
                         right=pair.right.astype(np.uint16) << places)
    assert_same(matched(pair), matched(deep))


@pytest.mark.parametrize('channels', [(1, 1), (3, 3), (0, 3), (3, 0), (1, 3)])
def test_grey_in_colour_is_matched_as_grey(channels):
    pair = scene()
    left, right = (np.repeat(image[..., None], count, axis=2) if count else image
                   for image, count in zip(pair[:2], channels))
    assert_same(matched(pair), matched(pair._replace(left=left, right=right)))


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_colour_beside_grey_is_weighed_to_grey(dtype):
    """Green counts twice; halves are rounded up."""
    pair = scene(colour=True)
    colour, other = pair.left.astype(dtype), pair.right[..., 1].astype(dtype)
    blue, green, red = np.moveaxis(colour.astype(int), 2, 0)
    grey = ((blue + 2 * green + red + 2) // 4).astype(dtype)
    assert_same(matched(pair._replace(left=colour, right=other)),
                matched(pair._replace(left=grey, right=other)))
    assert_same(matched(pair._replace(left=other, right=colour)),
                matched(pair._replace(left=other, right=grey)))


def test_strided_and_read_only_images_are_matched_as_any_and_stay_as_they_are():
    pair = scene()
    wide = np.repeat(pair.left, 2, axis=1)
    strided = pair._replace(left=wide[:, ::2], right=np.asfortranarray(pair.right))
    left, right = pair.left.copy(), pair.right.copy()
    left.flags.writeable = right.flags.writeable = False
    expected = matched(pair)
    assert_same(expected, matched(strided))
    assert_same(expected, matched(pair._replace(left=left, right=right)))
    np.testing.assert_array_equal(left, pair.left)


@pytest.mark.parametrize('rows, columns, disparities', [
    (2, 2, 1), (2, 2, 2), (2, 70, 33), (70, 2, 2), (3, 5, 5), (17, 63, 63), (129, 31, 9)])
def test_every_size_gives_a_disparity_everywhere_when_filled(rows, columns, disparities):
    pair = made_pair(rows, columns, disparities, noise=2.0)
    matcher = StereoMatcher(replace(CONFIG, disparities=disparities, fill=True))
    for _ in range(2):
        match = matcher.match(pair.left, pair.right)
        assert match.disparity.shape == match.confidence.shape == (rows, columns)
        assert match.disparity.min() >= 0
        assert match.disparity.max() <= disparities - 1
    assert match.warm


def test_more_than_256_disparities_are_told_apart():
    """The target's labels are known modulo 256: 280 and 24 must not be taken for each other."""
    texture = np.random.default_rng(0).integers(0, 256, (30, 400)).astype(np.uint8)
    texture = texture.repeat(2, axis=0).repeat(2, axis=1)
    left, right = texture[:, :420], texture[:, 280:700].copy()
    right[:30] = texture[:30, 24:444]
    matcher = StereoMatcher(replace(CONFIG, disparities=300))
    for _ in range(2):
        match = matcher.match(left, right)
        assert np.mean(abs(match.disparity[3:27, 40:] - 24) < 0.5) > 0.98
        assert np.mean(abs(match.disparity[33:57, 300:] - 280) < 0.5) > 0.98
        assert np.mean(np.isnan(match.disparity[33:57, :250])) > 0.95
    assert match.warm


# ---- what comes out ----


def test_what_cannot_be_seen_is_invalid_and_has_confidence_0():
    pair = scene()
    match = matched(pair)
    invalid = np.isnan(match.disparity)
    assert 0 < invalid.mean() < 0.5
    assert not match.confidence[invalid].any()
    hidden = ~pair.visible
    assert invalid[hidden].mean() > 4 * invalid[~hidden].mean()


def test_a_fill_is_dense_keeps_the_rest_and_has_confidence_0():
    pair = scene()
    sparse, dense = matched(pair), matched(pair, fill=True)
    invalid = np.isnan(sparse.disparity)
    assert np.all(np.isfinite(dense.disparity))
    np.testing.assert_array_equal(dense.disparity[~invalid], sparse.disparity[~invalid])
    np.testing.assert_array_equal(dense.confidence, sparse.confidence)


@pytest.mark.parametrize('options', [{}, {'noise': 25.0}, {'contrast': 0.05}])
@pytest.mark.parametrize('fill', [False, True])
def test_confidence_is_from_0_to_1_and_never_nan(fill, options):
    match = matched(scene(**options), fill=fill)
    assert match.confidence.dtype == match.disparity.dtype == np.float32
    assert match.confidence.min() >= 0
    assert match.confidence.max() <= 1


def test_the_sure_are_right_more_often():
    pair = scene(200, 300, noise=10.0)
    match = matched(pair, fill=True)
    bad = ~(abs(match.disparity - pair.truth) <= 1)
    order = np.argsort(-match.confidence, axis=None)
    shares = [bad.ravel()[part].mean() for part in np.array_split(order, 3)]
    assert shares[0] <= shares[1] / 2 < shares[2] / 4


def test_a_threshold_makes_what_is_less_sure_invalid():
    pair = scene()
    every, sure = matched(pair), matched(pair, confidence_threshold=0.3)
    np.testing.assert_array_equal(
        np.isnan(sure.disparity), np.isnan(every.disparity) | (every.confidence < 0.3))


def test_uniform_images_end_in_no_confidence_at_all():
    grey = np.full((40, 60), 128, np.uint8)
    match = StereoMatcher(replace(CONFIG, fill=True)).match(grey, grey)
    assert np.all(np.isfinite(match.disparity))
    assert match.confidence.max() < 0.1


@pytest.mark.parametrize('kind', [np.uint8, np.uint16])
@pytest.mark.parametrize('grey', [0, 128, 255])
def test_a_covered_camera_sees_nothing_at_any_distance(grey, kind):
    blank = np.full((40, 60), grey, kind)
    assert np.all(np.isnan(StereoMatcher(CONFIG).match(blank, blank).disparity))


@pytest.mark.parametrize('options, limit', [
    ({}, 2.5), ({'seed': 1}, 2.5), ({'seed': 2}, 2.5), ({'min_disparity': -12}, 2.5),
    ({'min_disparity': -40}, 2.5), ({'min_disparity': 9}, 2.5), ({'colour': True}, 2.5),
    ({'bits': 12}, 2.5), ({'exposure': 1.3}, 2.5), ({'noise': 8.0}, 4)])
def test_a_made_scene_is_found_but_for_few_pixels(options, limit):
    pair = made_pair(160, 240, 24, **options)
    match = matched(pair, min_disparity=options.get('min_disparity', 0), fill=True)
    assert wrong(match, pair) < limit


def test_disparities_are_finer_than_a_pixel():
    pair = made_pair(160, 240, 24)
    match = matched(pair)
    error = abs(match.disparity - pair.truth)[pair.visible & np.isfinite(match.disparity)]
    whole = abs(np.rint(match.disparity) - pair.truth)[
        pair.visible & np.isfinite(match.disparity)]
    assert np.median(error) < 0.1
    assert np.median(error) < np.median(whole) / 2


# ---- the course of a match ----


@pytest.mark.parametrize('config, generations', [(CONFIG, 1), (PAPER, 4)])
def test_history_has_a_row_a_generation_and_the_best_never_gets_worse(config, generations):
    """In the profile realtime the first generation has crossed all that there is."""
    match = matched(scene(), config, generations=4)
    assert match.generations == len(match.history) == generations
    assert [row.number for row in match.history] == [*range(1, generations + 1)]
    best = [row.best_fitness for row in match.history]
    assert best == sorted(best)
    for before, row in zip(best, match.history[1:]):
        assert row.best_fitness == pytest.approx(before + sum(row.gains.values()))
    for row in match.history:
        assert row.mean_fitness <= row.best_fitness
        assert 0 <= row.diversity <= 1
        assert row.milliseconds >= 0
        assert all(gain >= 0 for gain in row.gains.values())
    if config is CONFIG:
        assert best[-1] <= 1
        assert set(match.history[0].gains) == {'crossover', 'planes'}


@pytest.mark.parametrize('population', [1, 2, 5])
def test_the_observer_sees_every_generation_s_population(population):
    pair, matcher = scene(), StereoMatcher(replace(CONFIG, population=population))
    for warm in (False, True):
        seen = []
        match = matcher.match(pair.left, pair.right, None,
                              lambda *told, seen=seen: seen.append(told))
        assert match.warm == warm
        # the chromosome of planes, which evolves from the second frame on, is not shown
        assert [number for number, _ in seen] == [row.number for row in match.history[:1]]
        assert len(match.history) == 1 + warm
        members = [chromosomes for _, chromosomes in seen]
        assert all(chromosomes.shape[1:] == (60, 100) for chromosomes in members)
        assert all(chromosomes.dtype == np.uint8 for chromosomes in members)
        assert [len(chromosomes) for chromosomes in members] == [min(population, 2)]


@pytest.mark.parametrize('config', [CONFIG, PAPER])
def test_one_chromosome_is_a_population_too(config):
    match = matched(scene(), config, population=1)
    assert match.generations > 0
    for row in match.history:
        assert row.mean_fitness == row.best_fitness
        assert row.diversity == 0
    if config is CONFIG:
        assert match.history[0].gains['crossover'] == 0


def test_times_are_told_by_stage_and_sum_up_to_the_total():
    match = matched(scene())
    stages = dict(match.times)
    total = stages.pop('total')
    assert {'possibility', 'coarse', 'scanlines', 'seeds', 'generations',
            'refinement'} <= set(stages)
    assert all(milliseconds >= 0 for milliseconds in stages.values())
    assert 0 < sum(stages.values()) <= total


def test_a_deadline_that_has_passed_leaves_the_seed_and_no_generation():
    pair = scene()
    late, none = matched(pair, deadline_ms=1e-6), matched(pair, generations=0)
    assert late.generations == none.generations == 0
    assert_same(late, none)
    assert wrong(matched(pair, deadline_ms=1e-6, fill=True), pair) < 10


@pytest.mark.parametrize('config', [CONFIG, PAPER])
@pytest.mark.parametrize('columns', [100, 20])
def test_warming_up_changes_no_bit(config, columns):
    """Also for images with fewer columns than disparities, which only matching refuses."""
    pair, matcher = scene(), StereoMatcher(config)
    matcher.warm_up(60, columns)
    assert_same(matcher.match(pair.left, pair.right), matched(pair, config))


def test_a_deadline_far_away_changes_nothing():
    pair = scene()
    assert_same(matched(pair), matched(pair, deadline_ms=3600000.0))


@pytest.mark.parametrize(('rows', 'columns'), [(1, 1), (1, 30), (20, 1), (0, 30), (2**16, 2**15)])
def test_warming_up_for_a_size_that_cannot_be_matched_is_refused(rows, columns):
    with pytest.raises(ValueError, match=f'^the images are {columns} x {rows}; at '):
        StereoMatcher(replace(CONFIG, disparities=1)).warm_up(rows, columns)


def test_warming_up_keeps_the_previous_frame():
    frames = list(made_sequence(60, 100, 24, 2, noise=2.0))
    warmed, plain = StereoMatcher(CONFIG), StereoMatcher(CONFIG)
    warmed.warm_up(60, 100)
    assert warmed.state is None
    for frame in frames:
        one = warmed.match(frame.left, frame.right)
        warmed.warm_up(60, 100)
        assert_same(one, plain.match(frame.left, frame.right))


def test_without_a_configuration_the_profile_is_realtime():
    assert StereoMatcher().config == MatcherConfig.from_profile('realtime')


# ---- the previous frame ----


def test_the_next_frame_is_warm_and_the_first_is_not():
    pair, matcher = scene(), StereoMatcher(CONFIG)
    assert matcher.state is None
    assert [matcher.match(pair.left, pair.right).warm for _ in range(3)] == [False, True, True]


@pytest.mark.parametrize('stamps, warm', [
    ((10, 11), True), ((0, SECOND), True), ((0, SECOND + 1), False), ((10, 10), False),
    ((10, 9), False), ((None, 10), False), ((10, None), False), ((None, None), True)])
def test_only_a_frame_shortly_after_the_previous_one_is_warm(stamps, warm):
    pair, matcher = scene(), StereoMatcher(CONFIG)
    assert not matcher.match(pair.left, pair.right, stamps[0]).warm
    second = matcher.match(pair.left, pair.right, stamps[1])
    assert second.warm == warm
    if not warm:
        fresh = StereoMatcher(CONFIG).match(pair.left, pair.right, stamps[1])
        assert_same(second, fresh)


def test_after_a_reset_or_another_size_a_frame_is_cold():
    pair, larger, matcher = scene(), scene(62, 100), StereoMatcher(CONFIG)
    cold = matcher.match(pair.left, pair.right)
    matcher.reset()
    assert_same(cold, matcher.match(pair.left, pair.right))
    assert not matcher.match(larger.left, larger.right).warm
    assert not matcher.match(pair.left, pair.right).warm
    assert matcher.match(pair.left, pair.right).warm


def test_without_warm_start_no_frame_is_warm_and_there_is_no_state():
    pair, matcher = scene(), StereoMatcher(replace(CONFIG, warm_start=False))
    cold, warm_one = matcher.match(pair.left, pair.right), StereoMatcher(CONFIG)
    assert_same(cold, matcher.match(pair.left, pair.right))
    assert matcher.state is None
    warm_one.match(pair.left, pair.right)
    matcher.restore(warm_one.state)
    assert_same(cold, matcher.match(pair.left, pair.right))


def test_consecutive_frames_are_counted():
    pair, matcher, numbers = scene(), StereoMatcher(CONFIG), []
    for _ in range(3):
        matcher.match(pair.left, pair.right)
        numbers.append(matcher.state.frame)
    assert numbers == [0, 1, 2]
    matcher.reset()
    matcher.match(pair.left, pair.right)
    assert matcher.state.frame == 0


@pytest.mark.parametrize('stamped', [False, True])
def test_a_restored_state_gives_the_next_frame_bit_for_bit(stamped):
    frames = list(made_sequence(60, 100, 24, 4, noise=3.0, pan=1.0))
    stamps = [1000 * number if stamped else None for number in range(4)]
    matcher = StereoMatcher(CONFIG)
    for frame, stamp in zip(frames[:3], stamps):
        state = matcher.state
        matcher.match(frame.left, frame.right, stamp)
    other = StereoMatcher(CONFIG)
    other.restore(state)
    assert_same(other.match(frames[2].left, frames[2].right, stamps[2]),
                _next(state, frames[2], stamps[2]))
    expected = matcher.match(frames[3].left, frames[3].right, stamps[3])
    assert_same(expected, other.match(frames[3].left, frames[3].right, stamps[3]))
    assert expected.warm


def _next(state, frame, stamp):
    """Return the match of a matcher that has seen much else."""
    matcher = StereoMatcher(CONFIG)
    for seed in range(3):
        other = scene(seed=seed)
        matcher.match(other.left, other.right)
    matcher.restore(state)
    return matcher.match(frame.left, frame.right, stamp)


def test_a_state_is_not_changed_by_later_frames():
    frames = list(made_sequence(60, 100, 24, 3, noise=3.0, pan=1.0))
    matcher = StereoMatcher(CONFIG)
    matcher.match(frames[0].left, frames[0].right)
    state = matcher.state
    arrays = ('labels', 'validity', 'pictures', 'ages', 'planes', 'evolved', 'work', 'origin')
    copies = [getattr(state, name).copy() for name in arrays]
    for frame in frames[1:]:
        matcher.match(frame.left, frame.right)
    for name, copy in zip(arrays, copies):
        np.testing.assert_array_equal(getattr(state, name), copy)


@pytest.mark.parametrize('changes', [
    {'disparities': 25}, {'min_disparity': 1}, {'reference': 'right'}])
def test_a_state_of_other_disparities_is_not_used(changes):
    pair, matcher = scene(), StereoMatcher(CONFIG)
    matcher.match(pair.left, pair.right)
    other = StereoMatcher(replace(CONFIG, **changes))
    other.restore(matcher.state)
    assert not other.match(pair.left, pair.right).warm


# ---- what is no pair ----

GREY = np.zeros((20, 30), np.uint8)
BAD_PAIRS = {
    'no array': ([[1, 2]], GREY, 'the left image is a list; give a NumPy array of uint8 or '
                                 'uint16'),
    'none': (GREY, None, 'the right image is a NoneType; give a NumPy array of uint8 or uint16'),
    'one axis': (GREY[0], GREY, r'the left image has the shape (30,); allowed are '
                                r'(rows, columns) and (rows, columns, 3)'),
    'four channels': (GREY, np.zeros((20, 30, 4), np.uint8),
                      'the right image has the shape (20, 30, 4); allowed are (rows, columns) '
                      'and (rows, columns, 3)'),
    'float with nan': (np.full((20, 30), np.nan, np.float32), GREY,
                       'the left image is float32; allowed are uint8 and uint16'),
    'signed': (GREY, GREY.astype(np.int16),
               'the right image is int16; allowed are uint8 and uint16'),
    'bool': (GREY > 0, GREY > 0, 'the left image is bool; allowed are uint8 and uint16'),
    'sizes': (GREY, GREY[:, :-1], 'the left image is 30 x 20, the right one 29 x 20; give two '
                                  'rectified images of one size'),
    'depths': (GREY, GREY.astype(np.uint16), 'the left image is uint8, the right one uint16; '
                                             'give two images of one depth'),
    'no rows': (GREY[:0], GREY[:0], 'the images are 30 x 0; at least 2 x 2 pixels are needed'),
    'no columns': (GREY[:, :0], GREY[:, :0],
                   'the images are 0 x 20; at least 2 x 2 pixels are needed'),
    'one row': (GREY[:1], GREY[:1], 'the images are 30 x 1; at least 2 x 2 pixels are needed'),
    'too narrow': (GREY[:, :23], GREY[:, :23],
                   '24 disparities are more than the 23 columns of the images; ask for fewer '
                   'disparities or give larger images'),
}


@pytest.mark.parametrize('left, right, sentence', BAD_PAIRS.values(), ids=BAD_PAIRS)
def test_what_is_no_pair_is_refused_with_a_sentence_and_the_next_pair_is_matched(
        left, right, sentence):
    frames = list(made_sequence(60, 100, 24, 2, noise=2.0))
    matcher, undisturbed = StereoMatcher(CONFIG), StereoMatcher(CONFIG)
    for frame in frames:
        expected = undisturbed.match(frame.left, frame.right)
        assert_same(expected, matcher.match(frame.left, frame.right))
        with pytest.raises(ValueError) as error:
            matcher.match(left, right)
        assert str(error.value) == sentence


def test_as_many_disparities_as_columns_are_allowed():
    match = StereoMatcher(CONFIG).match(GREY[:, :24], GREY[:, :24])
    assert match.disparity.shape == (20, 24)
