# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Why little can be matched is named with its cause and its remedy, and nothing where all fits."""
from dataclasses import replace
from types import SimpleNamespace

from bench.conditions import misaligned
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


def finding(left, right, config=CONFIG, infinity=None, **options):
    """Return the Finding of a pair that is matched alone."""
    match = StereoMatcher(config).match(left, right)
    return PlausibilityCheck(**options).add(left, right, match, config, infinity)


def lower(image, pixels):
    return np.ascontiguousarray(np.roll(image, pixels, 0))


def plain(level, noise=1.5, seed=0):
    wall = np.full((ROWS, COLUMNS), level, np.uint8)
    return noisy([wall], noise, np.random.default_rng(seed))[0]


def deep(image, hot, random):
    """Return an image as of a sensor of 12 bits with a number of hot pixels, uint16."""
    image = image.astype(np.uint16) * 16
    image[tuple(random.integers(0, side, hot) for side in image.shape[:2])] = 65535
    return image


@pytest.mark.parametrize('seed', range(12))
def test_swapped_images_are_told_whatever_the_scene_the_light_the_range_and_a_hot_pixel(seed):
    """Where infinity is known, even if the range includes all and matches."""
    random = np.random.default_rng(seed)
    rows, columns, disparities = random.integers((120, 160, 24), (400, 560, 72))
    made = make_pair(rows, columns, disparities, seed=seed, objects=6, noise=1.5)
    infinity = random.choice([None, 0.0])
    first = -int(random.integers(0, disparities // (1 if infinity == 0 else 3)))
    config = replace(CONFIG, min_disparity=first, disparities=int(disparities) - first)
    dull, hot = random.choice([1.0, 0.15]), int(random.integers(0, 3))
    pair = [np.rint(118 + dull * (image - 128.0)).astype(np.uint8) for image in made[:2]] if (
        dull < 1) else made[:2]
    if hot:
        pair = [deep(image, hot, random) for image in pair]
    assert finding(*pair, config, infinity) is None
    found = finding(*pair[::-1], config, infinity)
    if found is None:       # nobody knows that infinity is not at the first disparity
        assert (infinity, first <= -np.nanmax(made.truth) * 0.8) == (None, True)
        return
    assert (found.cause, found.warns) == ('swapped', True)
    assert found.sentence.startswith('left and right are swapped: ')
    assert found.sentence.endswith('exchange the images and their camera_info')


@pytest.mark.parametrize('seed', range(6))
def test_one_picture_on_both_sides_is_told_and_a_scene_at_infinity_is_not(seed):
    random = np.random.default_rng(seed)
    rows, columns = random.integers((60, 80), (300, 400))
    picture = make_pair(rows, columns, 24, seed=seed, objects=6).left
    if seed % 3:
        picture = picture.astype(np.uint16) * 16
    colour = np.repeat(picture.reshape(rows, columns, -1)[:, :, :1], 3, 2)
    for other in picture.copy(), colour:
        found = finding(picture, other, infinity=0.0)
        assert found.cause == 'same'
        assert 'correct the remapping' in found.sentence
    noise = 256 // 16 if seed % 3 else 1
    far = [(image + random.normal(20 * noise, noise, image.shape)).astype(image.dtype)
           for image in 2 * [(picture * 0.8).astype(picture.dtype)]]
    assert finding(*far, infinity=0.0) is None


def causes_of(check, frames, matcher=None):
    """Return the cause after each of (left, right)s."""
    matcher = matcher or StereoMatcher(CONFIG)
    found = [check.add(left, right, matcher.match(left, right), CONFIG, 0.0)
             for left, right in frames]
    return [one and one.cause for one in found]


@pytest.mark.parametrize('side', ['left', 'right'])
@pytest.mark.parametrize('step, bits', [(0, 12), (3, 8), (-6, 12)])
def test_a_camera_that_froze_is_told_by_its_side_as_long_as_it_hangs(scene, side, step, bits):
    """While the other one turns, to either side, or only its noise changes."""
    random = np.random.default_rng(0)

    def frame(turn, frozen):
        moving = noisy([np.roll(image, -turn, 1) for image in scene[:2]], 1.5, random)
        if frozen:
            moving[side == 'right'] = scene[side == 'right']
        return moving if bits == 8 else [image.astype(np.uint16) << 4 for image in moving]

    check = PlausibilityCheck()
    causes = causes_of(check, [frame(0, False), *(frame(step * n, True) for n in range(12))])
    assert set(causes[:6]) == {None}
    assert set(causes[6:]) == {'frozen'}
    assert f'the {side} image stays the same' in check.finding.sentence
    assert causes_of(check, [frame(0, False)] * 2) == [None, None]


def test_a_still_scene_without_noise_and_every_second_frame_twice_are_no_frozen_camera(scene):
    random = np.random.default_rng(0)
    twice = [(noisy([scene.left], 1.5, random)[0], scene.right if number % 2 else
              noisy([scene.right], 1.5, random)[0]) for number in range(12)]
    for frames in ([scene[:2]] * 9, [*twice, *twice[::-1]]):
        assert set(causes_of(PlausibilityCheck(), frames)) == {None}


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


def test_causes_are_looked_for_within_a_share_of_the_time_and_anew_with_another_range(
        scene, monkeypatch):
    asked = []
    clock = SimpleNamespace(perf_counter=lambda: 0.010 * len(asked))
    monkeypatch.setattr(plausibility, 'time', clock)
    monkeypatch.setattr(plausibility, 'CLOSER', [asked.append])
    match = StereoMatcher(CONFIG).match(scene.right, scene.left)
    match.times['total'] = 20.0
    check = PlausibilityCheck()
    for _ in range(1000):
        check.add_within_share(scene.right, scene.left, match, CONFIG)
    before = len(asked)
    assert abs(before - 1000 * 20 * plausibility.TIME_SHARE / 10) <= 1
    check.add_within_share(scene.right, scene.left, match, replace(CONFIG, disparities=16))
    assert len(asked) == before + 1


def test_the_cause_is_that_of_now_within_the_share_of_the_time(scene):
    """What is seen at sight is told at once, and a suspicion ends when a pair is missing."""
    check, matcher = PlausibilityCheck(), StereoMatcher(CONFIG)
    good, swapped, covered, black = ((*pair, matcher.match(*pair), CONFIG) for pair in (
        (scene.left, scene.right), (scene.right, scene.left), (scene.left, plain(90)),
        (plain(3), plain(3, seed=1))))
    for pair, cause in [(swapped, 'swapped'), (swapped, 'swapped'), (covered, 'covered'),
                        (black, 'dark'), (good, None), (black, 'dark'), (swapped, None)]:
        check.add_within_share(*pair)
        assert (check.finding and check.finding.cause) == cause
    swapped[2].times['total'] = 20.0
    while not check.finding:
        check.add_within_share(*swapped)
    for _ in range(3):      # and one that comes again is told again
        check.interrupt()
        assert check.finding is None
        check.add_within_share(*swapped)
        assert check.finding.cause == 'swapped'


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


def test_real_pairs_that_fit_have_no_finding_with_noise_either_and_others_have_theirs():
    for number, (left, right, disparities) in enumerate(real_pairs()):
        config = replace(CONFIG, disparities=disparities)
        assert finding(left, right, config) is None
        if number < 3:
            assert finding(*noisy((left, right), 1.5, np.random.default_rng(0)), config) is None
        assert finding(right, left, config).cause == 'swapped'
        if left.shape[1] > 1000:    # whose features are of half the size
            found = finding(left, misaligned(right, tilt=2.5), replace(config, align_rows=False))
            assert found.cause == 'rows'
