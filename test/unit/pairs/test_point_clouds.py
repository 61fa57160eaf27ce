# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Matches into point clouds, on stand-ins and on ROS's own messages."""
from types import SimpleNamespace

from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.result_messages import fill_points
from message_stand_ins import cloud_stand_in, made_match, make_pair
import numpy as np
import pytest

LAYOUTS = [     # use_color, avoid_point_cloud_padding, point_step, places; as point_cloud_node
    (True, False, 32, {'x': 0, 'y': 4, 'z': 8, 'rgb': 16}),
    (False, False, 16, {'x': 0, 'y': 4, 'z': 8}),
    (True, True, 16, {'x': 0, 'y': 4, 'z': 8, 'rgb': 12}),
    (False, True, 12, {'x': 0, 'y': 4, 'z': 8})]


def filled_points(disparity, left, use_color=True, avoid_point_cloud_padding=False, message=None):
    match = made_match(disparity)
    return fill_points(message or cloud_stand_in(), match, make_pair(left.shape[:2], left=left),
                       SimpleNamespace, use_color=use_color,
                       avoid_point_cloud_padding=avoid_point_cloud_padding)


def read_field(message, name, dtype='<f4'):
    (field,) = [field for field in message.fields if field.name == name]
    return np.ndarray((message.height, message.width), dtype, message.data, field.offset,
                      (message.row_step, message.point_step))


@pytest.mark.parametrize('use_color, avoid_padding, step, places', LAYOUTS)
def test_points_lie_where_those_of_point_cloud_node_lie(use_color, avoid_padding, step, places):
    message = filled_points(np.full((7, 9), 4.0), np.zeros((7, 9), np.uint8), use_color,
                            avoid_padding)
    assert {field.name: field.offset for field in message.fields} == places
    assert {(field.datatype, field.count) for field in message.fields} == {(7, 1)}
    assert (message.height, message.width) == (7, 9)
    assert (message.point_step, message.row_step) == (step, 9 * step)
    assert len(message.data) == 7 * 9 * step
    assert message.data.typecode == 'B'
    assert message.is_bigendian is False
    assert message.is_dense is False
    assert stamp_of(message.header) == 12_000_000_345
    assert message.header.frame_id == 'left_optical'


@pytest.mark.parametrize('use_color, avoid_padding, step, places', LAYOUTS)
def test_points_have_the_depth_and_nan_where_there_is_none(use_color, avoid_padding, step, places):
    disparity = np.float32([[12.0, np.nan, 0.0, -1.0, 24.0]] * 3)
    message = filled_points(disparity, np.full((3, 5), 9, np.uint8), use_color, avoid_padding)
    x, y, z = (read_field(message, name) for name in 'xyz')
    np.testing.assert_array_equal(z, np.float32([[2, np.nan, np.nan, np.nan, 1]] * 3))
    np.testing.assert_allclose(x[0], [-0.5, np.nan, np.nan, np.nan, -0.23], rtol=1e-6)
    np.testing.assert_allclose(y[2], np.float32([2, np.nan, np.nan, np.nan, 1]) * (2 - 40) / 201,
                               rtol=1e-6)


@pytest.mark.parametrize('avoid_padding', [False, True])
@pytest.mark.parametrize('channels', [(), (3,)])
@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_points_have_the_colours_of_the_left_image(dtype, channels, avoid_padding):
    left = np.random.default_rng(1).integers(0, 200, (7, 9, *channels), dtype)
    left[3, 4] = 255
    factor = 1 if dtype == np.uint8 else 16
    message = filled_points(np.full((7, 9), np.nan), left * dtype(factor), True, avoid_padding)
    seen = left.astype(np.uint32)
    blue, green, red = np.moveaxis(seen, -1, 0) if channels else (seen, seen, seen)
    np.testing.assert_array_equal(read_field(message, 'rgb', '<u4'),
                                  red * 0x10000 + green * 0x100 + blue)


def test_padding_of_points_is_zero():
    message = filled_points(np.full((3, 5), 4.0), np.full((3, 5), 77, np.uint8))
    words = np.frombuffer(message.data, '<u4').reshape(3, 5, 8)
    assert not words[:, :, [3, 5, 6, 7]].any()
    assert words[:, :, [0, 1, 2, 4]].all()


def test_points_filled_again_stay_in_their_memory():
    message = filled_points(np.full((3, 5), 4.0), np.full((3, 5), 77, np.uint8))
    data = message.data
    again = filled_points(np.full((3, 5), 8.0), np.full((3, 5), 1, np.uint8), message=message)
    fresh = filled_points(np.full((3, 5), 8.0), np.full((3, 5), 1, np.uint8))
    assert again.data is data
    assert again == fresh


@pytest.mark.parametrize('use_color, avoid_padding, shape', [
    (True, True, (3, 5)), (False, True, (4, 5)), (False, False, (4, 5)), (True, False, (3, 5))])
def test_points_of_another_layout_keep_nothing_of_those_before(use_color, avoid_padding, shape):
    message = filled_points(np.full(shape, 4.0), np.full(shape, 77, np.uint8), use_color,
                            avoid_padding)
    again = filled_points(np.full((3, 5), 4.0), np.full((3, 5), 77, np.uint8), False, False,
                          message)
    assert again == filled_points(np.full((3, 5), 4.0), np.full((3, 5), 77, np.uint8), False,
                                  False)


@pytest.mark.parametrize('use_color, avoid_padding, step, places', LAYOUTS)
def test_points_go_through_ros_and_back(use_color, avoid_padding, step, places):
    sensor_messages = pytest.importorskip('sensor_msgs.msg')
    serialization = pytest.importorskip('rclpy.serialization')
    message = fill_points(
        sensor_messages.PointCloud2(), made_match(np.full((80, 100), 5.0)), make_pair((80, 100)),
        sensor_messages.PointField, use_color=use_color, avoid_point_cloud_padding=avoid_padding)
    read = serialization.deserialize_message(
        serialization.serialize_message(message), sensor_messages.PointCloud2)
    assert read == message
    assert {field.name: field.offset for field in read.fields} == places
    assert (read_field(read, 'z') == np.float32(4.8)).all()
