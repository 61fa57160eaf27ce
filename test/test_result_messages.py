# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What came of a pair into messages, on stand-ins and on ROS's own messages."""
from array import array
from types import SimpleNamespace

from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.choice import STEPS
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.result_messages import (
    DISPARITY_STEP, fill_confidence, fill_disparity)
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from hypothesis import given, strategies as st
import numpy as np
import pytest

LEFT = Projection(200.0, 200.0, 50.0, 40.0)


def header():
    return SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id='')


def made_match(disparity):
    disparity = np.asarray(disparity, np.float32)
    return SimpleNamespace(disparity=disparity,
                           confidence=np.where(np.isnan(disparity), 0, 0.5).astype(np.float32))


def made_pair(shape, offset=0.0):
    grey = np.zeros(shape, np.uint8)
    return StereoPair(grey, grey, Calibration(200.0, 0.12, offset, LEFT),
                      12_000_000_345, 'left_optical')


def message_stand_in():
    return SimpleNamespace(
        header=header(), image=SimpleNamespace(header=header()),
        f=0.0, t=0.0, valid_window=SimpleNamespace(),
        min_disparity=0.0, max_disparity=0.0, delta_d=0.0)


def read_values(message):
    return np.frombuffer(message.data, '<f4').reshape(message.height, message.width)


def filled(disparity, offset=0.0, **config):
    match = made_match(disparity)
    return fill_disparity(message_stand_in(), match, made_pair(match.disparity.shape, offset),
                          MatcherConfig(**config))


def test_a_disparity_message_is_filled_as_the_contract_says():
    message = filled([[5.0, np.nan, -0.3, 63.4] * 25] * 80, disparities=64)
    assert stamp_of(message.header) == stamp_of(message.image.header) == 12_000_000_345
    assert message.header.frame_id == message.image.header.frame_id == 'left_optical'
    assert (message.f, message.t, message.delta_d) == (200.0, 0.12, 1 / 16)
    assert (message.min_disparity, message.max_disparity) == (0.0, 63.0)
    assert (message.image.encoding, message.image.is_bigendian) == ('32FC1', 0)
    assert (message.image.height, message.image.width, message.image.step) == (80, 100, 400)
    assert isinstance(message.image.data, array)
    assert message.image.data.typecode == 'B'
    np.testing.assert_array_equal(read_values(message.image)[0, :4], [5.0, -1.0, 0.0, 63.0])
    window = message.valid_window
    assert (window.x_offset, window.y_offset, window.width, window.height) == (63, 0, 37, 80)
    assert window.do_rectify is False


def test_the_step_of_a_message_is_the_one_the_matcher_rounds_to():
    assert DISPARITY_STEP == 1 / STEPS
    assert filled([[5.0]], search='paper').delta_d == 1.0


def test_values_limits_and_the_marker_are_all_shifted_by_the_offset():
    message = filled([[5.0, np.nan, 64.0, 60.0]], offset=52.0, disparities=64, min_disparity=2)
    assert (message.min_disparity, message.max_disparity) == (-50.0, 13.0)
    np.testing.assert_array_equal(read_values(message.image), [[-47.0, -51.0, 12.0, 8.0]])


@given(st.lists(st.one_of(st.just(float('nan')), st.floats(-20, 90, width=32)),
                min_size=1, max_size=20),
       st.floats(-60, 60), st.integers(-70, 70), st.integers(1, 64))
def test_a_pixel_reads_as_valid_exactly_where_it_is(values, offset, min_disparity, disparities):
    message = filled([values], offset, min_disparity=min_disparity, disparities=disparities)
    read = read_values(message.image)[0]
    assert np.isfinite(read).all()
    np.testing.assert_array_equal(read >= message.min_disparity, ~np.isnan(values))
    assert (read <= message.max_disparity).all()
    assert message.min_disparity - 1.01 < read.min()


@given(st.integers(-2048, 2048), st.integers(1, 4096), st.integers(1, 300), st.integers(1, 50))
def test_the_valid_window_lies_inside_the_image(min_disparity, disparities, columns, rows):
    window = filled(np.zeros((rows, columns)), min_disparity=min_disparity,
                    disparities=disparities).valid_window
    assert 0 <= window.x_offset <= window.x_offset + window.width <= columns
    assert 0 <= window.y_offset <= window.y_offset + window.height <= rows


@pytest.mark.parametrize('min_disparity, x_offset, width', [
    (0, 9, 91), (5, 14, 86), (-5, 4, 91), (-20, 0, 80), (200, 100, 0), (-200, 0, 0)])
def test_the_valid_window_holds_what_both_cameras_can_see(min_disparity, x_offset, width):
    window = filled(np.zeros((80, 100)), min_disparity=min_disparity, disparities=10).valid_window
    assert (window.x_offset, window.width) == (x_offset, width)


def test_the_valid_window_of_a_filled_image_is_the_whole_image():
    window = filled(np.zeros((80, 100)), disparities=10, fill=True).valid_window
    assert (window.x_offset, window.y_offset, window.width, window.height) == (0, 0, 100, 80)


def test_a_match_is_not_changed_by_sending_it():
    match = made_match([[5.0, np.nan]])
    fill_disparity(message_stand_in(), match, made_pair((1, 2), 3.0), MatcherConfig())
    np.testing.assert_array_equal(match.disparity, np.float32([[5.0, np.nan]]))


def test_confidence_is_sent_as_it_is():
    match = made_match([[5.0, np.nan, 7.0]])
    message = fill_confidence(SimpleNamespace(header=header()), match,
                              made_pair((1, 3)))
    assert (message.encoding, message.step, message.header.frame_id) == (
        '32FC1', 12, 'left_optical')
    assert stamp_of(message.header) == 12_000_000_345
    np.testing.assert_array_equal(read_values(message), [[0.5, 0.0, 0.5]])


def test_ros_1_messages_get_the_baseline_by_its_old_name():
    message = message_stand_in()
    message.T = message.__dict__.pop('t')
    match = made_match([[5.0]])
    fill_disparity(message, match, made_pair((1, 1)), MatcherConfig())
    assert message.T == 0.12


def test_messages_of_ros_are_filled():
    sensor_messages = pytest.importorskip('sensor_msgs.msg')
    stereo_messages = pytest.importorskip('stereo_msgs.msg')
    pair = made_pair((80, 100), -2.0)
    match = made_match(np.full((80, 100), 5.0))
    sent = fill_disparity(stereo_messages.DisparityImage(), match, pair, MatcherConfig())
    assert (sent.f, sent.t, sent.min_disparity) == pytest.approx((200.0, 0.12, 2.0))
    assert (read_values(sent.image) == 7.0).all()
    assert stamp_of(sent.header) == pair.stamp
    assert fill_confidence(sensor_messages.Image(), match, pair).encoding == '32FC1'
