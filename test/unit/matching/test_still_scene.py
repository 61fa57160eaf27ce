# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A scene that stands still is searched in one frame of a few; any change is searched at once."""
from dataclasses import replace
from functools import cache
from itertools import product

from bench.draws import with_noise
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.out_of_range import EXTRA_LABELS
from fuzzy_stereo_ros.matching.realtime.still_scene import SETTLED
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from made_scenes import matched, wrong
import numpy as np
import pytest

CONFIG = MatcherConfig(disparities=32, threads=1, still_interval=3)
SECOND = 1_000_000_000


@cache
def scene():
    return make_pair(96, 160, 32)[:2]


def frames(number, seed=0, pair=None, noise=1.5):
    """Yield noisy pairs of a still scene."""
    random = np.random.default_rng(seed)
    for _ in range(number):
        yield tuple(with_noise(image, noise, random) for image in pair or scene())


@cache
def settled():
    """Return the state of a frame that was searched in a scene at rest."""
    matcher = StereoMatcher(CONFIG)
    *_, match = (matcher.match(*pair) for pair in frames(SETTLED + 1))
    assert not match.reused
    return matcher.state


def with_object(rows, columns, sides='left and right'):
    """Return the scene with something new in front of it, as one camera or both see it."""
    pair = [image.copy() for image in scene()]
    thing = np.random.default_rng(5).integers(0, 255, (rows, columns)).astype(np.uint8)
    for image, side, column in zip(pair, ('left', 'right'), (96, 68)):
        if side in sides:
            image[40:40 + rows, column:column + columns] = thing
    return pair


def test_one_frame_in_so_many_is_searched_once_nothing_has_moved_for_long():
    """Those between have its result, as the caller's own, while noise and drifts are averaged."""
    matcher, kept, found = StereoMatcher(CONFIG), [], ()
    for pair in frames(SETTLED + 10):
        before = matcher.state
        match = matcher.match(*pair)
        kept.append(match.reused)
        if match.reused:
            assert match.warm and match.generations == 0
            for one, other in zip((match.disparity, match.confidence), found):
                np.testing.assert_array_equal(one, other)
            assert (matcher.state.pictures != before.pictures).mean() > 0.5
            assert (matcher.state.drifts != before.drifts).mean() > 0.5
        found = match.disparity.copy(), match.confidence.copy()
        match.disparity[:] = match.confidence[:] = -1
    assert kept == [False] * (SETTLED + 1) + 3 * [True, True, False]


@pytest.mark.parametrize('change, settings, kept', [
    (lambda: with_object(24, 8), {}, [False]), (lambda: with_object(8, 24, 'left'), {}, [False]),
    (lambda: with_object(8, 24, 'right'), {}, [False]),
    (lambda: [np.roll(image, 8, axis=1) for image in scene()], {}, [False]),
    (lambda: make_pair(96, 160, 32, seed=9)[:2], {}, [False]),
    (lambda: with_object(8, 8), {}, [True, True, False]), (scene, {'fill': True}, [False]),
    (scene, {'threads': 2}, [True]), (scene, {'deadline_ms': 30.0}, [True])],
    ids=['object', 'seen by the left', 'seen by the right', 'pan', 'cut', 'in one tile', 'fill',
         'threads', 'deadline'])
def test_whatever_changes_is_searched_at_once_but_for_what_fits_in_a_tile_and_shows_nowhere(
        change, settings, kept):
    matcher = StereoMatcher(replace(CONFIG, **settings))
    matcher.restore(settled())
    assert [matcher.match(*pair).reused for pair in frames(len(kept), 1, change())] == kept


@pytest.mark.parametrize('interval', [1, 2])
def test_the_state_of_a_scene_at_rest_is_sound_also_where_each_frame_is_searched(interval):
    matcher = StereoMatcher(replace(CONFIG, still_interval=interval))
    for pair in frames(SETTLED + 3):
        matcher.match(*pair)
        matcher.state.check(CONFIG.disparities + EXTRA_LABELS)


def test_a_scene_comes_to_rest_again_after_an_object_has_appeared():
    """The tiles that changed are averages of one frame among averages of many."""
    pair, matcher = make_pair(192, 320, 32)[:2], StereoMatcher(CONFIG)
    for one in frames(SETTLED, pair=pair, noise=4.0):
        matcher.match(*one)
    thing = np.random.default_rng(5).integers(0, 255, (24, 24)).astype(np.uint8)
    pair[0][96:120, 160:184] = pair[1][96:120, 140:164] = thing
    kept = [matcher.match(*one).reused for one in frames(SETTLED + 8, 1, pair, noise=4.0)]
    assert kept[-3:].count(True) == 2


def test_the_search_after_kept_frames_forgets_the_map_where_a_tile_changed_meanwhile():
    """It has looked the same since, but the map is of a search before the change."""
    config = replace(CONFIG, speckle_size=4)
    pair, things = make_pair(192, 320, 32, objects=0)[:2], np.random.default_rng(5)
    matcher = StereoMatcher(config)
    for one in frames(SETTLED + 1, pair=pair):
        matcher.match(*one)
    left, right = pair
    truth = np.full(left.shape, np.nan)
    for row, column in product((33, 81, 129), (81, 145, 209, 273)):
        thing = things.integers(100, 180, (9, 9), np.uint8)
        left[row:row + 9, column:column + 9] = right[row:row + 9, column - 16:column - 7] = thing
        truth[row:row + 9, column:column + 9] = 16

    def found(interval):
        again = StereoMatcher(replace(config, still_interval=interval))
        again.restore(matcher.state)
        *_, last = (again.match(*one) for one in frames(3, 1, (left, right)))
        assert not last.reused
        return np.mean(np.abs(last.disparity - truth)[np.isfinite(truth)] < 1)

    assert found(3) > found(1) - 0.01 > 0.4


@pytest.mark.parametrize('step, kept', [(SECOND // 30, True), (SECOND // 5, True),
                                        (SECOND // 4, False), (2 * SECOND, False)])
def test_a_result_is_kept_only_for_frames_that_follow_within_a_fifth_of_a_second(step, kept):
    matcher = StereoMatcher(CONFIG)
    matcher.restore(settled()._replace(stamp=SECOND))
    assert matcher.match(*next(frames(1, 1)), stamp=SECOND + step).reused is kept


@pytest.mark.parametrize('noise', [0, 0.5])
def test_a_faint_scene_gets_better_and_never_worse_than_cold_and_another_one_inherits_nothing(
        noise):
    """Its surfaces are regions of like grey."""
    config = replace(CONFIG, fill=True, still_interval=1)
    made, other = (make_pair(160, 240, 32, seed, objects=4, colour=True) for seed in (3, 9))
    made = made._replace(**{side: (112 + getattr(made, side) // 8).astype(np.uint8)
                            for side in ('left', 'right')})
    matcher = StereoMatcher(config)
    bad = [wrong(matcher.match(*pair), made) for pair in frames(12, 0, made[:2], noise)]
    assert bad[-1] <= bad[0] + 0.1
    assert noise == 0 or bad[-1] < bad[0]
    found = matcher.match(other.left, other.right)
    np.testing.assert_array_equal(found.disparity, matched(other, config).disparity)
