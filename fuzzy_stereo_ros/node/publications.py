# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Publish the results of matching a pair, each topic only while it has a subscriber."""
import time

from fuzzy_stereo_ros.node.parameters import OVERRIDABLE, qos_profile
from fuzzy_stereo_ros.pairs.result_messages import METRIC, POINTS, ResultMessages, topics_of
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import NodeNameNonExistentError
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField
from stereo_msgs.msg import DisparityImage

# Services of each node of this package, by which it is told from others.
OWN_SERVICES = 'reset', 'save'
ANNOUNCED = 1.0     # s, in which a new node tells others all that it has
# Message classes by the name of their type in a bag.
TYPES = {f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}': kind
         for kind in (CameraInfo, CompressedImage, DisparityImage, Image, PointCloud2, PointField)}


class Publications:
    """The publishers of the node; `publish` may be called from any thread."""

    def __init__(self, node, settings, on_subscribers):
        """Advertise what the setting `outputs` names; on_subscribers(): called on changes."""
        self._node, self._settings, self._on_subscribers = node, settings, on_subscribers
        self._messages = ResultMessages(lambda kind, **fields: TYPES[kind](**fields), settings)
        self._own_points, self._since = (), {}      # endpoints of publishers of the points
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
        """
        Return whether another node publishes the topic of the points.

        That is stereo_image_proc's point_cloud_node, or of several nodes of this package the one
        with the least endpoint: they decide alike, so that one of them does publish.
        """
        if self._node.count_publishers(points) == 1:
            return False
        others = {tuple(info.endpoint_gid): info
                  for info in self._node.get_publishers_info_by_topic(points)}
        others.pop(self._own_points, None)
        now = time.monotonic()
        self._since = {endpoint: self._since.get(endpoint, now) for endpoint in others}
        return any(endpoint < self._own_points or (
            now - self._since[endpoint] > ANNOUNCED and not self._is_disparity_node(info))
            for endpoint, info in others.items())

    def _is_disparity_node(self, info):
        name = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
        try:
            services = dict(self._node.get_service_names_and_types_by_node(
                info.node_name, info.node_namespace))
        except NodeNameNonExistentError:    # it has just ended
            return False
        return {f'{name}/{service}' for service in OWN_SERVICES} <= set(services)

    def _publisher(self, kind, topic):
        before = self._endpoints(topic)
        publisher = self._node.create_publisher(
            kind, topic, qos_profile(self._settings['output_qos'], depth=1),
            event_callbacks=PublisherEventCallbacks(
                matched=lambda event: self._on_subscribers(),
                incompatible_qos=lambda event: self._node.get_logger().warning(
                    f'a subscriber of {self._node.resolve_topic_name(topic)} requests an '
                    f'incompatible QoS ({qos_policy_name_from_kind(event.last_policy_kind)}) and '
                    'receives nothing; see output_qos')),
            qos_overriding_options=OVERRIDABLE)
        if topic == POINTS:     # rclpy does not tell which endpoint is its own
            self._own_points = next(iter(self._endpoints(topic) - before), ())
        return publisher

    def _endpoints(self, topic):
        """Return the endpoints of the publishers that nodes of this name have: set of tuples."""
        return {tuple(info.endpoint_gid)
                for info in self._node.get_publishers_info_by_topic(topic)
                if (info.node_name, info.node_namespace) == (
                    self._node.get_name(), self._node.get_namespace())}
