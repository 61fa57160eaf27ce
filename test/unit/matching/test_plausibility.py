# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Why little can be matched is named with its cause and its remedy, and nothing where all fits."""
from dataclasses import replace
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, plausibility, StereoMatcher
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from made_scenes import LARGE, large_scene, noisy
import numpy as np
import pytest
from real_pairs import DATA, kitti_frames, middlebury, motorcycle, read_grey, third_size

ROWS, COLUMNS, DISPARITIES = LARGE
CONFIG = MatcherConfig(disparities=DISPARITIES, warm_start=False)


@pytest.fixture(scope='module')
def scene():
    return large_scene(1.5)


def finding(left, right, config=CONFIG, **options):
    """Return the Finding of a pair that is matched alone."""
    match = StereoMatcher(config).match(left, right)
    return PlausibilityCheck(**options).add(left, right, match, config)


def lower(image, pixels):
    return np.ascontiguousarray(np.roll(image, pixels, 0))


def plain(level, noise=1.5, seed=0):
    wall = np.full((ROWS, COLUMNS), level, np.uint8)
    return noisy([wall], noise, np.random.default_rng(seed))[0]


def test_a_pair_that_fits_has_no_finding(scene):
    assert finding(scene.left, scene.right) is None


def test_swapped_images_are_told(scene):
    found = finding(scene.right, scene.left)
    assert (found.cause, found.warns) == ('swapped', True)
    assert found.sentence.startswith('left and right are swapped: ')
    assert found.sentence.endswith('exchange the images and their camera_info')


@pytest.mark.parametrize('pixels, align, told', [
    (25, True, '25 px lower'), (-16, True, '16 px higher'), (6, False, '6 px lower'),
    (6, True, None)])
def test_rows_that_are_farther_apart_than_is_undone_are_told(scene, pixels, align, told):
    found = finding(scene.left, lower(scene.right, pixels), replace(CONFIG, align_rows=align))
    if told is None:
        assert found is None
    else:
        assert found.cause == 'rows'
        assert f'lie {told} in the right image; rectify' in found.sentence


@pytest.mark.parametrize('scale, needed', [(1.0, 32), (0.5, 64)])
def test_a_range_that_is_too_short_is_told_with_one_that_would_do(scene, scale, needed):
    found = finding(scene.left, scene.right, replace(CONFIG, disparities=12), scale=scale)
    assert found.cause == 'range'
    assert found.sentence.endswith(f'): search {needed} disparities')


def test_a_range_that_begins_too_late_is_told(scene):
    config = replace(CONFIG, min_disparity=24)
    found = finding(scene.left, scene.right, config)
    assert found.cause == 'range'
    proposed = int(found.sentence.split('lower min_disparity to ')[1])
    assert abs(proposed - (np.nanmin(scene.truth) - 2)) <= 2


@pytest.mark.parametrize('kind, shift', [(np.uint8, 0), (np.uint16, 4)])
def test_black_white_and_covered_images_are_told_by_their_side(scene, kind, shift):
    def of(*images):
        found = finding(*(image.astype(kind) << shift for image in images))
        return found.cause, found.sentence.split(' is ')[0].split(' are ')[0]

    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
                   for image in scene[:2])
    assert of(plain(3), plain(3, seed=1)) == ('dark', 'the left and right images')
    assert of(plain(3), right) == ('dark', 'the left image')
    assert of(left, plain(255, 0)) == ('overexposed', 'the right image')
    assert of(plain(90), right) == ('covered', 'the left image')


def test_images_of_two_scenes_are_told(scene):
    other = make_pair(ROWS, COLUMNS, DISPARITIES, seed=5, objects=6, noise=1.5)
    assert finding(scene.left, other.right).cause == 'unlike'


@pytest.mark.parametrize('noise, shade', [
    (0, 0), (1.5, 0), (3, 0), (5, 0), (1.5, 100), (5, 100)])
def test_a_wall_that_fills_the_picture_is_no_fault_and_told_by_its_texture(noise, shade):
    wall = 80 + np.linspace(0, shade, COLUMNS) * np.ones((ROWS, 1))
    found = finding(*noisy([wall] * 2, noise, np.random.default_rng(0)))
    assert (found.cause, found.warns) == ('plain', False)
    assert 'little texture' in found.sentence


