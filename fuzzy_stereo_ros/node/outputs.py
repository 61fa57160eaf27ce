# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The topics that go out, each made only while it has a subscriber."""
from fuzzy_stereo_ros.node.quality_of_service import output_quality, OVERRIDABLE
from fuzzy_stereo_ros.pairs.metres import depth_of
from fuzzy_stereo_ros.pairs.result_messages import (
    fill_camera_info, fill_confidence, fill_depth, fill_disparity, fill_points, fill_preview)
from fuzzy_stereo_ros.pictures import colour_disparity
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from stereo_msgs.msg import DisparityImage

# By the word of the parameter `outputs`: topic and type.
TOPICS = {
    'disparity': (('disparity', DisparityImage),),
    'confidence': (('confidence', Image),),
    'depth': (('depth/image_rect', Image), ('depth/camera_info', CameraInfo)),
    'points2': (('points2', PointCloud2),),
    'preview': (('preview', Image),),
}
LEFT_TO_OTHERS = 'points2'      # where stereo_image_proc's point_cloud_node already publishes


class Outputs:
    """The publishers; `publish` may be called by any thread."""

    def __init__(self, node, settings, matched):
        """
        Advertise what the settings ask for.

        settings: of the node, by name. matched(): called when subscribers come or go.
        """
        self._node, self._settings, self._matched = node, settings, matched
        self._publishers = {
            topic: self._publisher(kind, topic)
            for word in settings['outputs'].split() for topic, kind in TOPICS[word]}
        self._cloud = PointCloud2()     # new memory for each would cost more than its points
        self._told_of_others = False

    def wanted(self):
        """Return whether anything that goes out has a subscriber."""
        return any(self._serves(topic) for topic in self._publishers)

    def publish(self, matched):
        """Publish what has a subscriber of a Matched."""
        for topic, publisher in self._publishers.items():
            if self._serves(topic):
                publisher.publish(getattr(self, f"_{topic.replace('/', '_')}")(matched))

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

    def _disparity(self, matched):
        return fill_disparity(DisparityImage(), matched.match, matched.pair, matched.config)

    def _confidence(self, matched):
        return fill_confidence(Image(), matched.match, matched.pair)

    def _depth_image_rect(self, matched):
        depth = depth_of(matched.match.disparity, matched.pair.calibration)
        return fill_depth(Image(), depth, matched.pair, self._settings['depth_encoding'])

    def _depth_camera_info(self, matched):
        return fill_camera_info(CameraInfo(), matched.pair)

    def _points2(self, matched):
        return fill_points(
            self._cloud, matched.match, matched.pair, PointField,
            use_color=self._settings['use_color'],
            avoid_point_cloud_padding=self._settings['avoid_point_cloud_padding'])

    def _preview(self, matched):
        picture = colour_disparity(
            matched.match.disparity, matched.config.min_disparity,
            matched.config.min_disparity + matched.config.disparities - 1)
        return fill_preview(Image(), picture, matched.pair)
