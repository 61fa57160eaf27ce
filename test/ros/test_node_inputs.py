# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node with inputs of other kinds: stamps apart, compressed, other QoS, no clock."""
from functools import partial

import cv2
from made_messages import shows
from made_scenes import shifted_pair
from node_process import START
import numpy as np
from raw_camera import COLUMNS, FOCAL, RawCamera, ROWS

SHIFT = 7
PAIR = shifted_pair(SHIFT)
SMALL = ('--ros-args', '-p', 'disparity_range:=16', '-p', 'no_pair_seconds:=1.0')
MILLISECOND = 1_000_000


def test_cameras_that_stamp_a_millisecond_apart_are_matched_with_a_tolerance(make_bench):
    def right_is_late(messages):
        for topic in ('right/image_rect', 'right/camera_info'):
            messages[topic].header.stamp.nanosec += MILLISECOND

    with make_bench(*SMALL, '-p', 'approximate_sync:=true', '-p',
                    'approximate_sync_tolerance_seconds:=0.005') as bench:
        bench.begin(*PAIR)
        stamps = [1000 * 1000 * MILLISECOND + frame * 33 * MILLISECOND for frame in range(4)]
        bench.rig.publish(*PAIR, stamps[0], right_is_late)
        for before, stamp in zip(stamps, stamps[1:]):
            # a pair comes out when the next one shows that it is the nearest
            bench.rig.publish(*PAIR, stamp, right_is_late)
            answered = partial(bench.disparities.get, before)
            assert shows(bench.until(answered, 'the pair before'), SHIFT)


def remapped(*rules):
    """Return the words for a node's remappings 'from:=to'."""
    return [word for rule in rules for word in ('-r', rule)]


BOTH_IMAGES = [f'{side}/image_rect:=/cam/{side}/image_rect' for side in ('left', 'right')]


def test_a_camera_info_that_is_not_remapped_follows_its_image_and_one_that_is_does_not(make_bench):
    with make_bench(*SMALL, *remapped(*BOTH_IMAGES, '/cam/right/camera_info:=/r'), cli_args=[
            '--ros-args', *remapped('__ns:=/cam', 'right/camera_info:=/r')]) as bench:
        assert shows(bench.begin(*PAIR), SHIFT)


def test_a_camera_info_that_does_not_lie_beside_its_image_is_reported_as_derived(make_bench):
    with make_bench(*SMALL, *remapped(*BOTH_IMAGES), cli_args=[
            '--ros-args', *remapped(*BOTH_IMAGES)]) as bench:
        bench.listen()
        bench.node.logged('ready', timeout=START)
        bench.until(lambda: bench.rig.publish(*PAIR)
                    and 'no stereo pair for' in bench.node.log(), 'the report')
        report = bench.node.logged('no stereo pair for')
        assert '/cam/left/camera_info (derived from /cam/left/image_rect) 0' in report
        assert 'no node publishes /cam/left/camera_info, /cam/right/camera_info: ' in report


def test_compressed_images_are_matched(make_bench):
    with make_bench(*SMALL, '-p', 'image_transport:=compressed', compressed=True) as bench:
        assert shows(bench.begin(*PAIR), SHIFT)
        colour = [np.repeat(image[:, :, None], 3, 2) for image in PAIR]
        assert shows(bench.match(*colour), SHIFT)


def test_what_the_middleware_loses_in_a_flood_is_counted_and_logged(make_bench):
    depth = 'qos_overrides./left/image_rect.subscription.depth:=1'
    topic = 'left/image_rect'
    with make_bench(*SMALL, '-p', depth, depth=1000) as bench:
        bench.begin(*PAIR)
        before, counts, sent = bench.counts(), {}, 0

        def lost():
            nonlocal sent
            for _ in range(50):
                bench.rig.publish(*PAIR)
            bench.match(*PAIR)
            sent += 51
            counts.update({key: int(value) - int(before.get(key, 0))
                           for key, value in bench.counts().items() if value.isdecimal()})
            assert counts[f'received {topic}'] + counts[f'lost {topic}'] == sent
            return counts[f'lost {topic}']

        bench.until(lost, 'a queue of one message overflows')
        assert ' since the last report ' in bench.node.logged(f' lost {topic}')


def test_an_incompatible_qos_is_named(make_bench):
    reliable = 'qos_overrides./right/image_rect.subscription.reliability:=reliable'
    with make_bench(*SMALL, '-p', reliable, best_effort=True) as bench:
        bench.listen()
        bench.node.logged('a publisher of /right/image_rect offers an incompatible QoS '
                          '(reliability)', timeout=START)
        bench.until(lambda: bench.rig.publish(*PAIR)
                    and 'no stereo pair for' in bench.node.log(), 'the report')
        report = bench.node.logged('no stereo pair for')
        assert '/right/image_rect 0, /right/camera_info ' in report
        assert ('/right/image_rect is offered with an incompatible QoS (reliability): set '
                'qos_overrides./right/image_rect.subscription.reliability') in report


def test_raw_images_are_rectified_and_cut_to_what_both_cameras_see(make_bench):
    cameras = [RawCamera(turn=(0.02, 0.03, -0.01)),
               RawCamera(turn=(-0.02, 0.01, 0.02), right=0.12, centre=(160.0, 118.0))]
    pair = shifted_pair(SHIFT, ROWS, COLUMNS)
    blurred = [cv2.GaussianBlur(image, (0, 0), 1.5) for image in pair]
    raw = [camera.raw(image) for camera, image in zip(cameras, blurred)]

    def calibrate(messages):
        for side, camera in zip(('left', 'right'), cameras):
            made, info = camera.info(), messages[f'{side}/camera_info']
            for name in ('height', 'width', 'distortion_model', 'd', 'k', 'r', 'p'):
                setattr(info, name, getattr(made, name))

    with make_bench(*SMALL, '-p', 'rectify:=true', '-p', 'crop:=true') as bench:
        bench.listen()
        bench.connect()
        bench.first_match(*raw)     # not calibrated yet: as it is
        message = bench.match(*raw, change=calibrate)
        assert message.f == FOCAL
        assert 0.7 * ROWS < message.image.height < ROWS
        assert 0.7 * COLUMNS < message.image.width < COLUMNS
        assert shows(message, SHIFT)
