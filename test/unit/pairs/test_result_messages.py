# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Results of a pair into messages, on stand-ins and on ROS's own messages."""
from array import array
from types import SimpleNamespace

from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.units import STEPS
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.result_messages import (
    DISPARITY_STEP, fill_camera_info, fill_disparity, fill_image, fill_points, one_of_each_voxel)
from hypothesis import given, settings, strategies as st
from made_messages import (
    empty_disparity, empty_message, field_of, made_match, make_pair, region, USUAL_POINTS,
    values_of)
import numpy as np


def filled(disparity, offset=0.0, **config):
    match = made_match(disparity)
    return fill_disparity(empty_disparity(), match, make_pair(match.disparity.shape, offset),
                          MatcherConfig(**config))


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


# ---- matches into point clouds, on stand-ins and on ROS's own messages ----


LAYOUTS = [     # use_color, avoid_point_cloud_padding, point_step, places; as point_cloud_node
    (True, False, 32, {'x': 0, 'y': 4, 'z': 8, 'rgb': 16}),
    (False, False, 16, {'x': 0, 'y': 4, 'z': 8}),
    (True, True, 16, {'x': 0, 'y': 4, 'z': 8, 'rgb': 12}),
    (False, True, 12, {'x': 0, 'y': 4, 'z': 8})]


def filled_points(disparity, left, use_color=True, avoid_point_cloud_padding=False, message=None,
                  **options):
    return fill_points(
        message or empty_message(fields=[], point_step=0, data=array('B')),
        made_match(disparity), make_pair(left.shape[:2], left=left), SimpleNamespace,
        {**USUAL_POINTS, 'use_color': use_color,
         'avoid_point_cloud_padding': avoid_point_cloud_padding, **options})


@settings(max_examples=80)
@given(layout=st.sampled_from(LAYOUTS), stride=st.integers(1, 4), seed=st.integers(0, 999),
       most=st.sampled_from([-1.0, 0.0, 2.0]), dtype=st.sampled_from([np.uint8, np.uint16]),
       channels=st.sampled_from([(), (3,)]), before=st.sampled_from([None, *LAYOUTS]))
def test_points_lie_and_have_colours_as_those_of_point_cloud_node_whatever_was_sent_before(
        layout, stride, seed, most, dtype, channels, before):
    use_color, avoid_padding, step, places = layout
    random = np.random.default_rng(seed)
    disparity = random.choice(np.float32([np.nan, -1, 0, 2.5, 3, 12, 24, 50]), (11, 13))
    left = random.integers(0, 200, (11, 13, *channels), dtype)
    left[::stride, ::stride][1, 1] = 255        # so that 16 bits are of 12
    earlier = before and filled_points(
        np.full((11, 13 - seed % 2), 4.0), np.full((11, 13 - seed % 2), 77, np.uint8), *before[:2],
        points_stride=stride)
    deep = left * dtype(1 if dtype == np.uint8 else 16)
    message, afresh = (filled_points(
        disparity, deep, use_color, avoid_padding, one, points_stride=stride,
        points_max_depth=most) for one in (earlier, None))
    assert message == afresh
    rows, columns = (len(range(0, size, stride)) for size in left.shape[:2])
    assert {field.name: field.offset for field in message.fields} == places
    assert {(field.datatype, field.count) for field in message.fields} == {(7, 1)}
    assert (message.height, message.width, len(message.data)) == (
        rows, columns, rows * columns * step)
    assert (message.point_step, message.row_step) == (step, columns * step)
    assert (message.data.typecode, message.is_bigendian, message.is_dense) == ('B', False, False)
    assert (stamp_of(message.header), message.header.frame_id) == (12_000_000_345, 'left_optical')
    down, across = (place[::stride, ::stride] for place in np.indices(disparity.shape))
    with np.errstate(divide='ignore'):
        depth = 200 * 0.12 / disparity[::stride, ::stride]
    farthest = {0.0: np.inf, 2.0: 2.0, -1.0: 200 * 0.12 / 3}[most]
    depth[~((depth > 0) & (depth < np.inf) & (depth <= farthest))] = np.nan
    for name, expected in (('x', depth * (across - 50) / 200), ('y', depth * (down - 40) / 201),
                           ('z', depth)):
        np.testing.assert_allclose(field_of(message, name), expected, rtol=1e-5)
    if use_color:
        seen = left[::stride, ::stride].astype(np.uint32)
        blue, green, red = np.moveaxis(seen, -1, 0) if channels else (seen, seen, seen)
        np.testing.assert_array_equal(field_of(message, 'rgb', '<u4'),
                                      red * 0x10000 + green * 0x100 + blue)


def test_a_voxel_keeps_the_first_of_its_points_with_its_colour():
    random, size, first = np.random.default_rng(3), 0.25, {}
    disparity = random.choice(np.float32([np.nan, 5, 6, 9, 20, 60]), (41, 53))
    left = random.integers(0, 255, (41, 53, 3), np.uint8)
    message, every = (filled_points(disparity, left, points_voxel_size=one) for one in (size, 0.0))
    for point in np.frombuffer(every.data, '<f4').reshape(-1, 8):
        if np.isfinite(point[2]):
            first.setdefault(tuple(np.floor(point[:3] / np.float32(size))), point)
    assert 10 < len(first) < np.isfinite(disparity).sum() / 2
    assert (message.height, message.width, message.is_dense) == (1, len(first), True)
    assert message.data.tobytes() == np.array([*first.values()]).tobytes()


@given(st.lists(st.tuples(*3 * [st.floats(width=32, allow_nan=False)]), max_size=30),
       st.floats(1e-6, 1e3))
def test_of_any_points_none_is_invented_and_each_voxel_keeps_one(points, size):
    points = np.float32(points).reshape(-1, 3)
    kept = one_of_each_voxel(points, size)
    assert set(map(bytes, kept)) <= set(map(bytes, points))
    assert len(one_of_each_voxel(kept, size)) == len(kept)
    assert bool(len(kept)) == bool(len(points))
