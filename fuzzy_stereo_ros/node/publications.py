# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Publish the results of matching a pair, each topic only while it has a subscriber."""
from fuzzy_stereo_ros.node.parameters import OVERRIDABLE, qos_profile
from fuzzy_stereo_ros.pairs.result_messages import POINTS, ResultMessages, TOPICS
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from stereo_msgs.msg import DisparityImage

# Message classes by the name of their type in a bag.
TYPES = {f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}': kind
         for kind in (CameraInfo, DisparityImage, Image, PointCloud2, PointField)}


class Publications:
    """The publishers of the node; `publish` may be called from any thread."""

    def __init__(self, node, settings, on_subscribers):
        """
        Advertise the topics that the setting `outputs` names.

        settings: {name: value} of the node. on_subscribers(): called when the number of
        subscribers changes.
        """
        self._node, self._settings, self._on_subscribers = node, settings, on_subscribers
        self._messages = ResultMessages(lambda kind, **fields: TYPES[kind](**fields), settings)
        self._publishers = {
            topic: self._publisher(TYPES[kind], topic)
            for word in dict.fromkeys(settings['outputs'].split())
            for topic, kind in TOPICS[word]}
        self._warned = False

    def wanted(self):
        """Return whether any topic has to be published."""
        return any(self._is_wanted(topic) for topic in self._publishers)

    def close(self):
        """Destroy the publishers."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, matched):
        """Publish the messages of a MatchedPair on the topics with subscribers."""
        for topic, publisher in self._publishers.items():
            message = self._messages.of(topic, matched) if self._is_wanted(topic) else None
            if message is not None:
                publisher.publish(message)

    def _is_wanted(self, topic):
        """Return whether a topic has subscribers and, if it is the points, no other publisher."""
        publisher = self._publishers[topic]
        if not publisher.get_subscription_count():
            return False
        # stereo_image_proc's point_cloud_node publishes the points, too.
        if topic != POINTS or self._node.count_publishers(publisher.topic_name) == 1:
            return True
        if not self._warned:
            self._warned = True
            self._node.get_logger().warning(
                f'another node publishes {publisher.topic_name}, so this node does not; end the '
                'other node to get the points from here, with colours at any scale')
        return False

    def _publisher(self, kind, topic):
        return self._node.create_publisher(
            kind, topic, qos_profile(self._settings['output_qos'], depth=1),
            event_callbacks=PublisherEventCallbacks(
                matched=lambda event: self._on_subscribers(),
                incompatible_qos=lambda event: self._node.get_logger().warning(
                    f'a subscriber of {self._node.resolve_topic_name(topic)} requests an '
                    f'incompatible QoS ({qos_policy_name_from_kind(event.last_policy_kind)}) and '
                    'receives nothing; see output_qos')),
            qos_overriding_options=OVERRIDABLE)
