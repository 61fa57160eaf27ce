# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The topics that go out, each made only while it has a subscriber."""
from fuzzy_stereo_ros.node.quality_of_service import output_quality, OVERRIDABLE
from fuzzy_stereo_ros.result_topics import POINTS, ResultMessages, TOPICS
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from stereo_msgs.msg import DisparityImage

# By the name that a bag has for a type.
TYPES = {f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}': kind
         for kind in (CameraInfo, DisparityImage, Image, PointCloud2, PointField)}
LEFT_TO_OTHERS = POINTS     # where stereo_image_proc's point_cloud_node already publishes


class Outputs:
    """The publishers; `publish` may be called by any thread."""

    def __init__(self, node, settings, matched):
        """
        Advertise what the settings ask for.

        settings: of the node, by name. matched(): called when subscribers come or go.
        """
        self._node, self._settings, self._matched = node, settings, matched
        self._messages = ResultMessages(
            lambda kind, **fields: TYPES[kind](**fields), settings)
        self._publishers = {
            topic: self._publisher(TYPES[kind], topic)
            for word in dict.fromkeys(settings['outputs'].split())
            for topic, kind in TOPICS[word]}
        self._told_of_others = False

    def wanted(self):
        """Return whether anything that goes out has a subscriber."""
        return any(self._serves(topic) for topic in self._publishers)

    def publish(self, matched):
        """Publish what has a subscriber of a Matched."""
        for topic, publisher in self._publishers.items():
            if self._serves(topic):
                publisher.publish(self._messages.of(topic, matched))

    def _serves(self, topic):
        publisher = self._publishers[topic]
        if not publisher.get_subscription_count():
            return False
        if topic != LEFT_TO_OTHERS or self._node.count_publishers(publisher.topic_name) == 1:
            return True
        if not self._told_of_others:
            self._told_of_others = True
            self._node.get_logger().warning(
                f'{publisher.topic_name} is published by another node as well and left to it; to '
                'have it from here, with colours at any scale, end the other one')
        return False

    def _publisher(self, kind, topic):
        return self._node.create_publisher(
            kind, topic, output_quality(self._settings),
            event_callbacks=PublisherEventCallbacks(
                matched=lambda event: self._matched(),
                incompatible_qos=lambda event: self._node.get_logger().warning(
                    f'a subscriber of {self._node.resolve_topic_name(topic)} asks for an '
                    f'incompatible QoS ({qos_policy_name_from_kind(event.last_policy_kind)}); '
                    'nothing reaches it; see output_qos')),
            qos_overriding_options=OVERRIDABLE)
