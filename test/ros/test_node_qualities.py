# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node's quality of service: one word for inputs, one for outputs, overrides, latches."""
from types import SimpleNamespace

from made_messages import shows
from made_scenes import shifted_pair

SHIFT = 7
PAIR = shifted_pair(SHIFT)
SMALL = ('--ros-args', '-p', 'disparity_range:=16')


def subscribed_with(bench, topic):
    (found,) = bench.listener.get_subscriptions_info_by_topic(topic)
    quality = found.qos_profile
    return quality.reliability.name, quality.durability.name, quality.depth


def published_with(bench, topic):
    found = bench.until(lambda: bench.listener.get_publishers_info_by_topic(topic), topic)
    quality = found[0].qos_profile
    return quality.reliability.name, quality.durability.name


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


def test_an_override_of_one_topic_changes_no_other_one(make_bench):
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import Image
    overrides = ('-p', 'qos_overrides./left/image_rect.subscription.reliability:=reliable',
                 '-p', 'qos_overrides./disparity.publisher.durability:=transient_local',
                 '-p', 'qos_overrides./disparity.publisher.reliability:=reliable')
    with make_bench(*SMALL, '-p', 'output_qos:=sensor_data', *overrides,
                    best_effort=True, reliable=True) as bench:
        bench.collect(Image, 'confidence', bench.confidences, qos_profile_sensor_data)
        bench.connect()
        assert subscribed_with(bench, '/left/image_rect')[:2] == ('RELIABLE', 'VOLATILE')
        assert published_with(bench, '/disparity') == ('RELIABLE', 'TRANSIENT_LOCAL')
        for topic in ('/left/camera_info', '/right/image_rect', '/right/camera_info'):
            assert subscribed_with(bench, topic)[:2] == ('BEST_EFFORT', 'VOLATILE')
        for topic in ('/confidence', '/preview'):
            assert published_with(bench, topic) == ('BEST_EFFORT', 'VOLATILE')
