# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Why little can be matched is named with its remedy; so is what is nearer than the range."""
from dataclasses import replace
from types import SimpleNamespace

from bench.conditions import misaligned
from fuzzy_stereo_ros.matching import MatcherConfig, plausibility, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.out_of_range import EXTRA_LABELS, reject_beyond
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, settings, strategies as st
from made_scenes import LARGE, large_scene, noisy
import numpy as np
import pytest
from real_pairs import grey_pair, middlebury, motorcycle, third_size

ROWS, COLUMNS, DISPARITIES = LARGE
CONFIG = MatcherConfig(disparities=DISPARITIES, warm_start=False)


@pytest.fixture(scope='module')
def scene():
    return large_scene(1.5)


def finding(left, right, config=CONFIG, infinity=None, **options):
    """Return the Finding of a pair that is matched alone."""
    match = StereoMatcher(config).match(left, right)
    return PlausibilityCheck(**options).add(left, right, match, config, infinity)


def plain(level, noise=1.5, seed=0):
    wall = np.full((ROWS, COLUMNS), level, np.uint8)
    return noisy([wall], noise, np.random.default_rng(seed))[0]


@pytest.mark.parametrize('seed', range(6))
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
    if hot:     # pixels of a sensor of 12 bits
        pair = [image.astype(np.uint16) * 16 for image in pair]
        for image in pair:
            image[tuple(random.integers(0, side, hot) for side in image.shape[:2])] = 65535
    assert finding(*pair, config, infinity) is None
    found = finding(*pair[::-1], config, infinity)
    if found is None:       # nobody knows that infinity is not at the first disparity
        assert (infinity, first <= -np.nanmax(made.truth) * 0.8) == (None, True)
        return
    assert (found.cause, found.warns) == ('swapped', True)
    assert found.sentence.startswith('left and right are swapped: ')
    assert found.sentence.endswith('exchange the images and their camera_info')


@pytest.mark.parametrize('seed', range(3))
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


def causes_of(check, frames):
    """Return the cause after each of (left, right)s."""
    matcher = StereoMatcher(CONFIG)
    found = [check.add(*pair, matcher.match(*pair), CONFIG, 0.0) for pair in frames]
    return [one and one.cause for one in found]


@pytest.mark.parametrize('side, step, bits', [
    ('left', 0, 12), ('right', 3, 8), ('left', -6, 12)])
def test_a_camera_that_froze_is_told_by_its_side_as_long_as_it_hangs(scene, side, step, bits):
    """While the other one turns, to either side, or only its noise changes; not if both rest."""
    random = np.random.default_rng(0)

    def frame(turn, frozen):
        moving = noisy([np.roll(image, -turn, 1) for image in scene[:2]], 1.5, random)
        if frozen:
            moving[side == 'right'] = scene[side == 'right']
        return moving if bits == 8 else [image.astype(np.uint16) << 4 for image in moving]

    check = PlausibilityCheck()
    causes = causes_of(check, [frame(0, False), *(frame(step * n, True) for n in range(12))])
    assert causes == 6 * [None] + 7 * ['frozen']
    assert f'the {side} image stays the same' in check.finding.sentence
    assert causes_of(check, [frame(0, False)] * 2) == [None, None]
    every_second = [frame(0, number % 2) for number in range(12)]
    for frames in ([scene[:2]] * 9, every_second + every_second[::-1]) if bits == 8 else ():
        assert set(causes_of(PlausibilityCheck(), frames)) == {None}


