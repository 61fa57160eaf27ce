# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile `quality`: what the frame before gives, single pairs, and cameras that differ."""
from dataclasses import replace
from itertools import pairwise

import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.match import Match, mirrored
from fuzzy_stereo_ros.matching.over_frames import moving_camera
from fuzzy_stereo_ros.matching.over_frames.inheritance import Inheritance
from fuzzy_stereo_ros.matching.quality.exposure import exposed_alike
from fuzzy_stereo_ros.matching.quality.matcher import LEAST_AGE, QualityState
from fuzzy_stereo_ros.matching.quality.operators import OPERATORS
from fuzzy_stereo_ros.matching.quality.seed import parent_of, ScanlineSeed
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
from hypothesis import given, strategies as st
import made_scenes
from made_scenes import matched, scene, street, STREET_CAMERA, wrong
import numpy as np
import pytest

ROWS, COLUMNS, DISPARITIES = 80, 112, 24
CONFIG = MatcherConfig.from_profile('quality', disparities=DISPARITIES, threads=1, fill=True)


def frames(number, noise):
    return list(make_sequence(ROWS, COLUMNS, DISPARITIES, number, 1, noise=noise, objects=3,
                              colour=True))


def matches_of(pairs, camera=None, matcher=None, **changes):
    """Return the matches of pairs one after the other, and the matcher."""
    matcher = matcher or StereoMatcher(replace(CONFIG, **changes))
    return made_scenes.matches_of(matcher, pairs, camera), matcher


@given(st.integers(6, 16), st.sampled_from([(30, 40), (30, 40, 3)]))
def test_colours_are_the_8_highest_used_bits_of_all_channels(bits, shape):
    image = np.random.default_rng(bits).integers(0, 2**bits, shape).astype(
        np.uint8 if bits == 8 else np.uint16)
    image[0] = 2**bits - 1
    inheritance = Inheritance(CONFIG, *shape[:2], seen=2)
    inheritance.read(ThreadPool(1), image, mirrored(image))
    expected = np.minimum(np.floor(image * 2.0**(8 - bits) + 0.5), 255)
    for colours, wanted in zip(inheritance.colours, (expected, expected[:, ::-1])):
        np.testing.assert_array_equal(
            colours, wanted if len(shape) == 3 else np.stack([wanted] * 3, axis=2))


def test_noise_is_averaged_in_all_channels_and_maps_are_taken_over_once_it_is():
    random = np.random.default_rng(3)
    smooth = cv2.GaussianBlur(random.normal(size=(128, 160, 3)), None, 6.0)
    smooth = np.interp(smooth, (smooth.min(), smooth.max()), (40, 210))
    inheritance, pool = Inheritance(CONFIG, 128, 160, 2, LEAST_AGE), ThreadPool(1)
    state, labels = None, np.zeros((2, 128, 160), np.float32)
    for number in range(1, LEAST_AGE + 2):
        inheritance.read(pool, *made_scenes.noisy(2 * [smooth], 3.0, random))
        inherited = inheritance.average(pool, state, None)
        assert inherited == (number > 1)
        if inherited:
            assert (inheritance.unseen > 0.9) == (number < LEAST_AGE)
        state = inheritance.next_state(labels[0], labels[0], QualityState(labels), CONFIG)
    for colours in inheritance.colours:
        assert (colours - smooth).std(axis=(0, 1)).max() < 0.5 * 3.0


def test_a_still_scene_in_noise_gets_better_and_flickers_less_and_after_a_cut_all_begins_anew():
    pairs = frames(9, noise=4.0)
    (warm, matcher), (cold, _) = matches_of(pairs), matches_of(pairs[-4:], warm_start=False)
    assert [match.warm for match in warm] == [False] + 8 * [True]
    errors, changed = zip(*(
        (np.mean([wrong(*one) for one in zip(maps[-4:], pairs[-4:])]),
         np.mean([np.abs(match.disparity - before.disparity) > 1
                  for before, match in pairwise(maps[-4:])])) for maps in (warm, cold)))
    assert errors[0] < 0.8 * errors[1] and changed[0] < 0.8 * changed[1]
    assert warm[-1].generations == 1 and cold[-1].generations == CONFIG.generations
    assert [*warm[-1].history[0].gains] == ['segments', 'trust']     # tiles would flicker
    other = matcher.match(*(np.ascontiguousarray(image[::-1]) for image in pairs[0][:2]))
    assert not other.warm and other.generations == CONFIG.generations


def test_made_scenes_are_found():
    for seed in range(2):
        pair = scene(90, 140, seed)
        match = matched(pair, CONFIG, generations=6)
        assert wrong(match, pair) < 5
        assert [list(row.gains) for row in match.history] == 6 * [list(OPERATORS)]


@pytest.mark.parametrize('noisy, least, apart, square', [
    (False, 1600, 1.0, 9), (True, 100, 0.5, 5)])
