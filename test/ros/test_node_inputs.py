# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node with inputs of other kinds: stamps apart, compressed, remapped, other QoS."""
from functools import partial
from types import SimpleNamespace

import cv2
from made_messages import shows
from made_scenes import shifted_pair
from node_process import START
import numpy as np
import pytest
from raw_camera import COLUMNS, FOCAL, RawCamera, ROWS

SHIFT = 7
PAIR = shifted_pair(SHIFT)
SMALL = ('--ros-args', '-p', 'disparity_range:=16')
MILLISECOND = 1_000_000
BOTH_IMAGES = [f'{side}/image_rect:=/cam/{side}/image_rect' for side in ('left', 'right')]


def remapped(*rules):
    """Return the words for a node's remappings 'from:=to'."""
    return [word for rule in rules for word in ('-r', rule)]


def test_compressed_images_are_matched_and_those_a_millisecond_apart_with_a_tolerance(make_bench):
    def right_is_late(messages):
        for topic in ('right/image_rect', 'right/camera_info'):
            messages[topic].header.stamp.nanosec += MILLISECOND

    with make_bench(*SMALL, '-p', 'image_transport:=compressed', '-p', 'approximate_sync:=true',
                    '-p', 'approximate_sync_tolerance_seconds:=0.005', compressed=True) as bench:
        bench.begin(*PAIR)
        stamps = [1000 * 1000 * MILLISECOND + frame * 33 * MILLISECOND for frame in range(4)]
        colour = [np.repeat(image[:, :, None], 3, 2) for image in PAIR]
        bench.rig.publish(*PAIR, stamps[0], right_is_late)
        for before, stamp in zip(stamps, stamps[1:]):
            # a pair comes out when the next one shows that it is the nearest
            bench.rig.publish(*colour, stamp, right_is_late)
            answered = partial(bench.disparities.get, before)
            assert shows(bench.until(answered, 'the pair before'), SHIFT)


@pytest.fixture(scope='module')
def renamed(make_bench):
    """Return a node whose images and right calibration are renamed, with a queue of one image."""
    with make_bench(
            *SMALL, *remapped(*BOTH_IMAGES, '/cam/right/camera_info:=/r'), '-p',
            'qos_overrides./cam/left/image_rect.subscription.depth:=1', depth=1000,
            cli_args=['--ros-args', *remapped('__ns:=/cam', 'right/camera_info:=/r')]) as bench:
        bench.listen()
        bench.connect()
        yield bench


def test_a_camera_info_that_is_not_remapped_follows_its_image_and_one_that_is_does_not(renamed):
    assert shows(renamed.first_match(*PAIR), SHIFT)


def test_what_the_middleware_loses_in_a_flood_is_counted_and_logged(renamed):
    topic = 'left/image_rect'
    renamed.first_match(*PAIR)
    before, counts, sent = renamed.counts(), {}, 0

    def lost():
        nonlocal sent
        for _ in range(50):
            renamed.rig.publish(*PAIR)
        renamed.match(*PAIR)
        sent += 51
        counts.update({key: int(value) - int(before.get(key, 0))
                       for key, value in renamed.counts().items() if value.isdecimal()})
        assert counts[f'received {topic}'] + counts[f'lost {topic}'] == sent
        return counts[f'lost {topic}']

    renamed.until(lost, 'a queue of one message overflows')
    assert ' since the last report ' in renamed.node.logged(f' lost {topic}')


def test_what_keeps_pairs_from_coming_is_named_a_derived_camera_info_and_an_incompatible_qos(
        make_bench):
    reliability = 'qos_overrides./cam/right/image_rect.subscription.reliability'
    with make_bench(*SMALL, *remapped(*BOTH_IMAGES), '-p', f'{reliability}:=reliable', '-p',
                    'no_pair_seconds:=1.0', best_effort=True,
                    cli_args=['--ros-args', *remapped(*BOTH_IMAGES)]) as bench:
        bench.listen()
        bench.node.logged('a publisher of /cam/right/image_rect offers an incompatible QoS '
                          '(reliability)', timeout=START)
        bench.until(lambda: bench.rig.publish(*PAIR)
                    and 'no stereo pair for' in bench.node.log(), 'the report')
        report = bench.node.logged('no stereo pair for')
        assert '/cam/left/camera_info (derived from /cam/left/image_rect) 0' in report
        assert 'no node publishes /cam/left/camera_info, /cam/right/camera_info: ' in report
        assert '/cam/right/image_rect 0, /cam/right/camera_info ' in report
        assert ('/cam/right/image_rect is offered with an incompatible QoS (reliability): set '
                f'{reliability}') in report


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
        bench.begin(*raw)       # not calibrated yet: as it is
        message = bench.match(*raw, change=calibrate)
        assert message.f == FOCAL
        assert 0.7 * ROWS < message.image.height < ROWS
        assert 0.7 * COLUMNS < message.image.width < COLUMNS
        assert shows(message, SHIFT)


# ---- quality of service ----


def test_use_system_default_qos_leaves_the_inputs_to_the_middleware(ros):
    from fuzzy_stereo_ros.node.subscriptions import INPUT_TOPICS, Subscriptions
    from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
    from rclpy.qos import QoSPresetProfiles
    for settings in ({'use_system_default_qos': True, 'input_qos': 'sensor_data'},
                     {'use_system_default_qos': False, 'input_qos': 'system_default'}):
        asked = []
        Subscriptions(
            SimpleNamespace(  # called at once
                create_subscription=lambda *of, **_: asked.append(of[3]),  # noqa: B023
                resolve_topic_name=lambda topic, **_: topic),
            {**settings, 'image_transport': 'raw', 'cache_camera_info': False},
            Synchroniser(INPUT_TOPICS), None).update(True)
        assert asked == 4 * [QoSPresetProfiles.SYSTEM_DEFAULT.value]


def test_calibrations_published_once_are_used_for_every_pair_and_latched_outputs_stay(make_bench):
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import CameraInfo
    from stereo_msgs.msg import DisparityImage
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with make_bench(*SMALL, '-p', 'cache_camera_info:=true', '-p',
                    'output_qos:=latched') as bench:
        infos = bench.rig.infos(PAIR[0].shape)
        publishers = [bench.listener.create_publisher(CameraInfo, topic, latched)
                      for topic in infos]
        for publisher, info in zip(publishers, infos.values()):
            publisher.publish(info)
        bench.listen()
        bench.connect()

        def without_infos(messages):
            for topic in infos:
                del messages[topic]

        def answered():
            bench.rig.publish(*PAIR, change=without_infos)
            return bench.disparities

        assert shows(bench.until(answered, 'disparities').popitem()[1], SHIFT)
        assert bench.match(*PAIR, change=without_infos).f == 200.0
        late = {}
        bench.collect(DisparityImage, 'disparity', late, latched)
        bench.until(lambda: late, 'the disparity from before')
        assert 'WARN' not in bench.node.log()
