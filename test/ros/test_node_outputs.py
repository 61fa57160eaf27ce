# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the real node publishes besides disparity and confidence, and that nobody pays unasked."""

import cv2
from fuzzy_stereo_ros.pairs.messages import read_image
from made_messages import values_of
from made_scenes import shifted_pair
import numpy as np
import pytest

SHIFT, OFFSET = 7, 3.0
PAIR = shifted_pair(SHIFT)
ARGUMENTS = '-p', 'disparity_range:=16', '-p', 'no_pair_seconds:=600.0'
RIG = {'offset': OFFSET}    # of the principal points
DEPTH = 200.0 * 0.12 / (SHIFT - OFFSET)     # m; the simulated cameras's focal length and baseline


def answer(bench, kind, topic):
    """Return a disparity, and the message of another topic that came of the same pair."""
    messages = {}
    bench.collect(kind, topic, messages)

    def both():
        stamps = set(messages) & set(bench.disparities)
        return max(stamps) if stamps else bench.rig.publish(*PAIR) and None

    stamp = bench.until(both, f'{topic} and disparity of one pair')
    bench.listener.destroy_subscription(bench.subscriptions.pop())
    return bench.disparities[stamp], messages[stamp]


def test_depth_is_metres_of_the_disparity_and_nan_where_it_is_invalid(bench):
    from sensor_msgs.msg import Image
    disparity, depth = answer(bench, Image, 'depth/image_rect')
    assert (depth.encoding, depth.header) == ('32FC1', disparity.header)
    published = values_of(disparity.image)
    valid = published >= disparity.min_disparity
    expected = np.where(valid & (published > 0), disparity.f * disparity.t / np.where(
        published > 0, published, 1), np.inf)
    expected[~valid] = np.nan
    np.testing.assert_allclose(values_of(depth), expected, rtol=1e-5)
    assert np.nanmedian(values_of(depth)[:, 15:]) == pytest.approx(DEPTH, rel=0.05)


def test_what_is_compressed_shows_the_same_in_fewer_bytes(bench):
    from sensor_msgs.msg import CompressedImage
    disparity, depth = answer(bench, CompressedImage, 'depth/image_rect/compressedDepth')
    assert (depth.format, depth.header) == ('16UC1; compressedDepth png', disparity.header)
    sent = cv2.imdecode(np.frombuffer(depth.data[12:], np.uint8), cv2.IMREAD_UNCHANGED)
    published = values_of(disparity.image)
    seen = (published >= disparity.min_disparity) & (published > 0)
    millimetres = 1000 * disparity.f * disparity.t / published[seen]
    np.testing.assert_allclose(sent[seen], np.where(millimetres < 65535, millimetres, 0), atol=0.6)
    disparity, preview = answer(bench, CompressedImage, 'preview/compressed')
    assert (preview.format, preview.header) == ('bgr8; jpeg compressed bgr8', disparity.header)
    assert read_image(preview).shape == (60, 120, 3)
    assert len(preview.data) < 60 * 120


def test_points_that_another_node_publishes_are_left_to_it_and_nothing_is_subscribed(bench):
    from sensor_msgs.msg import PointCloud2
    other = bench.listener.create_publisher(PointCloud2, 'points2', 1)
    bench.leave()
    bench.until(lambda: not bench.rig.subscribed(), 'the node takes its subscriptions back')
    bench.counts()
    assert bench.status.message == 'idle: no output has a subscriber'
    mark, messages = bench.node.mark(), {}
    bench.collect(PointCloud2, 'points2', messages)
    bench.node.logged('another node publishes /points2, so this node does not', mark)
    bench.until(lambda: not bench.rig.subscribed(), 'the node stays without subscriptions')
    bench.listener.destroy_publisher(other)
    bench.until(lambda: bench.rig.publish(*PAIR) and messages, 'points of this node')
    bench.leave()
    bench.listen()
    bench.first_match(*PAIR)


def test_only_what_outputs_names_is_advertised_as_its_parameters_say(make_bench):
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import Image, PointCloud2
    from stereo_msgs.msg import DisparityImage
    with make_bench('--ros-args', *ARGUMENTS, *(word for value in (
            'outputs:=disparity depth depth_compressed points2', 'depth_encoding:=16UC1',
            'points_stride:=4', 'points_voxel_size:=0.05') for word in ('-p', value)),
                    **RIG) as bench:
        bench.begin(*PAIR, confidence=False)
        _, depth = answer(bench, Image, 'depth/image_rect')
        assert depth.encoding == '16UC1'
        millimetres = np.frombuffer(depth.data, '<u2').reshape(60, 120)
        assert np.median(millimetres[:, 15:]) == pytest.approx(1000 * DEPTH, rel=0.05)
        offered = {name for name, _ in bench.listener.get_publisher_names_and_types_by_node(
            'disparity_node', '/')}
        assert offered - {'/rosout', '/parameter_events', '/diagnostics'} == {
            '/disparity', '/depth/image_rect', '/depth/camera_info',
            '/depth/image_rect/compressedDepth', '/points2'}
        _, cloud = answer(bench, PointCloud2, 'points2')
        assert (cloud.height, cloud.is_dense) == (1, True)
        assert 0 < cloud.width <= 15 * 30
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        bench.collect(DisparityImage, 'disparity', {}, latched)
        bench.node.logged('a subscriber of /disparity requests an incompatible QoS (DURABILITY)')
