# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A matcher of pairs whose configuration changes: the newest request wins, faults are reported."""
from dataclasses import replace
from queue import SimpleQueue
from unittest.mock import Mock

from bench.conditions import misaligned
import cv2
from fuzzy_stereo_ros import pair_matcher
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.match import mirrored
from fuzzy_stereo_ros.matching.realtime.refinement import Refinement
from fuzzy_stereo_ros.pair_matcher import (
    FAILED, PairMatcher, PREPARING, READY, without_missing)
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
from hypothesis import given, settings, strategies as st
from made_scenes import bits, shifted_pair
import numpy as np
import pytest

SOON = 60.0     # s; nothing here takes long, events are awaited: when to give up
CALIBRATION = centred_calibration(100.0, 0.1, 0.0, 60, 80)
PAIR = StereoPair(*shifted_pair(3), calibration=CALIBRATION, stamp=None)


class Gated:
    """A StereoMatcher for a PairMatcher; warming up waits for a permit, None or an error."""

    state = rows = None
    begun, permits = SimpleQueue(), SimpleQueue()

    def __init__(self, config):
        self.config = config

    def warm_up(self, rows, columns):
        self.begun.put((self.config.disparities, rows, columns))
        error = self.permits.get(timeout=SOON)
        if error is not None:
            raise error

    def match(self, left, right, stamp, camera):
        return self.config.disparities

    def restore(self, state, rows):
        pass


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.setattr(pair_matcher, 'StereoMatcher', Gated)
    monkeypatch.setattr(Gated, 'begun', SimpleQueue())
    monkeypatch.setattr(Gated, 'permits', SimpleQueue())
    ready = SimpleQueue()
    matcher = PairMatcher(MatcherConfig(disparities=8), 0.5,
                          lambda config, error: ready.put((config.disparities, error)))
    matcher.ready = ready
    Gated.permits.put(None)
    matcher.warm_up()
    assert Gated.begun.get() == (5, 64, 96)
    yield matcher
    Gated.permits.put(None)
    assert matcher.close(SOON)


def request(matcher, disparities):
    matcher.request(MatcherConfig(disparities=disparities))


def matched(matcher):
    """Return the disparities that a pair is matched with, at the scale of one half."""
    return matcher.match(PAIR).match


def test_pairs_are_matched_as_before_until_a_request_is_prepared_for_images_of_their_size(bench):
    assert (bench.change, matched(bench)) == ('', 5)
    request(bench, 16)
    assert Gated.begun.get(timeout=SOON) == (9, *PAIR.left.shape)
    assert (bench.change, matched(bench), bench.config.disparities) == (PREPARING, 5, 8)
    Gated.permits.put(None)
    assert bench.ready.get(timeout=SOON) == (16, None)
    assert bench.change == READY
    assert (matched(bench), bench.config.disparities, bench.change) == (9, 16, '')


def test_the_newest_request_replaces_those_that_wait_are_prepared_or_are_ready(bench):
    request(bench, 16)
    Gated.begun.get(timeout=SOON)
    request(bench, 20)
    request(bench, 24)
    Gated.permits.put(None)
    assert Gated.begun.get(timeout=SOON)[0] == 13
    Gated.permits.put(None)
    assert bench.ready.get(timeout=SOON) == (24, None)
    request(bench, 32)
    assert matched(bench) == 5
    Gated.permits.put(None)
    assert bench.ready.get(timeout=SOON) == (32, None)
    assert matched(bench) == 17


def test_the_rows_of_a_rig_stay_with_changed_parameters_and_after_resets():
    """Each change is followed by a pair without texture, in which nothing can be measured."""
    left, right = (cv2.GaussianBlur(image, None, 1.0) for image in shifted_pair(13, 240, 320))
    right, plain, ready = misaligned(right, tilt=2.0), np.full_like(left, 100), SimpleQueue()
    matcher = PairMatcher(MatcherConfig(disparities=32, confidence_threshold=0.4),
                          on_ready=lambda config, error: ready.put(error))
    matcher.warm_up()

    def share_of_right_pixels(stamp, *images):
        disparity = matcher.match(StereoPair(*images, CALIBRATION, stamp)).match.disparity
        return np.mean(np.abs(disparity - 13) < 1)
    for stamp in (5, 6, 7):
        assert share_of_right_pixels(stamp, left, right) > 0.8
    for changes in ({'confidence_threshold': 0.5}, {'reference': 'right'}, {'align_rows': False},
                    {'align_rows': True, 'reference': 'left', 'disparities': 40}, None):
        if changes:
            matcher.request(replace(matcher.config, **changes))
            assert ready.get(timeout=SOON) is None
        else:
            matcher.reset()
        share_of_right_pixels(3, plain, plain)      # the stamps jump back, too
        share = share_of_right_pixels(4, left, right)
        assert share > 0.9 if matcher.config.align_rows else share < 0.8
    assert matcher.close()


