# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node, in its own process, over real DDS: what comes out for what goes in."""
import re

from fuzzy_stereo_ros.pairs.messages import stamp_of
from made_messages import shows, values_of
from made_scenes import shifted_pair
import numpy as np
import pytest

SHIFT = 7
PAIR = shifted_pair(SHIFT)
SECOND = 1_000_000_000
ARGUMENTS = '-p', 'disparity_range:=16', '-p', 'no_pair_seconds:=1.0'


@pytest.mark.quick
def test_a_pair_gives_its_disparity_with_every_field_right(bench):
    message = bench.match(*PAIR, stamp=1234 * SECOND + 5)
    assert stamp_of(message.header) == stamp_of(message.image.header) == 1234 * SECOND + 5
    assert message.header.frame_id == message.image.header.frame_id == 'left_camera_optical_frame'
    assert (message.image.height, message.image.width, message.image.step) == (60, 120, 480)
    assert (message.image.encoding, message.image.is_bigendian) == ('32FC1', 0)
    assert (message.f, message.t) == pytest.approx((200.0, 0.12))
    assert (message.min_disparity, message.max_disparity, message.delta_d) == (0.0, 15.0, 1 / 16)
    window = message.valid_window
    assert (window.x_offset, window.y_offset, window.width, window.height) == (15, 0, 105, 60)
    assert not window.do_rectify
    values = values_of(message.image)
    assert np.isfinite(values).all()
    assert shows(message, SHIFT)
    invalid = values < message.min_disparity
    assert (values[invalid] == message.min_disparity - 1).all()
    assert (values[~invalid] <= message.max_disparity).all()
    assert (values % message.delta_d == 0).all()


def test_confidence_comes_with_the_stamp_of_the_pair(bench):
    message = bench.match(*PAIR)
    stamp = stamp_of(message.header)
    confidence = bench.until(lambda: bench.confidences.get(stamp), 'confidence')
    assert confidence.header == message.header
    assert confidence.encoding == '32FC1'
    values, disparity = values_of(confidence), values_of(message.image)
    assert values.shape == disparity.shape
    assert not np.isnan(values).any()
    assert 0 <= values.min() <= values.max() <= 1
    assert (values[disparity < message.min_disparity] == 0).all()
    assert values[disparity >= message.min_disparity].mean() > 0.2


def test_without_a_baseline_disparities_come_without_metres_and_a_warning(bench):
    from diagnostic_msgs.msg import DiagnosticStatus
    from ros_bench import uncalibrate
    from sensor_msgs.msg import PointCloud2
    points, mark = {}, bench.node.mark()
    bench.collect(PointCloud2, 'points2', points)
    bench.until(lambda: points or bench.rig.publish(*PAIR) and None, 'points of calibrated pairs')
    for _ in range(2):
        message = bench.match(*PAIR, change=uncalibrate)
        assert (message.f, message.t) == (1.0, 0.0)
        assert shows(message, SHIFT)
        stamp = stamp_of(message.header)
        bench.until(lambda: stamp in bench.confidences, 'confidence')  # noqa: B023
    bench.counts()
    assert bench.status.level == DiagnosticStatus.WARN
    assert 'points2 cannot be made, though asked for: the baseline is 0 m' in bench.status.message
    last = stamp_of(bench.match(*PAIR).header)
    bench.until(lambda: last in points, 'points of the pair after them')
    assert stamp not in points
    assert bench.node.log(mark).count('the baseline is 0 m, as P[3] of the right camera_in') == 1
    bench.listener.destroy_subscription(bench.subscriptions.pop())
    bench.match(*PAIR, change=uncalibrate)
    bench.counts()
    assert 'cannot be made' not in bench.status.message


@pytest.mark.parametrize('change, sentence', [
    (lambda messages: messages['right/camera_info'].p.__setitem__(3, 24.0),
     'the baseline is -0.12 m: left and right are swapped'),
    (lambda messages: [setattr(messages[f'{side}/image_rect'], 'width', 8) for side in (
        'left', 'right')], '16 disparities are more than the 8 columns'),
])
def test_a_bad_pair_is_logged_and_survived(bench, change, sentence):
    rejected = bench.rig.publish(*PAIR, change=change)
    bench.until(lambda: sentence in bench.node.log(), sentence)
    message = bench.match(*PAIR)
    assert rejected not in bench.disparities
    assert shows(message, SHIFT)


def test_bad_pairs_that_keep_coming_are_counted_and_logged_once_in_five_seconds(bench):
    mark, before = bench.node.mark(), bench.counts()

    def since(key):
        return int(bench.counts()[key]) - int(before[key])

    def spoil(messages):
        messages['left/image_rect'].encoding = 'flow'

    def logged():
        return [float(when) for when in re.findall(
            r"\[(\d+\.\d+)\][^\n]*pair rejected: left image: encoding is 'flow'",
            bench.node.log(mark))]

    number = 0
    while len(logged()) < 2:
        number += 1
        bench.rig.publish(*PAIR, change=spoil)
        bench.until(lambda: since('pairs rejected') == number, 'it is counted')  # noqa: B023
        bench.node.logged("pair rejected: left image: encoding is 'flow'", mark)
    first, second = logged()[:2]
    assert second - first > 4
    bench.match(*PAIR)
    assert (since('pairs synchronised'), since('pairs matched')) == (number + 1, 1)
    assert int(bench.counts()['rejected: encoding']) >= number
    assert ' pairs rejected since the last report ' in bench.node.log()


def test_without_a_subscriber_nothing_is_subscribed_and_each_return_is_served(bench):
    for _ in range(2):
        bench.leave()
        bench.until(lambda: not bench.rig.subscribed(), 'the node takes its subscriptions back')
        bench.counts()
        assert bench.status.message == 'idle: no output has a subscriber'
        bench.listen(disparity=False)
        bench.until(bench.rig.subscribed, 'the node subscribes again')
        bench.confidences.clear()
        bench.until(lambda: bench.rig.publish(*PAIR) and bench.confidences, 'confidence alone')
        bench.listen(confidence=False)
        bench.first_match(*PAIR)


def test_the_report_when_no_pair_comes_says_what_is_missing(bench):
    def another_moment_in_the_right_camera(messages):
        for topic in ('right/image_rect', 'right/camera_info'):
            messages[topic].header.stamp.nanosec ^= 1

    line = ''
    while '/left/image_rect 1, /left/camera_info 1, /right/image_rect 1' not in line:
        mark = bench.node.mark()    # on a busy machine a report may come before what is missing
        bench.match(*PAIR)
        bench.rig.publish(*PAIR, change=another_moment_in_the_right_camera)
        line = bench.node.logged('no stereo pair for', mark)
    assert 'the latest stamps differ by up to 0.000 ms' in line
    assert 'set approximate_sync' in line
    bench.match(*PAIR)


# ---- what stereo_image_proc gets wrong ----


def test_cameras_with_frames_and_focal_lengths_of_their_own_are_matched_in_the_left_frame(bench):
    def differ(messages):
        for topic in ('right/image_rect', 'right/camera_info'):
            messages[topic].header.frame_id = 'right_camera_optical_frame'
        messages['left/camera_info'].header.frame_id = 'somewhere_else'
        messages['left/camera_info'].p[0] = 201.0

    mark = bench.node.mark()
    message = bench.match(*PAIR, change=differ)
    assert message.header.frame_id == 'left_camera_optical_frame'
    assert message.f == 200.0
    bench.node.logged('fx is 201 in the left and 200 in the right camera_info', mark)
