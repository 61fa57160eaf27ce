# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What holds of every profile: equal bits, kinds of images, either reference, fills."""
from dataclasses import replace
from functools import cache
import gc
import weakref

from bench.conditions import misaligned
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.matching.over_frames.moving_camera import FOLLOWED
from fuzzy_stereo_ros.synthetic.scenes import FOCAL, make_pair, make_sequence
from made_scenes import bits, matched, scene
import numpy as np
import pytest
from reference_refinement import components

SMALL = {'disparities': 24, 'threads': 1}
PAPER = {**SMALL, 'population': 6, 'generations': 3, 'reference': 'left'}
CONFIGS = {
    'realtime': MatcherConfig(**SMALL),
    'fast': MatcherConfig.from_profile('fast', **SMALL),
    'quality': MatcherConfig.from_profile('quality', **SMALL),
    **{f'paper {reading}': MatcherConfig.from_profile('paper', reading=reading, **PAPER)
       for reading in ('literal', 'uniform')},
    'paper from winners': MatcherConfig.from_profile(
        'paper', initial_population='winner_takes_all', **PAPER)}


@pytest.fixture(params=CONFIGS.values(), ids=CONFIGS)
def config(request):
    return request.param


@cache
def usual(config):
    """Return the cold match of the usual scene."""
    return matched(scene(), config)


@pytest.mark.parametrize('profile', ALGORITHMS)
def test_a_deleted_matcher_frees_its_memory_at_once(profile):
    pair = scene()
    matcher = StereoMatcher(MatcherConfig.from_profile(
        profile, **SMALL, population=2, generations=1))
    matcher.match(pair.left, pair.right)
    gc.collect()
    gc.disable()
    try:
        algorithm = weakref.ref(matcher.algorithm)
        del matcher
        assert algorithm() is None
        assert gc.collect() == 0    # no part of it was left in a circle of references
    finally:
        gc.enable()


# ---- equal input, equal output ----


def test_what_was_matched_before_leaves_no_trace_without_warm_start(config):
    """Not what was seen, nor another size in between."""
    matcher, pair = StereoMatcher(replace(config, warm_start=False)), scene()
    for other in (scene(50, 80), scene(seed=1)):
        matcher.match(other.left, other.right)
    assert bits(matcher.match(pair.left, pair.right)) == bits(
        usual(replace(config, warm_start=False)))
    assert matcher.state is None


def test_the_seed_changes_what_is_found(config):
    first, other = usual(config), matched(scene(), config, seed=1)
    # What realtime draws decides from the second frame on.
    assert (bits(first) != bits(other)) == (config.algorithm != 'realtime')


@pytest.mark.parametrize('columns', [70, 20])
def test_warming_up_changes_no_bit(config, columns):
    """Also for images with fewer columns than disparities, which only matching rejects."""
    pair, matcher = scene(), StereoMatcher(config)
    matcher.warm_up(40, columns)
    assert bits(matcher.match(pair.left, pair.right)) == bits(usual(config))


# ---- kinds of images ----


def test_the_right_reference_is_the_left_one_of_the_mirrored_and_exchanged_pair(config):
    pair = scene()
    mirrored = pair._replace(left=np.ascontiguousarray(pair.right[:, ::-1]),
                             right=np.ascontiguousarray(pair.left[:, ::-1]))
    right, left = matched(pair, config, reference='right'), matched(mirrored, config)
    np.testing.assert_array_equal(right.disparity, left.disparity[:, ::-1])
    np.testing.assert_array_equal(right.confidence, left.confidence[:, ::-1])


@pytest.mark.parametrize('places, colour', [(0, False), (4, True), (8, False)])
def test_an_image_of_more_bits_is_matched_as_the_same_one_of_8(config, places, colour):
    pair = scene(colour=colour)
    pair.left[0, 0] = 255
    deep = pair._replace(left=pair.left.astype(np.uint16) << places,
                         right=pair.right.astype(np.uint16) << places)
    eight, more = matched(pair, config), matched(deep, config)
    if not (colour and config.reading == 'literal'):    # whose grey is rounded in each depth
        assert bits(eight) == bits(more)


def test_grey_in_colour_is_matched_as_grey(config):
    pair = scene()
    left, right = (np.repeat(image[..., None], 3, axis=2) for image in pair[:2])
    assert bits(matched(pair._replace(left=left, right=right), config)) == bits(usual(config))


# ---- what comes out ----


def test_strided_and_read_only_images_are_matched_as_any_and_stay_as_they_are(config):
    pair = scene()
    wide = np.repeat(pair.left, 2, axis=1)
    strided = pair._replace(left=wide[:, ::2], right=np.asfortranarray(pair.right))
    left, right = pair.left.copy(), pair.right.copy()
    left.flags.writeable = right.flags.writeable = False
    expected = bits(usual(config))
    assert bits(matched(strided, config)) == expected
    assert bits(matched(pair._replace(left=left, right=right), config)) == expected
    np.testing.assert_array_equal(left, pair.left)


