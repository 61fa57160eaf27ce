# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A process that publishes a pair of image files at 10 Hz, as stereo_image_proc's test does it."""
import sys

import cv2
from fuzzy_stereo_ros.node.simulated_cameras import image_message
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import CameraInfo, Image

P = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def main(files):
    """Publish both images with a CameraInfo that has no more than its size and P."""
    rclpy.init()
    node = rclpy.create_node('image_publisher')
    messages = {}
    for side, file in zip(('left', 'right'), files):
        image = cv2.imread(file)
        info = CameraInfo(height=image.shape[0], width=image.shape[1], p=P)
        messages[node.create_publisher(Image, f'{side}/image_rect', 1)] = image_message(image)
        messages[node.create_publisher(CameraInfo, f'{side}/camera_info', 1)] = info

    def publish():
        now = node.get_clock().now().to_msg()
        for publisher, message in messages.items():
            message.header.stamp = now
            publisher.publish(message)

    node.create_timer(0.1, publish)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main(sys.argv[1:])