@pytest.mark.parametrize('of, changes, options, cause, words', [
    (lambda left, right: (left, np.roll(right, 25, 0)), {}, {}, 'rows',
     'lie 25 px lower in the right image; rectify'),
    (lambda left, right: (left, np.roll(right, -16, 0)), {}, {}, 'rows', 'lie 16 px higher in'),
    (lambda left, right: (left, np.roll(right, 6, 0)), {'align_rows': False}, {}, 'rows',
     'lie 6 px lower in'),
    (lambda left, right: (left, np.roll(right, 6, 0)), {}, {}, None, ''),
    (lambda *pair: pair, {'disparities': 12}, {}, 'range', '): search 32 disparities'),
    (lambda *pair: pair, {'disparities': 12}, {'scale': 0.5}, 'range', '): search 64 disparities'),
    (lambda *pair: pair, {'algorithm': 'quality', 'deadline_ms': 1e-3}, {}, 'deadline',
     'raise deadline_ms'),
    *((lambda left, _: (left, make_pair(*LARGE, seed=5, objects=6, noise=1.5).right), changes, {},
       'unlike', '') for changes in (
        {}, {'algorithm': 'paper', 'population': 4, 'generations': 4, 'mutation_rate': 1.0})),
    (lambda left, right: (plain(3), plain(3, seed=1)), {}, {}, 'dark',
     'the left and right images are '),
    (lambda left, right: (plain(3), right), {}, {}, 'dark', 'the left image is '),
    (lambda left, right: (left, plain(255, 0)), {}, {}, 'overexposed', 'the right image is '),
    (lambda left, right: (plain(90), right), {}, {}, 'covered', 'the left image is '),
    *((lambda *_, noise=noise, shade=shade: noisy(
        [80 + np.linspace(0, shade, COLUMNS) * np.ones((ROWS, 1))] * 2, noise,
        np.random.default_rng(0)), {}, {}, 'plain', 'little texture')
      for noise, shade in ((0, 0), (5, 0), (5, 100)))])
@pytest.mark.parametrize('kind, shift', [(np.uint8, 0), (np.uint16, 4)])
def test_what_is_wrong_with_the_images_or_the_configuration_is_told(
        scene, kind, shift, of, changes, options, cause, words):
    """A wall that fills the picture is no fault."""
    images = [image.astype(kind) << shift for image in of(*scene[:2])]
    found = finding(*images, replace(CONFIG, **changes), **options)
    assert (found and found.cause) == cause
    assert cause is None or words in found.sentence and found.warns == (cause != 'plain')


def test_causes_are_looked_for_within_a_share_of_the_time_and_anew_with_another_range(
        scene, monkeypatch):
    asked = []
    clock = SimpleNamespace(perf_counter=lambda: 0.010 * len(asked))
    monkeypatch.setattr(plausibility, 'time', clock)
    monkeypatch.setattr(plausibility, 'CLOSER', [asked.append])
    match = StereoMatcher(CONFIG).match(scene.right, scene.left)
    match.times['total'] = 20.0
    check = PlausibilityCheck()
    for _ in range(400):
        check.add_within_share(scene.right, scene.left, match, CONFIG)
    before = len(asked)
    assert abs(before - 400 * 20 * plausibility.TIME_SHARE / 10) <= 1
    check.add_within_share(scene.right, scene.left, match, replace(CONFIG, disparities=16))
    assert len(asked) == before + 1


def test_a_cause_is_told_while_it_lasts(scene):
    """At once where it is seen at sight, else after pairs in a row of which none is good."""
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

    check = PlausibilityCheck(confirmed=3)
    causes = [one and one.cause for one in (check.add(*pair) for pair in (
        good, swapped, swapped, good, swapped, swapped, swapped, good, good, good))]
    assert causes == 6 * [None] + 3 * ['swapped'] + [None]