def test_regions_that_differ_are_those_of_this_frame_and_all_else_is_inherited(
        noisy, least, apart, square):
    inherited = np.random.default_rng(0).uniform(5, 10, (100, 200)).astype(np.float32)
    fresh, expected, side = inherited.copy(), inherited.copy(), round(least**0.5)
    fresh[10:10 + side, 50:50 + side] += 1.1 * apart
    expected[10:10 + side, 50:50 + side] += 1.1 * apart
    fresh[10:10 + side, 10:10 + side] += 0.9 * apart            # differs little
    fresh[60:60 + side // 2, 100:100 + side] -= 3               # too small
    for left in (130, 150, 170):
        fresh[:, left:left + square - 1] = 20                   # too thin
    np.testing.assert_array_equal(parent_of(inherited, fresh, noisy), expected)
    np.testing.assert_array_equal(parent_of(inherited, inherited + 3, noisy), inherited + 3)


def test_a_region_that_was_wrong_in_the_frame_before_is_no_parent_of_the_next_one(monkeypatch):
    find, parents = ScanlineSeed.find, []

    def spied(seed, left, right, parent, *others):
        parents.append(parent)
        return find(seed, left, right, parent, *others)

    pair, = frames(1, noise=0)
    _, matcher = matches_of([pair])
    state = matcher.state
    right_before = [disparities.copy() for disparities in state.own.disparities]
    for disparities in state.own.disparities:
        disparities[10:70, 30:80] = np.where(disparities[10:70, 30:80] < 12, 20, 2)
        disparities[:5, :5] += 2
    matcher.restore(state)
    monkeypatch.setattr(ScanlineSeed, 'find', spied)
    (match,), _ = matches_of([pair], matcher=matcher)
    assert match.warm
    for parent, right in zip(parents, right_before):
        assert np.mean(np.abs(parent - right)[10:70, 30:80] > 1) < 0.2
        np.testing.assert_array_equal(parent[:5, :5], right[:5, :5] + 2)


def test_a_map_moves_with_the_camera():
    pairs = street()[:3]
    _, matcher = matches_of(pairs[:2], STREET_CAMERA)
    inheritance, before = matcher.algorithm._inheritance, matcher.state
    (followed,), _ = matches_of(pairs[2:], STREET_CAMERA, matcher)
    assert followed.motion == moving_camera.FOLLOWED and followed.warm
    assert wrong(followed, pairs[-1]) < wrong(matched(pairs[-1], CONFIG), pairs[-1]) + 0.3
    for side, truth in enumerate(matcher.state.own.disparities):
        moved = np.empty_like(truth)
        inheritance.inherit(before.own.disparities[side], np.full_like(truth, -9), moved, side)
        seen = moved >= 0
        assert seen.mean() > 0.8
        assert np.mean(np.abs(moved - truth)[seen] > 1) < 0.05


def test_a_uniform_pair_is_rejected_and_noise_is_not_sure():
    uniform = np.full((60, 100, 3), 90, np.uint8)
    matcher, invalid = StereoMatcher(replace(CONFIG, fill=False, warm_start=False)), []
    nothing = matcher.match(uniform, uniform)
    assert np.isnan(nothing.disparity).all() and (nothing.confidence == 0).all()
    for seed in range(3):
        noise = np.random.default_rng(seed).integers(0, 255, (2, 60, 100, 3)).astype(np.uint8)
        unlike = matcher.match(*noise)
        assert (unlike.confidence >= 0.5).mean() < 0.002
        invalid.append(np.isnan(unlike.disparity).mean())
    assert np.mean(invalid) > 0.9


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


def dark_corners(image):
    """Return an image that is darker towards its right edge and its corners."""
    across, down = np.linspace(-1, 1, 160), np.linspace(-1, 1, 120)[:, None]
    return image * (0.8 - 0.1 * across - 0.15 * (across**2 + down**2))[..., None]


@pytest.mark.parametrize('exposure, undone', [
    (lambda image: 0.7 * image - 8, True), (lambda image: 255 * (image / 255)**1.4, True),
    (dark_corners, True), (lambda image: image, False), (lambda image: 0.96 * image, False)],
    ids=['gain and offset', 'gamma', 'dark corners', 'none', 'little'])
@pytest.mark.parametrize('share', [0, 0.3])
def test_another_exposure_is_undone_though_matches_are_wrong_unless_it_differs_little(
        exposure, undone, share):
    random, shape = np.random.default_rng(0), (120, 160)
    wide = cv2.GaussianBlur(random.uniform(0, 255, (120, 160 + 12, 3)), None, 4)
    wide = np.interp(wide, (wide.min(), wide.max()), (40, 220))
    left, alike, right = (np.rint(image).astype(np.uint8) for image in (
        wide[:, :-12], wide[:, 12:], exposure(wide[:, 12:])))
    disparity, elsewhere = np.full(shape, np.float32(12)), random.random(shape) < share
    disparity[elsewhere] = random.integers(0, 60, elsewhere.sum())
    found = exposed_alike(left, right, Match(
        disparity, np.ones_like(disparity), [], {}, False))
    before, after = (abs(image.astype(float) - alike).mean() for image in (right, found))
    assert (found is not right) == undone
    assert not undone or before > 20 and after < 2
