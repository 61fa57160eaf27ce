# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A scene that stands still is searched in one frame of a few; any change is searched at once."""
from dataclasses import replace
from functools import cache
from itertools import product

from bench.draws import with_noise
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.realtime.still_scene import SETTLED
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest

CONFIG = MatcherConfig(disparities=32, threads=1, still_interval=3)
NOISE = 1.5
SECOND = 1_000_000_000


@cache
def scene():
    return make_pair(96, 160, 32)[:2]


def frames(number, seed=0, pair=None, noise=NOISE):
    """Yield noisy pairs of a still scene."""
    random = np.random.default_rng(seed)
    for _ in range(number):
        yield tuple(with_noise(image, noise, random) for image in pair or scene())


@cache
def settled():
    """Return the state and the match of a frame that was searched in a scene at rest."""
    matcher = StereoMatcher(CONFIG)
    for pair in frames(SETTLED + 1):
        match = matcher.match(*pair)
    assert not match.reused
    return matcher.state, match


def after_settling(config=CONFIG):
    """Return a matcher whose next frame keeps the result if nothing moves."""
    matcher = StereoMatcher(config)
    matcher.restore(settled()[0])
    return matcher


def with_object(rows, columns):
    """Return the scene with something new in front of it."""
    left, right = (image.copy() for image in scene())
    random = np.random.default_rng(5)
    thing = random.integers(0, 255, (rows, columns)).astype(np.uint8)
    left[40:40 + rows, 96:96 + columns] = right[40:40 + rows, 68:68 + columns] = thing
    return left, right


def test_one_frame_in_so_many_is_searched_once_nothing_has_moved_for_long():
    matcher = StereoMatcher(CONFIG)
    kept = []
    for pair in frames(SETTLED + 10):
        match = matcher.match(*pair)
        kept.append(match.reused)
        assert np.nanmin(match.disparity) >= 0 and match.confidence.min() >= 0
        match.disparity[:] = match.confidence[:] = -1       # they are the caller's own
    assert kept == [False] * (SETTLED + 1) + 3 * [True, True, False]


def test_frames_between_have_the_result_of_the_last_search():
    matcher, found = after_settling(), settled()[1]
    for pair in frames(2, seed=1):
        match = matcher.match(*pair)
        assert match.reused and match.warm and match.generations == 0
        np.testing.assert_array_equal(match.disparity, found.disparity)
        np.testing.assert_array_equal(match.confidence, found.confidence)


def test_noise_is_averaged_away_and_drifts_add_up_while_results_are_kept():
    matcher = after_settling()
    before = matcher.state
    matcher.match(*next(frames(1, seed=1)))
    assert (matcher.state.pictures != before.pictures).mean() > 0.5
    assert (matcher.state.drifts != before.drifts).mean() > 0.5


@pytest.mark.parametrize('change', [
    pytest.param(lambda: with_object(24, 8), id='an object'),
    pytest.param(lambda: (with_object(8, 24)[0], scene()[1]), id='an object seen by the left'),
    pytest.param(lambda: (scene()[0], with_object(8, 24)[1]), id='an object seen by the right'),
    pytest.param(lambda: tuple(np.roll(image, 8, axis=1) for image in scene()), id='a pan'),
    pytest.param(lambda: make_pair(96, 160, 32, seed=9)[:2], id='a cut')])
def test_a_frame_in_which_anything_changes_is_searched(change):
    matcher = after_settling()
    assert not matcher.match(*next(frames(1, 1, change()))).reused


def test_a_scene_comes_to_rest_again_after_an_object_has_appeared():
    """The tiles that changed are averages of one frame among averages of many."""
    pair, matcher = make_pair(192, 320, 32)[:2], StereoMatcher(CONFIG)
    for one in frames(SETTLED, pair=pair, noise=4.0):
        matcher.match(*one)
    thing = np.random.default_rng(5).integers(0, 255, (24, 24)).astype(np.uint8)
    pair[0][96:120, 160:184] = pair[1][96:120, 140:164] = thing
    kept = [matcher.match(*one).reused for one in frames(SETTLED + 8, 1, pair, noise=4.0)]
    assert kept[-3:].count(True) == 2


def test_what_appears_in_one_tile_waits_for_the_next_search():
    matcher = after_settling()
    pairs = frames(3, 1, with_object(8, 8))
    assert [matcher.match(*pair).reused for pair in pairs] == [True, True, False]


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
        thing = things.integers(100, 180, (7, 7), np.uint8)
        left[row:row + 7, column:column + 7] = right[row:row + 7, column - 16:column - 9] = thing
        truth[row:row + 7, column:column + 7] = 16

    def found(interval):
        again = StereoMatcher(replace(config, still_interval=interval))
        again.restore(matcher.state)
        *_, last = (again.match(*one) for one in frames(3, 1, (left, right)))
        assert not last.reused
        return np.mean(np.abs(last.disparity - truth)[np.isfinite(truth)] < 1)

    assert found(3) > found(1) - 0.03


def test_settings_that_change_the_result_ask_for_a_search_threads_and_deadlines_do_not():
    pair = next(frames(1, seed=1))
    assert not after_settling(replace(CONFIG, fill=True)).match(*pair).reused
    assert after_settling(replace(CONFIG, threads=2)).match(*pair).reused
    assert after_settling(replace(CONFIG, deadline_ms=30.0)).match(*pair).reused


@pytest.mark.parametrize('step, kept', [(SECOND // 30, True), (SECOND // 5, True),
                                        (SECOND // 4, False), (2 * SECOND, False)])
def test_a_result_is_kept_only_for_frames_that_follow_within_a_fifth_of_a_second(step, kept):
    matcher = StereoMatcher(CONFIG)
    matcher.restore(replace(settled()[0], stamp=SECOND))
    assert matcher.match(*next(frames(1, seed=1)), stamp=SECOND + step).reused is kept
