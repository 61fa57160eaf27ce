# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public face of the matcher in the profile realtime, and what a Match says of itself."""
from concurrent.futures import ThreadPoolExecutor
import copy
from dataclasses import replace
import pickle

import cv2
from fuzzed import examples
from fuzzy_stereo_ros.matching import Match, MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.evolution import Random
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS
from fuzzy_stereo_ros.matching.realtime import matcher as realtime
from fuzzy_stereo_ros.matching.realtime.matcher import RealtimeMatcher
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
from hypothesis import given, strategies as st
from made_scenes import bits, matched, scene, wrong
import numpy as np
import pytest

SECOND = 1_000_000_000
CONFIG = MatcherConfig(disparities=24, threads=1)
# Of each profile, so that it takes little time.
FEW = {'realtime': {}, 'fast': {}, 'quality': {}, 'paper': {'population': 4, 'generations': 2}}


def test_without_stamps_random_numbers_come_from_the_number_of_the_frame(monkeypatch):
    sources = []

    class Noting(RealtimeMatcher):
        def match(self, left, right, previous, random, *others):
            sources.append(random)
            return super().match(left, right, previous, random, *others)

    monkeypatch.setitem(ALGORITHMS, 'realtime', Noting)
    pair, matcher = scene(), StereoMatcher(replace(CONFIG, seed=3))
    for stamp in (None, None, 10, 2000, None):
        matcher.match(pair.left, pair.right, stamp)
    matcher.restore(matcher.state._replace(frame=6))
    matcher.match(pair.left, pair.right)
    assert sources == [Random((3, word)) for word in (0, 1, 10, 2000, 0, 7)]


SIDES = st.integers(20, 100)


@pytest.mark.parametrize('profile', FEW)
@pytest.mark.parametrize('copied', [copy.copy, copy.deepcopy, lambda one: pickle.loads(
    pickle.dumps(one))], ids=['copy', 'deepcopy', 'pickle'])
@examples(4)
@given(rows=SIDES, columns=SIDES, seed=st.integers(0, 99), threads=st.sampled_from([1, 2]))
def test_a_copy_of_a_matcher_goes_on_as_it_does_itself_and_neither_changes_the_other(
        profile, copied, rows, columns, seed, threads):
    first, *others = make_sequence(rows, columns, 16, 3, seed, noise=2.0)
    matcher = StereoMatcher(profile, disparities=16, threads=threads, **FEW[profile])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(realtime, 'FEWEST_SHARED', 0)
        matcher.match(first.left, first.right)
        another = copied(matcher)
        for left, right, *_ in others:
            one, other = (bits(each.match(left, right)) for each in (matcher, another))
            assert one == other


@pytest.mark.parametrize('profile', FEW)
@examples(3)
@given(rows=SIDES, columns=SIDES, seed=st.integers(0, 99), number=st.integers(2, 4))
def test_threads_that_share_a_matcher_wait_for_each_other(profile, rows, columns, seed, number):
    pairs = [make_pair(rows, columns, 16, seed + more)[:2] for more in range(2)]
    matcher = StereoMatcher(profile, disparities=16, threads=1, warm_start=False,
                            align_rows=False, **FEW[profile])
    expected = [bits(matcher.match(*pair)) for pair in pairs]
    with ThreadPoolExecutor(number) as pool:
        found = [*pool.map(lambda turn: bits(matcher.match(*pairs[turn % 2])), range(24))]
    assert found == expected * 12


@pytest.mark.parametrize('shift, min_disparity', [
    *((9, least) for least in (0, 4, -2048, -200, 100, 2048)),
    (-9, -20), (-9, -9), (-9, -32), (-30, -35), (2, -3)])
