# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Results of a pair into messages, on stand-ins and on ROS's own messages."""
from array import array

from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.units import STEPS
from fuzzy_stereo_ros.pairs.calibration import millimetres_of
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from fuzzy_stereo_ros.pairs.result_messages import (
    DISPARITY_STEP, fill_camera_info, fill_disparity, fill_image)
from hypothesis import given, strategies as st
from made_messages import (
    empty_disparity, empty_message, made_match, make_pair, region, values_of)
import numpy as np


def filled(disparity, offset=0.0, **config):
    match = made_match(disparity)
    return fill_disparity(empty_disparity(), match, make_pair(match.disparity.shape, offset),
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
    np.testing.assert_array_equal(values_of(message.image)[0, :4], [5.0, -1.0, 0.0, 63.0])
    window = message.valid_window
    assert (window.x_offset, window.y_offset, window.width, window.height) == (63, 0, 37, 80)
    assert window.do_rectify is False


def test_the_step_of_a_message_is_the_one_the_matcher_rounds_to():
    assert DISPARITY_STEP == 1 / STEPS
    assert filled([[5.0]], algorithm='paper').delta_d == 1.0
    surfaces = filled([[5.0]], algorithm='quality', min_disparity=-40, disparities=60)
    assert surfaces.delta_d == np.nextafter(np.float32(40), np.float32(41)) - 40


@given(st.lists(st.one_of(st.just(float('nan')), st.floats(-20, 90, width=32)),
                min_size=1, max_size=20),
       st.floats(-60, 60), st.integers(-70, 70), st.integers(1, 64))
def test_a_pixel_reads_as_valid_exactly_where_it_is(values, offset, min_disparity, disparities):
    message = filled([values], offset, min_disparity=min_disparity, disparities=disparities)
    read = values_of(message.image)[0]
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


def test_depth_in_millimetres_is_sent_in_sixteen_bits():
    depth = np.float32([[1.5, np.nan, np.inf, 2.0014, 70.0]] * 2)
    message = fill_image(empty_message(), millimetres_of(depth), make_pair((2, 5)), '16UC1')
    assert (message.encoding, message.height, message.width, message.step) == ('16UC1', 2, 5, 10)
    assert (message.is_bigendian, message.data.typecode) == (0, 'B')
    np.testing.assert_array_equal(read_image(message), [[1500, 0, 0, 2001, 0]] * 2)


@given(st.lists(st.one_of(st.just(float('nan')), st.integers(0, 63 * 16).map(lambda n: n / 16)),
                min_size=1, max_size=30), st.integers(-60000, 60000))
def test_depth_of_a_verged_pair_is_that_of_its_disparity_message(values, thousandths):
    offset = thousandths / 1000
    sent = filled([values], offset)
    disparity = values_of(sent.image)
    depth = fill_image(empty_message(), make_pair(
        (1, len(values)), offset).calibration.depth(np.float32([values])),
        make_pair((1, len(values))), '32FC1')
    expected = np.full(disparity.shape, np.inf)
    np.divide(sent.f * sent.t, disparity, out=expected, where=disparity > 0, dtype=np.float64)
    expected[disparity < sent.min_disparity] = np.nan
    np.testing.assert_allclose(values_of(depth), expected, rtol=3e-7)


def test_a_camera_info_tells_the_projection_of_the_left_image_as_it_is():
    message = fill_camera_info(empty_message(binning_x=0, binning_y=0, roi=region()),
                               make_pair((80, 100)))
    assert (message.height, message.width) == (80, 100)
    assert stamp_of(message.header) == 12_000_000_345
    assert message.header.frame_id == 'left_optical'
    np.testing.assert_array_equal(message.k, [200, 0, 50, 0, 201, 40, 0, 0, 1])
    np.testing.assert_array_equal(message.p, [200, 0, 50, 0, 0, 201, 40, 0, 0, 0, 1, 0])
    np.testing.assert_array_equal(message.r, [1, 0, 0, 0, 1, 0, 0, 0, 1])
    assert (message.distortion_model, list(message.d)) == ('plumb_bob', [0.0] * 5)
    assert (message.binning_x, message.binning_y) == (0, 0)
    assert message.roi == region()
