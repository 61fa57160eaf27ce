# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node that publishes stereo pairs as the drivers of two cameras do."""
from array import array
from functools import partial
from itertools import cycle
import sys

import cv2
from fuzzy_stereo_ros.node.run_node import spin_until_signal
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration, rectified_cameras
from fuzzy_stereo_ros.pairs.messages import (
    encoding_of, fill_camera, fill_pixels, set_stamp)
from fuzzy_stereo_ros.pairs.stereo_pair import SIDES
from fuzzy_stereo_ros.parameters.options import add_options, option_values
from fuzzy_stereo_ros.program import Parser, run_cleanly
from fuzzy_stereo_ros.synthetic.scenes import scene_calibration, scene_pairs, SCENE_PARAMETERS
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import CameraInfo, CompressedImage, Image


class SimulatedCameras(Node):
    """Publishes image_rect and camera_info of both sides; sent: the stamps, ns."""

    exit_code, frame_id = 0, 'left_camera_optical_frame'

    def __init__(self, node_name, focal, baseline, offset=0.0, reliable=False, compressed=False,
                 depth=10, **options):
        """Advertise topics; focal, offset: px; baseline: m; options: of a Node."""
        super().__init__(node_name, **options)
        self.sent = []
        self._focal, self._baseline, self._offset = focal, baseline, offset
        self._message_of = compressed_message if compressed else image_message
        profile = QoSProfile(depth=depth, reliability=(
            ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT))
        kind, suffix = (CompressedImage, '/compressed') if compressed else (Image, '')
        self._outputs = {}
        for side in SIDES:
            self._outputs[f'{side}/camera_info'] = self.create_publisher(
                CameraInfo, f'{side}/camera_info', profile)
            self._outputs[f'{side}/image_rect'] = self.create_publisher(
                kind, f'{side}/image_rect{suffix}', profile)

    def destroy_node(self):
        """Destroy the node and return True, since no thread is left."""
        super().destroy_node()
        return True

    def subscribed(self):
        """Return whether each of the four topics has a subscriber."""
        return all(publisher.get_subscription_count()
                   for publisher in self._outputs.values())

    def publish(self, left, right, stamp=None, change=None):
        """Publish a pair and return its stamp, ns; change({topic: message}) may damage them."""
        if stamp is None:
            stamp = self.get_clock().now().nanoseconds
        messages = {**self.infos(left.shape), **{
            f'{side}/image_rect': self._message_of(image)
            for side, image in zip(SIDES, (left, right))}}
        for message in messages.values():
            set_stamp(message.header, stamp)
            message.header.frame_id = self.frame_id
        if change is not None:
            change(messages)
        for topic, message in messages.items():
            self._outputs[topic].publish(message)
        self.sent.append(stamp)
        return stamp

    def infos(self, shape):
        """Return {topic: CameraInfo} of both cameras for images of a shape, without stamps."""
        calibration = centred_calibration(
            self._focal, self._baseline, self._offset, *shape[:2])
        cameras = rectified_cameras(calibration, *shape[:2])
        return {f'{side}/camera_info': fill_camera(CameraInfo(), camera)
                for side, camera in cameras.items()}


def image_message(image):
    """Return a sensor_msgs/Image of uint8 or uint16, (R, C) or (R, C, 3) BGR; no header."""
    return fill_pixels(Image(), image, encoding_of(image))


def compressed_message(image):
    """Return a PNG as sensor_msgs/CompressedImage, of an image as for `image_message`."""
    return CompressedImage(format='png', data=array('B', cv2.imencode('.png', image)[1].tobytes()))


def main(arguments=None):
    """Publish a moving synthetic scene until SIGINT or SIGTERM; return the exit code."""
    parser = Parser(prog='simulated_cameras', description=(
        'Publish a synthetic scene that moves back and forth before two cameras. '
        '`fuzzy-stereo synthesise` writes the same scene, with its truth, to files.'))
    add_options(parser.add_argument_group('the scene and the cameras'), SCENE_PARAMETERS.values())
    parser.add_argument('--reliable', action='store_true', help='reliable QoS, not best effort')
    arguments = sys.argv if arguments is None else arguments
    parser.set_defaults(run=partial(run, ros_arguments=arguments))
    return run_cleanly(parser, remove_ros_args(arguments)[1:])


def run(arguments, ros_arguments):
    """Publish until a signal ends it; return the exit code. ValueError for a bad scene."""
    values = option_values(arguments, SCENE_PARAMETERS.values())
    scene = [(pair.left, pair.right) for pair in scene_pairs(values)]
    calibration = scene_calibration(values)

    def make_cameras():
        cameras = SimulatedCameras('simulated_cameras', calibration.focal, calibration.baseline,
                                   calibration.offset, arguments.reliable)
        cameras.get_logger().info(f"publishing {values['columns']}x{values['rows']} at "
                                  f"{values['rate']:g} pairs/s")
        pairs = cycle(scene + scene[-2:0:-1])       # back and forth
        cameras.create_timer(1 / values['rate'], lambda: cameras.publish(*next(pairs)),
                             clock=Clock(clock_type=ClockType.STEADY_TIME))
        return cameras

    return spin_until_signal(make_cameras, ros_arguments)


if __name__ == '__main__':
    sys.exit(main())