def test_what_both_images_show_is_found_up_to_the_border_and_nothing_beyond(shift, min_disparity):
    """A point at column c of the right image is at c + d of the left one; also where none is."""
    wide = scene(50, 160).left
    matcher = StereoMatcher(replace(CONFIG, min_disparity=min_disparity))
    for _ in range(2):
        match = matcher.match(wide[:, 30:130], wide[:, 30 + shift:130 + shift])
    pointed = np.arange(100) - shift
    inside = (pointed >= 0) & (pointed < 100)
    if min_disparity <= shift < min_disparity + CONFIG.disparities:
        assert np.mean(abs(match.disparity[:, inside] - shift) < 0.5) > 0.97
        assert np.mean(np.isnan(match.disparity[:, ~inside])) > 0.9
    else:
        assert np.isnan(match.disparity).all() and not match.confidence.any()


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_colour_beside_grey_is_weighed_to_grey(dtype):
    """Green counts twice; halves are rounded up."""
    pair = scene(colour=True)
    colour, other = pair.left.astype(dtype), pair.right[..., 1].astype(dtype)
    blue, green, red = np.moveaxis(colour.astype(int), 2, 0)
    grey = ((blue + 2 * green + red + 2) // 4).astype(dtype)
    assert bits(matched(pair._replace(left=colour, right=other), CONFIG)) == bits(
        matched(pair._replace(left=grey, right=other), CONFIG))
    assert bits(matched(pair._replace(left=other, right=colour), CONFIG)) == bits(
        matched(pair._replace(left=other, right=grey), CONFIG))


def test_what_cannot_be_seen_has_confidence_0_and_higher_confidence_is_right_more_often():
    pair = scene()
    match, hidden = matched(pair, CONFIG), ~pair.visible
    invalid = np.isnan(match.disparity)
    assert 0 < invalid.mean() < 0.5
    assert not match.confidence[invalid].any()
    assert invalid[hidden].mean() > 4 * invalid[~hidden].mean()
    pair = scene(200, 300, noise=10.0)
    match = matched(pair, CONFIG, fill=True)
    bad = ~(abs(match.disparity - pair.truth) <= 1)
    order = np.argsort(-match.confidence, axis=None)
    shares = [bad.ravel()[part].mean() for part in np.array_split(order, 3)]
    assert shares[0] <= shares[1] / 2 < shares[2] / 4


@pytest.mark.parametrize('options', [
    {'min_disparity': -12, 'colour': True}, {'min_disparity': 9, 'bits': 12}, {'exposure': 1.3},
    {'noise': 8.0}])
def test_made_scenes_are_found_but_for_few_pixels(options):
    found = []
    for seed in range(3):
        pair = make_pair(160, 240, 24, seed=seed, **options)
        found.append(wrong(matched(pair, CONFIG, fill=True,
                                   min_disparity=options.get('min_disparity', 0)), pair))
    assert np.mean(found) < 2 and max(found) < 3


@pytest.mark.parametrize(('rows', 'columns'), [(1, 1), (1, 30), (20, 1), (0, 30), (2**16, 2**15)])
def test_warming_up_for_a_size_that_cannot_be_matched_is_rejected(rows, columns):
    with pytest.raises(ValueError, match=f'^the images are {columns} x {rows}; at '):
        StereoMatcher(replace(CONFIG, disparities=1)).warm_up(rows, columns)


def test_a_matcher_is_made_of_a_profile_or_a_config_and_changes_of_either():
    assert StereoMatcher().config == MatcherConfig()
    for name in PROFILES:
        config = MatcherConfig.from_profile(name, disparities=96, seed=5)
        assert StereoMatcher(name, disparities=96, seed=5).config == config
        assert StereoMatcher(config).config == config
        assert StereoMatcher(config, seed=6).config == replace(config, seed=6)
    for words, changes, sentence in (
            (('fastest',), {}, "profile is 'fastest'; allowed are realtime, fast"),
            (({'disparities': 9},), {}, 'allowed are realtime, fast'),
            (('fast',), {'disparity': 9}, 'no parameter is called disparity; there are dispar'),
            ((CONFIG,), {'seed': -1}, 'seed is -1; allowed are whole numbers from 0')):
        with pytest.raises(ValueError, match=sentence) as raised:
            StereoMatcher(*words, **changes)
        assert '\n' not in str(raised.value)


@pytest.mark.parametrize('stamps, changes, warm', [
    ((10, 11), {}, True), ((0, SECOND), {}, True), ((0, SECOND + 1), {}, False),
    ((10, 10), {}, False), ((10, 9), {}, False), ((None, 10), {}, False), ((10, None), {}, False),
    ((None, None), {}, True), ((1, 2), {'disparities': 25}, False),
    ((1, 2), {'min_disparity': 1}, False), ((1, 2), {'reference': 'right'}, False)])
def test_only_a_frame_of_the_same_disparities_shortly_after_the_previous_one_is_warm(
        stamps, changes, warm):
    pair, matcher, config = scene(), StereoMatcher(CONFIG), replace(CONFIG, **changes)
    assert not matcher.match(pair.left, pair.right, stamps[0]).warm
    other, fresh = StereoMatcher(config), StereoMatcher(config)
    other.restore(matcher.state)
    second = other.match(pair.left, pair.right, stamps[1])
    assert second.warm == warm
    assert warm or bits(second) == bits(fresh.match(pair.left, pair.right, stamps[1]))


def grey(rows, columns, *channels, kind=np.uint8):
    return np.zeros((rows, columns, *channels), kind)


@pytest.mark.parametrize('left, right, sentence', [
    ([[1, 2]], grey(20, 30), 'the left image is a list; give a NumPy array of uint8 or uint16'),
    (grey(20, 30), grey(20, 30, 4), 'the right image has the shape (20, 30, 4); allowed are '
                                    '(rows, columns) and (rows, columns, 3)'),
    (grey(20, 30, kind=np.float32), grey(20, 30),
     'the left image is float32; allowed are uint8 and uint16'),
    (grey(20, 30), grey(20, 29), 'the left image is 30 x 20, the right one 29 x 20; give two '
                                 'rectified images of one size'),
    (grey(20, 30), grey(20, 30, kind=np.uint16), 'the left image is uint8, the right one uint16; '
                                                 'give two images of one depth'),
    (*2 * (grey(1, 30),), 'the images are 30 x 1; at least 2 x 2 pixels are needed'),
    (grey(20, 23), grey(20, 23), '24 disparities are more than the 23 columns of the images; ask '
                                 'for fewer disparities or give larger images')])
def test_what_is_no_pair_is_rejected_with_a_sentence_and_the_next_pair_is_matched(
        left, right, sentence):
    frames = list(make_sequence(60, 100, 24, 2, noise=2.0))
    matcher, undisturbed = StereoMatcher(CONFIG), StereoMatcher(CONFIG)
    for frame in frames:
        expected = undisturbed.match(frame.left, frame.right)
        assert bits(expected) == bits(matcher.match(frame.left, frame.right))
        with pytest.raises(ValueError) as error:
            matcher.match(left, right)
        assert str(error.value) == sentence


def test_one_thread_matches_small_images_and_all_that_are_set_match_larger_ones(monkeypatch):
    monkeypatch.setattr(realtime, 'FEWEST_SHARED', 5000)
    used = [RealtimeMatcher(replace(CONFIG, threads=3), *size).pool.threads
            for size in ((50, 99), (50, 100), (70, 300))]
    assert used == [1, 3, 3]


CAMERA = Calibration(200.0, 0.5, 2.0, Projection(200.0, 100.0, 1.0, 0.5))
DISPARITY = np.float32([[12, 7, np.nan], [4, 2, 1]])


def made(disparity):
    return Match(disparity, np.full(disparity.shape, 0.5), [], {}, False)


@pytest.mark.parametrize('disparity, low, high', [
    (DISPARITY, 1, 12), (np.full((2, 3), np.nan, np.float32), 0, 0)])
def test_a_notebook_shows_the_disparities_in_colours_from_end_to_end(disparity, low, high):
    picture = cv2.imdecode(np.frombuffer(made(disparity)._repr_png_(), np.uint8),
                           cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(picture, colour_disparity(disparity, low, high))


def test_metres_come_from_the_camera_that_is_given():
    depth = made(DISPARITY).depth(CAMERA)
    np.testing.assert_array_equal(depth, np.float32([[10, 20, np.nan], [50, np.inf, np.inf]]))
    points = made(DISPARITY).points(CAMERA)
    assert points.dtype == np.float32 and points.shape == (2, 3, 3)
    np.testing.assert_allclose(points[0, 0], [-0.05, -0.05, 10])
    np.testing.assert_allclose(points[1, 0], [-0.25, 0.25, 50])
    assert np.isnan(points[1, 1:]).all()
