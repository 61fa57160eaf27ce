# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What holds of every profile: equal bits, kinds of images, either reference, fills, memory."""
from dataclasses import replace
from functools import cache
import gc
import weakref

from bench.conditions import misaligned
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.arrays import BLOCK, OWN, zeros
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.matching.over_frames.moving_camera import FOLLOWED
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from made_scenes import bits, matched, scene, street, STREET_CAMERA
import numpy as np
import pytest
from reference_refinement import components

SMALL = {'disparities': 24, 'threads': 1}
CONFIGS = {
    **{name: MatcherConfig.from_profile(name, **SMALL, generations=generations)
       for name, generations in (('realtime', 1), ('fast', 1), ('quality', 2))},
    **{f'paper, {reading}, {initial}': MatcherConfig.from_profile(
        'paper', **SMALL, population=6, generations=3, reference='left', reading=reading,
        initial_population=initial) for reading, initial in (
            ('literal', 'random'), ('uniform', 'winner_takes_all'))}}


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


def test_a_block_of_memory_ends_with_the_last_of_its_arrays():
    arrays = [zeros(OWN - 1, np.uint8) for _ in range(BLOCK // OWN + 1)]
    block = weakref.ref(arrays[-1].base)
    del arrays
    gc.collect()
    assert block() is None


def test_an_array_with_gaps_has_no_address_to_walk_from():
    rows = np.zeros((4, 6), np.uint8)
    assert address_of(rows[1:]) == rows.ctypes.data + 6
    with pytest.raises(ValueError, match=r'strides \(6, 2\) is not contiguous'):
        address_of(rows[:, ::2])


def test_what_was_warmed_up_for_or_matched_before_a_reset_or_cold_leaves_no_trace(config):
    """Not another scene or size, nor one with fewer columns than disparities."""
    pair, expected = scene(), bits(usual(config))
    cold, warm, other = (StereoMatcher(replace(config, warm_start=warm))
                         for warm in (False, True, True))
    cold.match(*scene(seed=1)[:2])
    assert bits(cold.match(pair.left, pair.right)) == expected
    assert cold.state is None
    warm.warm_up(40, 20)
    warm.match(*scene(50, 80)[:2])
    warm.reset()
    for _ in range(2):
        assert bits(warm.match(pair.left, pair.right)) == bits(other.match(pair.left, pair.right))
        warm.warm_up(60, 100)


def test_the_seed_changes_what_is_found(config):
    first, other = usual(config), matched(scene(), config, seed=1)
    # What realtime draws decides from the second frame on.
    assert (bits(first) != bits(other)) == (config.algorithm != 'realtime')


def test_the_right_reference_is_the_left_one_of_the_mirrored_and_exchanged_pair(config):
    pair = scene()
    mirrored = pair._replace(left=np.ascontiguousarray(pair.right[:, ::-1]),
                             right=np.ascontiguousarray(pair.left[:, ::-1]))
    right, left = matched(pair, config, reference='right'), matched(mirrored, config)
    np.testing.assert_array_equal(right.disparity, left.disparity[:, ::-1])
    np.testing.assert_array_equal(right.confidence, left.confidence[:, ::-1])


FORMS = [lambda image: image.astype(np.uint16), lambda image: image.astype(np.uint16) << 4,
         lambda image: image.astype(np.uint16) << 8,
         lambda image: image if image.ndim == 3 else np.stack(3 * [image], axis=2)]


@pytest.mark.parametrize('colour', [False, True])
def test_an_image_of_another_depth_or_in_colour_is_matched_to_the_same_bits(config, colour):
    """As 16 bits, of which 8, 12 or all are used; and grey in colour."""
    pair = scene(colour=colour)
    pair.left[0, 0] = 255
    expected = bits(matched(pair, config))
    for form in FORMS:
        left, right = (form(image) for image in pair[:2])
        # The grey of the literal reading is rounded in each depth.
        assert bits(matched(pair._replace(left=left, right=right), config)) == expected or (
            colour and config.reading == 'literal' and left.dtype == np.uint16)


def test_what_is_less_sure_is_invalid_and_a_fill_is_dense_and_keeps_the_rest(config):
    pair, every = scene(), usual(config)
    threshold = np.sort(every.confidence, axis=None)[every.confidence.size // 2]     # is enough
    sparse, dense = (matched(pair, config, fill=fill, confidence_threshold=float(threshold))
                     for fill in (False, True))
    known = np.isfinite(sparse.disparity)
    np.testing.assert_array_equal(
        known, np.isfinite(every.disparity) & (every.confidence >= threshold))
    assert 0 < known.mean() < 1 and np.isfinite(dense.disparity).all()
    for one in (sparse, dense):
        np.testing.assert_array_equal(one.disparity[known], every.disparity[known])
        np.testing.assert_array_equal(one.confidence, every.confidence)


@pytest.mark.parametrize(('profile', 'threshold'), [
    ('realtime', 0.5), ('paper', 0.0), pytest.param('quality', 0.0, marks=pytest.mark.slow)])
def test_small_holes_are_filled_and_all_else_stays_as_it_is(profile, threshold):
    """Of a noisy scene with holes of many sizes, whose rows do not fit."""
    frames = [make_pair(120, 200, 32, 4, objects=6, noise=noise) for noise in (4.0, 5.0)]
    pairs, matches = [(one.left, misaligned(one.right, tilt=1.5)) for one in frames], []
    for changes in ({}, {'fill': True}, {'fill_holes': 12}):
        matcher = StereoMatcher(profile, disparities=32, generations=2, population=8, threads=1,
                                confidence_threshold=threshold, **changes)
        matches.append([matcher.match(*pair) for pair in pairs][-1])
    plain, filled, found = matches
    expected, sizes = plain.disparity.copy(), []
    for places in components(np.isnan(plain.disparity), lambda *_: True):
        sizes.append(len(places))
        if sizes[-1] <= 12:
            region = tuple(np.transpose(places))
            expected[region] = filled.disparity[region]
    assert min(sizes) <= 12 < max(sizes)
    np.testing.assert_array_equal(found.disparity, expected)
    np.testing.assert_array_equal(found.confidence, plain.confidence)


@pytest.mark.parametrize('profile, generations, stamped', [
    ('realtime', 1, True), ('quality', 2, True), ('paper_live', 24, False)])
def test_behind_a_camera_that_drives_a_restored_state_and_more_threads_give_the_same_bits(
        profile, generations, stamped):
    one, other, three = (StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=24, generations=generations, threads=threads))
        for threads in (1, 1, 3))
    other.match(*scene(seed=3)[:2])     # leaves no trace
    handed_on = []
    for number, (left, right, *_) in enumerate(street()[:3], 1):
        stamp = number * 10**7 if stamped else None
        matches = [matcher.match(left, right, stamp, camera=STREET_CAMERA)
                   for matcher in (one, three, *[other] * (number == 3))]
        assert len({repr(bits(match)) for match in matches}) == 1
        if number == 2:
            other.restore(one.state, one.rows)
        handed_on += [(array, array.copy()) for array in one.state.arrays().values()]
    assert all(np.array_equal(array, copy) for array, copy in handed_on)    # not changed later
    one.state.check(24 + 16)
    assert matches[0].warm and matches[0].motion == FOLLOWED


@pytest.mark.parametrize('profile, kind, level, lamps', [
    ('realtime', np.uint16, 2047, (0, 0)), ('paper', np.uint16, 2047, (0, 0)),
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
