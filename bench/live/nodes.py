# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node to compare `disparity_node` with: plain, around OpenCV's 3WAY on all cores."""
from array import array
import sys

import cv2
from fuzzy_stereo_ros.node.run_node import run_node
from fuzzy_stereo_ros.pairs.messages import stamp_of
import numpy as np
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import CameraInfo, Image
from stereo_msgs.msg import DisparityImage

BLOCK = 3
KEPT = 5    # messages of a topic, as the QoS keeps them


class PlainNode(Node):
    """Matches pairs of bgr8 images with equal stamps, in the thread of the executor."""

    exit_code = 0

    def __init__(self):
        """Subscribe to the images and the right camera_info, with the QoS of `disparity_node`."""
        super().__init__('plain_node')
        self._disparities = self.declare_parameter('disparity_range', 64).value
        self._matcher = cv2.StereoSGBM_create(
            0, self._disparities, BLOCK, 8 * BLOCK**2, 32 * BLOCK**2,
            mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY)
        self._kept, self._info = {}, None
        self._publisher = self.create_publisher(DisparityImage, 'disparity', QoSProfile(depth=1))
        for topic, kind, receive in (
                ('left/image_rect', Image, lambda message: self._receive(0, message)),
                ('right/image_rect', Image, lambda message: self._receive(1, message)),
                ('right/camera_info', CameraInfo, self._note_info)):
            self.create_subscription(kind, topic, receive, qos_profile_sensor_data)

    def destroy_node(self):
        """Destroy the node; return True, as it has no thread of its own."""
        super().destroy_node()
        return True

    def _note_info(self, message):
        self._info = message

    def _receive(self, side, message):
        stamp = stamp_of(message.header)
        pair = self._kept.setdefault(stamp, [None, None])
        pair[side] = message
        if None not in pair and self._info is not None:
            del self._kept[stamp]
            self._match(*pair)
        while len(self._kept) > KEPT:
            del self._kept[min(self._kept)]

    def _match(self, *pair):
        grey = [cv2.cvtColor(np.frombuffer(image.data, np.uint8).reshape(
            image.height, image.width, 3), cv2.COLOR_BGR2GRAY) for image in pair]
        disparity = self._matcher.compute(*grey).astype(np.float32) / 16
        header, focal = pair[0].header, self._info.p[0]
        rows, columns = disparity.shape
        self._publisher.publish(DisparityImage(
            header=header, f=focal, t=-self._info.p[3] / focal, min_disparity=0.0,
            max_disparity=self._disparities - 1.0, delta_d=1 / 16,
            image=Image(header=header, height=rows, width=columns, encoding='32FC1',
                        step=4 * columns, data=array('B', disparity.tobytes()))))


if __name__ == '__main__':
    sys.exit(run_node(PlainNode, sys.argv))