def test_a_deadline_before_the_first_generation_is_told(scene):
    config = replace(MatcherConfig.from_profile('quality', disparities=DISPARITIES),
                     deadline_ms=1e-3)
    found = finding(scene.left, scene.right, config)
    assert found.cause == 'deadline'
    assert 'raise deadline_ms' in found.sentence


def test_a_finding_needs_suspicious_pairs_in_a_row_and_goes_after_as_many_that_are_not(scene):
    check, matcher = PlausibilityCheck(confirmed=3), StereoMatcher(CONFIG)
    good, bad = ((*pair, matcher.match(*pair), CONFIG) for pair in (
        (scene.left, scene.right), (scene.right, scene.left)))
    causes = [one and one.cause for one in (
        check.add(*pair) for pair in (good, bad, bad, good, bad, bad, bad, good, good, good))]
    assert causes == 6 * [None] + 3 * ['swapped'] + [None]


def test_confidence_that_falls_far_below_the_usual_is_suspicious(scene, monkeypatch):
    asked = []
    monkeypatch.setattr(plausibility, 'cause_of', lambda *arguments: asked.append(arguments))
    monkeypatch.setattr(plausibility, 'LOW_CONFIDENCE', 0.0)
    check, match = PlausibilityCheck(), StereoMatcher(CONFIG).match(scene.left, scene.right)
    for confidence in (0.8, 0.8, 0.65, 0.5):
        check.add(None, None, replace(
            match, confidence=np.full_like(match.confidence, confidence)), CONFIG)
        assert len(asked) == (confidence == 0.5)


def test_causes_are_looked_for_within_a_share_of_the_time_and_anew_with_another_range(
        scene, monkeypatch):
    asked = []
    clock = SimpleNamespace(perf_counter=lambda: 0.010 * len(asked))
    monkeypatch.setattr(plausibility, 'time', clock)
    monkeypatch.setattr(plausibility, 'cause_of', lambda *arguments: asked.append(arguments))
    match = StereoMatcher(CONFIG).match(scene.right, scene.left)
    match.times['total'] = 20.0
    check = PlausibilityCheck()
    for _ in range(1000):
        check.add_within_share(scene.right, scene.left, match, CONFIG)
    before = len(asked)
    assert abs(before - 1000 * 20 * plausibility.TIME_SHARE / 10) <= 1
    check.add_within_share(scene.right, scene.left, match, replace(CONFIG, disparities=16))
    assert len(asked) == before + 1


def test_after_a_finding_went_away_the_next_suspicion_is_looked_at_at_once(scene):
    check, matcher = PlausibilityCheck(), StereoMatcher(CONFIG)
    good, swapped, black = ((*pair, matcher.match(*pair), CONFIG) for pair in (
        (scene.left, scene.right), (scene.right, scene.left), (plain(3), plain(3, seed=1))))
    for pair, cause in (swapped, 'swapped'), (swapped, 'swapped'), (good, None), (black, 'dark'):
        check.add_within_share(*pair)
        assert (check.finding and check.finding.cause) == cause


def real_pairs():
    """Yield left and right image and disparities of real pairs that fit."""
    yield motorcycle()[:2] + (64,)
    for name, disparities in (('tsukuba', 16), ('teddy', 64)):
        yield (*middlebury(name)[:2], disparities)
    for name in ('Midd1', 'Lampshade1'):
        yield (*third_size(name, 370, 480)[:2], 80)
    for name, numbers, disparities in (('000027', (7, 10), 96), ('000138', (10,), 73)):
        for pair in kitti_frames(name, numbers)[0]:     # the sky of the second fits anywhere
            yield (*pair, disparities)
    for name in ('desk', 'stairs', 'toy'):
        folder = DATA / 'oakd_nogt' / name
        yield read_grey(folder / 'left.png'), read_grey(folder / 'right.png'), 96


def test_real_pairs_that_fit_have_no_finding_with_noise_either_and_swapped_ones_have():
    for number, (left, right, disparities) in enumerate(real_pairs()):
        config = replace(CONFIG, disparities=disparities)
        assert finding(left, right, config) is None
        if number < 3:
            assert finding(*noisy((left, right), 1.5, np.random.default_rng(0)), config) is None
        assert finding(right, left, config).cause == 'swapped'