def test_a_fill_is_dense_and_keeps_the_rest_and_its_confidence(config):
    pair = scene()
    threshold = float(np.median(matched(pair, config, fill=True).confidence))
    sparse, dense = (matched(pair, config, fill=fill, confidence_threshold=threshold)
                     for fill in (False, True))
    known = np.isfinite(sparse.disparity)
    assert 0 < known.mean() < 1
    assert np.isfinite(dense.disparity).all()
    np.testing.assert_array_equal(dense.disparity[known], sparse.disparity[known])
    np.testing.assert_array_equal(dense.confidence, sparse.confidence)


def test_a_threshold_makes_what_is_less_sure_invalid(config):
    every = usual(config)
    threshold = np.float32(np.median(every.confidence))
    sure = matched(scene(), config, confidence_threshold=float(threshold))
    np.testing.assert_array_equal(
        np.isnan(sure.disparity), np.isnan(every.disparity) | (every.confidence < threshold))


# ---- small holes ----


LARGEST_HOLE = 12      # px


@pytest.fixture(scope='module')
def pairs():
    """Return frames of a noisy scene with holes of many sizes, whose rows do not fit."""
    frames = [make_pair(120, 200, 32, 4, objects=6, noise=noise) for noise in (4.0, 5.0)]
    return [(one.left, misaligned(one.right, tilt=1.5)) for one in frames]


def last_of(pairs, profile, **changes):
    matcher = StereoMatcher(MatcherConfig.from_profile(profile, **{
        'disparities': 32, 'generations': 2, 'threads': 1, **changes}))
    return [matcher.match(*pair) for pair in pairs][-1]


@pytest.mark.parametrize(('profile', 'threshold'), [
    *(pytest.param(name, 0.0, marks=[pytest.mark.slow] * (name == 'quality'))
      for name in PROFILES), ('realtime', 0.5)])
def test_small_holes_are_filled_and_all_else_stays_as_it_is(pairs, profile, threshold):
    plain, filled, found = (
        last_of(pairs, profile, confidence_threshold=threshold, **changes)
        for changes in ({}, {'fill': True}, {'fill_holes': LARGEST_HOLE}))
    expected, sizes = plain.disparity.copy(), []
    for places in components(np.isnan(plain.disparity), lambda *_: True):
        region = tuple(np.transpose(places))
        sizes.append(len(places))
        if sizes[-1] <= LARGEST_HOLE:
            expected[region] = filled.disparity[region]
    assert max(sizes) > LARGEST_HOLE
    assert np.isnan(expected).sum() < np.isnan(plain.disparity).sum()
    np.testing.assert_array_equal(found.disparity, expected)
    np.testing.assert_array_equal(found.confidence, plain.confidence)


# ---- over frames ----


@pytest.mark.parametrize('profile, stamped', [
    ('realtime', False), ('realtime', True), ('quality', True), ('paper_live', False)])
def test_behind_a_camera_that_drives_a_restored_state_and_more_threads_give_the_same_bits(
        profile, stamped):
    frames = list(make_sequence(130, 160, 24, 4, noise=2.0, drive=0.08, pan=1.0, objects=4))
    camera = Camera(FOCAL * 160, FOCAL * 160, 159 / 2, 129 / 2)
    one, other, three = (StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=24, threads=threads)) for threads in (1, 1, 3))
    other.match(*scene(seed=3)[:2])     # leaves no trace
    for number, (left, right, *_) in enumerate(frames, 1):
        stamp = number * 10**7 if stamped else None
        matches = [matcher.match(left, right, stamp, camera=camera)
                   for matcher in (one, three, *[other] * (number == 4))]
        assert len({repr(bits(match)) for match in matches}) == 1
        if number == 3:
            other.restore(one.state, one.rows)
    one.state.check(24 + 16)
    assert matches[0].warm and matches[0].motion == FOLLOWED


@pytest.mark.parametrize('profile, kind, level, lamps', [
    *((profile, np.uint16, 2047, (0, 0)) for profile in ALGORITHMS),
    ('realtime', np.uint16, 900, (24, 25)), ('realtime', np.uint8, 63, (0, 0)),
    ('realtime', np.uint8, 20, (3, 4))])
def test_pictures_whose_brightness_comes_near_a_limit_of_their_scale_are_averaged(
        profile, kind, level, lamps):
    """Levels around a power of two, and lamps around the share of pixels that may saturate."""
    random, pair = np.random.default_rng(0), scene(120, 200, noise=0.0)
    matcher = StereoMatcher(MatcherConfig.from_profile(
        profile, **SMALL, population=2, generations=1))
    scale = 0.9 * level / max(pair.left.max(), pair.right.max())
    for frame in range(8):
        images = [image * scale + random.normal(0, max(level / 150, 0.7), image.shape)
                  for image in (pair.left, pair.right)]
        for image in images:
            image[:4, :20] = level + frame % 2
            image[32, :lamps[frame % 2]] = 200 if kind is np.uint8 else 4000
        matcher.match(*(np.clip(np.rint(image), 0, None).astype(kind) for image in images))
    assert matcher.state.ages.mean() > 5