def test_real_pairs_that_fit_have_no_finding_with_noise_either_and_others_have_theirs():
    pairs = [(*motorcycle()[:2], 64), (*middlebury('tsukuba')[:2], 16),
             (*third_size('Lampshade1', 370, 480)[:2], 80),
             *((*grey_pair(place), disparities) for place, disparities in (
                 ('kitti2012_seq/000027/{}_10.png', 96),
                 ('kitti2012_seq/000138/{}_10.png', 73),        # a sky that fits anywhere
                 *((f'oakd_nogt/{name}/{{}}.png', 96) for name in ('desk', 'stairs', 'toy'))))]
    for number, (left, right, disparities) in enumerate(pairs):
        config = replace(CONFIG, disparities=disparities)
        assert finding(left, right, config) is None
        if number == 1:
            assert finding(*noisy((left, right), 1.5, np.random.default_rng(0)), config) is None
        assert finding(right, left, config).cause == 'swapped'
        if left.shape[1] > 1000:    # whose features are of half the size
            found = finding(left, misaligned(right, tilt=2.5), replace(config, align_rows=False))
            assert found.cause == 'rows'


CUT, TOP = 36, 35.0      # disparities, three quarters of a scene's, and the last of them


@pytest.fixture(scope='module')
def known():
    return make_pair(120, 200, 48, 4, objects=6, noise=1.5)


def rejected(disparity, min_disparity=0, disparities=CUT):
    """Return the match that is left of disparities, all of confidence 1."""
    # Repeated, so that the margin does not end where the image does.
    disparity = np.tile(np.array(disparity, np.float32), (1, disparities + EXTRA_LABELS))
    match = Match(disparity.copy(), np.ones_like(disparity), [], {}, False)
    return replace(match, **reject_beyond(ThreadPool(1), MatcherConfig(
        min_disparity=min_disparity, disparities=disparities), disparities + EXTRA_LABELS, match))


@pytest.mark.parametrize('profile', ['realtime', 'quality'])
def test_what_is_nearer_than_the_range_is_no_surface_and_not_filled_where_it_was_found(
        known, profile):
    nearer = known.truth > TOP + 0.5
    match, filled = (StereoMatcher(profile, disparities=CUT, fill=fill).match(*known[:2])
                     for fill in (False, True))
    assert nearer.mean() > 0.05
    assert (match.confidence[nearer] >= 0.5).mean() <= 0.05
    assert (match.confidence[nearer] >= 0.8).mean() <= 0.02
    assert np.nanmax(match.disparity) <= TOP
    assert match.beyond == pytest.approx(nearer.mean(), abs=0.05)
    assert match.needed_disparities > CUT
    assert profile == 'quality' or np.isnan(filled.disparity[nearer]).mean() > 0.8
    assert not filled.confidence[np.isnan(filled.disparity)].any()


@settings(max_examples=50)
@given(st.lists(st.sampled_from([0.0, 34.9, 35.0, 35.4, 35.5, 35.6, 36.4, 43.0, 46.0, np.nan]),
                min_size=1, max_size=40), st.sampled_from([0, -20, 7]))
def test_more_than_half_a_pixel_beyond_the_range_is_rejected(values, lowest):
    values = np.array([values], np.float32) + lowest
    match, top = rejected(values, lowest), TOP + lowest
    values = np.tile(values, (1, CUT + EXTRA_LABELS))
    kept = ~(values > top + 0.5)
    np.testing.assert_array_equal(match.disparity, np.where(
        kept, np.minimum(values, np.float32(top)), np.nan))
    np.testing.assert_array_equal(match.confidence, kept)
    counted = np.isfinite(values) & ~(values > top + EXTRA_LABELS - 0.5)     # not the last label
    assert match.beyond == (~kept & counted).sum() / max(counted.sum(), 1)


@pytest.mark.parametrize('values, disparities, enough', [
    ([3.0, 35.4], CUT, CUT), ([3.0, 38.0], CUT, 48), ([47.0, 38.0], CUT, 48), ([42.0], CUT, 48),
    ([38.0] * 20 + [42.0], CUT, 48), ([3.0, 43.0], CUT, CUT),
    ([102.0] * 3 + [98.0], 96, 128), ([98.0] * 30 + [102.0], 96, 112)])
def test_the_range_that_would_do_holds_what_was_found_or_is_a_third_larger(
        values, disparities, enough):
    assert rejected([values], disparities=disparities).needed_disparities == enough
