# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Under which topics, and as which messages, what came of a pair goes out, live and to a bag."""
from fuzzy_stereo_ros.pairs.metres import depth_of
from fuzzy_stereo_ros.pairs.result_messages import (
    fill_camera_info, fill_confidence, fill_depth, fill_disparity, fill_points, fill_preview)
from fuzzy_stereo_ros.views.pictures import colour_disparity

DISPARITY, POINTS = 'disparity', 'points2'
POINT_FIELD = 'sensor_msgs/msg/PointField'
# By the word of the parameter `outputs`: topics and their types.
TOPICS = {
    'disparity': ((DISPARITY, 'stereo_msgs/msg/DisparityImage'),),
    'confidence': (('confidence', 'sensor_msgs/msg/Image'),),
    'depth': (('depth/image_rect', 'sensor_msgs/msg/Image'),
              ('depth/camera_info', 'sensor_msgs/msg/CameraInfo')),
    'points2': ((POINTS, 'sensor_msgs/msg/PointCloud2'),),
    'preview': (('preview', 'sensor_msgs/msg/Image'),),
}


class ResultMessages:
    """Makes the message of a topic; what is made of points uses the same memory again."""

    def __init__(self, make, settings):
        """
        Make nothing yet.

        make(type name, **fields): returns a message, empty but for the fields.
        settings: depth_encoding, use_color and avoid_point_cloud_padding, by name.
        """
        self._make, self._settings = make, settings
        self._cloud = None      # new memory for each would cost more than its points

    def of(self, topic, matched):
        """Return the message of one of the `TOPICS` for a Matched."""
        return getattr(self, f"_{topic.replace('/', '_')}")(matched)

    def _disparity(self, matched):
        return fill_disparity(self._make('stereo_msgs/msg/DisparityImage'), matched.match,
                              matched.pair, matched.config)

    def _confidence(self, matched):
        return fill_confidence(self._make('sensor_msgs/msg/Image'), matched.match, matched.pair)

    def _depth_image_rect(self, matched):
        depth = depth_of(matched.match.disparity, matched.pair.calibration)
        return fill_depth(self._make('sensor_msgs/msg/Image'), depth, matched.pair,
                          self._settings['depth_encoding'])

    def _depth_camera_info(self, matched):
        return fill_camera_info(self._make('sensor_msgs/msg/CameraInfo'), matched.pair)

    def _points2(self, matched):
        if self._cloud is None:
            self._cloud = self._make('sensor_msgs/msg/PointCloud2')
        return fill_points(
            self._cloud, matched.match, matched.pair, self._point_field,
            use_color=self._settings['use_color'],
            avoid_point_cloud_padding=self._settings['avoid_point_cloud_padding'])

    def _point_field(self, **fields):
        return self._make(POINT_FIELD, **fields)

    def _preview(self, matched):
        picture = colour_disparity(
            matched.match.disparity, matched.config.min_disparity,
            matched.config.min_disparity + matched.config.disparities - 1)
        return fill_preview(self._make('sensor_msgs/msg/Image'), picture, matched.pair)