def test_an_error_is_reported_and_the_next_request_is_prepared_even_if_the_report_raises(bench):
    def broken(config, error, report=bench._on_ready):
        report(config, error)
        raise RuntimeError('no log')

    bench._on_ready, error = broken, MemoryError('too large')
    for disparities, fault, state, found in ((16, error, FAILED, 5), (24, None, READY, 13)):
        Gated.permits.put(fault)
        request(bench, disparities)
        assert bench.ready.get(timeout=SOON) == (disparities, fault)
        assert (bench.change, matched(bench)) == (state, found)


def test_closing_waits_for_what_is_prepared_and_drops_it(bench):
    request(bench, 16)
    Gated.begun.get(timeout=SOON)
    assert not bench.close(0.01)
    Gated.permits.put(None)
    assert bench.close(SOON)
    assert bench.ready.empty()
    assert matched(bench) == 5


def test_what_a_missing_pixel_takes_part_in_is_invalid_but_not_what_is_filled():
    left, right = shifted_pair(3, 40, 60)
    missing = np.zeros((2, 40, 60), bool)
    missing[0, :, 50:] = missing[1, :, 20:25] = True
    for fill in (False, True):
        matcher = PairMatcher(MatcherConfig(disparities=8, fill=fill))
        matcher.warm_up()
        pair = StereoPair(left, right, calibration=CALIBRATION, stamp=None)
        plain = matcher.match(pair).match
        matcher.reset()
        matched = matcher.match(replace(pair, missing=tuple(missing)))
        found = matched.match
        invalid = np.isnan(found.disparity)
        assert invalid[:, 50:].all()
        others = np.rint(np.arange(60) - np.where(np.isnan(plain.disparity), 99, plain.disparity))
        expected = missing[0] | np.isnan(plain.disparity) | (
            (others >= 20) & (others < 25) & (plain.confidence > 0))
        np.testing.assert_array_equal(invalid, expected)
        assert expected[:, 23:28].mean() > 0.9
        assert (found.confidence[invalid] == 0).all()
        np.testing.assert_array_equal(found.disparity[~invalid], plain.disparity[~invalid])
        np.testing.assert_array_equal(matcher.last.match.disparity, plain.disparity)
        assert matcher.close()


@settings(max_examples=20)
@given(st.integers(0, 99))
def test_what_is_missing_is_invalid_in_the_map_of_the_right_image_as_in_its_mirror_image(seed):
    left, right = shifted_pair(3, 40, 60)
    missing = np.random.default_rng(seed).random((2, 40, 60)) < 0.1
    of_right, of_mirrored = (
        without_missing(StereoMatcher(disparities=8, reference=reference).match(*pair), masks,
                        reference)
        for reference, pair, masks in (
            ('right', (left, right), tuple(missing)),
            ('left', (mirrored(right), mirrored(left)), tuple(missing[::-1, :, ::-1]))))
    for found, expected in zip(bits(of_right), (of_mirrored.disparity, of_mirrored.confidence)):
        assert found == mirrored(expected).tobytes()


def test_after_an_internal_error_the_next_pair_is_matched_as_by_a_new_matcher(monkeypatch):
    frames = [StereoPair(made.left, made.right, CALIBRATION, 1000 * number) for number, made in
              enumerate(make_sequence(60, 100, 24, 5, noise=3.0, pan=1.0))]
    matcher, fresh = (PairMatcher(MatcherConfig(disparities=24)) for _ in range(2))
    for one in (matcher, fresh):
        one.warm_up()
    for pair in frames[:3]:
        matcher.match(pair)
    with monkeypatch.context() as patch:
        patch.setattr(Refinement, 'write', Mock(side_effect=MemoryError))
        with pytest.raises(MemoryError):
            matcher.match(frames[3])
    found, expected = (one.match(frames[4]).match for one in (matcher, fresh))
    assert not found.warm
    assert bits(found) == bits(expected)
