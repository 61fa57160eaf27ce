# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Publish the results of a pair, each topic only while it has a subscriber."""
from fuzzy_stereo_ros.node.parameters import OVERRIDABLE, quality_of
from fuzzy_stereo_ros.pairs.result_messages import POINTS, ResultMessages, TOPICS
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from stereo_msgs.msg import DisparityImage

# By the name that a bag has for a type.
TYPES = {f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}': kind
         for kind in (CameraInfo, DisparityImage, Image, PointCloud2, PointField)}
SHARED = POINTS     # stereo_image_proc's point_cloud_node publishes it, too


class Publications:
    """The publishers; `publish` may be called by any thread."""

    def __init__(self, node, settings, subscribers_changed):
        """
        Advertise the topics of the setting `outputs`.

        settings: of the node, by name. subscribers_changed(): called when subscribers come or go.
        """
        self._node, self._settings, self._changed = node, settings, subscribers_changed
        self._messages = ResultMessages(lambda kind, **fields: TYPES[kind](**fields), settings)
        self._publishers = {
            topic: self._publisher(TYPES[kind], topic)
            for word in dict.fromkeys(settings['outputs'].split())
            for topic, kind in TOPICS[word]}
        self._warned = False

    def wanted(self):
        """Return whether any topic has a subscriber."""
        return any(self._serves(topic) for topic in self._publishers)

    def close(self):
        """Advertise no longer."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, matched):
        """Publish the topics with a subscriber, made of a MatchedPair."""
        for topic, publisher in self._publishers.items():
            message = self._messages.of(topic, matched) if self._serves(topic) else None
            if message is not None:
                publisher.publish(message)

    def _serves(self, topic):
        publisher = self._publishers[topic]
        if not publisher.get_subscription_count():
            return False
        if topic != SHARED or self._node.count_publishers(publisher.topic_name) == 1:
            return True
        if not self._warned:
            self._warned = True
            self._node.get_logger().warning(
                f'another node publishes {publisher.topic_name}, too, and this node leaves it to '
                'that one; end the other node to get the points from here, with colours at any '
                'scale')
        return False

    def _publisher(self, kind, topic):
        return self._node.create_publisher(
            kind, topic, quality_of(self._settings['output_qos'], depth=1),
            event_callbacks=PublisherEventCallbacks(
                matched=lambda event: self._changed(),
                incompatible_qos=lambda event: self._node.get_logger().warning(
                    f'a subscriber of {self._node.resolve_topic_name(topic)} asks for an '
                    f'incompatible QoS ({qos_policy_name_from_kind(event.last_policy_kind)}); '
                    'nothing reaches it; see output_qos')),
            qos_overriding_options=OVERRIDABLE)
