# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Publish the results of matching a pair, each topic only while it has a subscriber."""
from fuzzy_stereo_ros.node.parameters import OVERRIDABLE, qos_profile
from fuzzy_stereo_ros.pairs.result_messages import (
    DISPARITY, METRIC, POINTS, ResultMessages, topics_of)
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField
from stereo_msgs.msg import DisparityImage

UNKNOWN = '_NODE_NAME_UNKNOWN_'     # of a node that is not discovered yet, by ROS
# Message classes by the name of their type in a bag.
TYPES = {f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}': kind
         for kind in (CameraInfo, CompressedImage, DisparityImage, Image, PointCloud2, PointField)}


class Publications:
    """The publishers of the node; `publish` may be called from any thread."""

    def __init__(self, node, settings, on_subscribers):
        """Advertise what the setting `outputs` names; on_subscribers(): called on changes."""
        self._node, self._settings, self._on_subscribers = node, settings, on_subscribers
        self._messages = ResultMessages(lambda kind, **fields: TYPES[kind](**fields), settings)
        self._publishers = {
            topic: self._publisher(TYPES[kind], topic)
            for topic, kind in topics_of(settings['outputs'].split()).items()}
        self._warned = False
        self.left_out = []      # topics with subscribers that cannot be made of the newest pair

    def wanted(self):
        """Return whether any topic has to be published."""
        return any(self._is_wanted(topic) for topic in self._publishers)

    def close(self):
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, matched):
        """Publish the messages of a MatchedPair on the topics with subscribers."""
        self.left_out = [topic for topic in METRIC if topic in self._publishers
                         and self._is_wanted(topic)] * (not matched.pair.calibration.baseline)
        for topic, publisher in self._publishers.items():
            message = self._messages.of(topic, matched) if self._is_wanted(topic) else None
            if message is not None:
                publisher.publish(message)

    def _is_wanted(self, topic):
        """Return whether a topic has subscribers and, if it is the points, no other publisher."""
        publisher = self._publishers[topic]
        if not publisher.get_subscription_count():
            return False
        if topic != POINTS or not self._others_publish(publisher.topic_name):
            return True
        if not self._warned:
            self._warned = True
            self._node.get_logger().warning(
                f'another node publishes {publisher.topic_name}, so this node does not; end the '
                'other node to get the points from here, with colours at any scale')
        return False

    def _others_publish(self, points):
        """Return whether point_cloud_node, or the first by name of several like this, does."""
        if self._node.count_publishers(points) == 1:
            return False
        others, like_this = ({
            (info.node_name, info.node_namespace)
            for info in self._node.get_publishers_info_by_topic(topic)
            if info.node_name != UNKNOWN} for topic in (points, DISPARITY))
        own = self._node.get_name(), self._node.get_namespace()
        return any(one not in like_this or one < own for one in others - {own})

    def _publisher(self, kind, topic):
        return self._node.create_publisher(
            kind, topic, qos_profile(self._settings['output_qos']),
            event_callbacks=PublisherEventCallbacks(
                matched=lambda event: self._on_subscribers(),
                incompatible_qos=lambda event: self._node.get_logger().warning(
                    f'a subscriber of {self._node.resolve_topic_name(topic)} requests an '
                    f'incompatible QoS ({qos_policy_name_from_kind(event.last_policy_kind)}) and '
                    'receives nothing; see output_qos')),
            qos_overriding_options=OVERRIDABLE)
