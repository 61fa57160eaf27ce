# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A stereo rig that is not there: it publishes given pairs as two cameras would."""
import argparse
from array import array
import sys

import cv2
from fuzzy_stereo_ros.made_scenes import made_sequence
import numpy as np
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

ENCODINGS = {(2, 1): 'mono8', (2, 2): 'mono16', (3, 1): 'bgr8', (3, 2): 'bgr16'}
SIDES = ('left', 'right')


class FakeRig(Node):
    """
    Publishes <side>/image_rect and <side>/camera_info of both sides, with equal stamps.

    sent: the stamps published so far, ns. finished: whether the last frame is out.
    """

    def __init__(self, node_name, namespace, frames, focal, baseline, rate, reliable=False,
                 offset=0.0, repeat=False, compressed=False,
                 frame_id='left_camera_optical_frame', **options):
        """
        Advertise the topics; nothing is sent before `start` or `publish`.

        frames: list of (left, right), each uint8 or uint16, (R, C) or (R, C, 3) BGR.
        focal: px. baseline: m. rate: pairs/s. offset: px, cx of the left camera minus that of the
        right one. reliable: QoS of the topics, else best effort as cameras do it.
        repeat: begin again after the last frame, with stamps that go on.
        compressed: send PNG on <side>/image_rect/compressed, not raw images.
        """
        super().__init__(node_name, namespace=namespace, **options)
        self.sent, self.finished = [], False
        self._frames, self._rate, self._repeat = frames, rate, repeat
        self._focal, self._baseline, self._offset = focal, baseline, offset
        self._frame_id, self._next, self._timer = frame_id, 0, None
        self._message_of = compressed_message if compressed else image_message
        profile = QoSProfile(
            history=HistoryPolicy.KEEP_LAST, depth=10,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)
        kind, suffix = (CompressedImage, '/compressed') if compressed else (Image, '')
        self._outputs = {}
        for side in SIDES:
            self._outputs[f'{side}/camera_info'] = self.create_publisher(
                CameraInfo, f'{side}/camera_info', profile)
            self._outputs[f'{side}/image_rect'] = self.create_publisher(
                kind, f'{side}/image_rect{suffix}', profile)

    def subscribed(self):
        """Return whether each of the four topics has a subscriber."""
        return all(publisher.get_subscription_count()
                   for publisher in self._outputs.values())

    def start(self):
        """Publish the frames at the rate from now on, by the steady clock."""
        self._timer = self.create_timer(
            1 / self._rate, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def stop(self):
        """Publish no more frames by itself."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None

    def publish(self, left, right, stamp=None, change=None):
        """
        Publish one pair and return its stamp in ns.

        stamp: ns; None is now. change: called with a dict of the four messages by topic before
        they go out, to damage or remove them for a test.
        """
        if stamp is None:
            stamp = self.get_clock().now().nanoseconds
        messages = {**self.infos(left.shape), **{
            f'{side}/image_rect': self._message_of(image)
            for side, image in zip(SIDES, (left, right))}}
        for message in messages.values():
            message.header.stamp = Time(nanoseconds=stamp).to_msg()
            message.header.frame_id = self._frame_id
        if change is not None:
            change(messages)
        for topic, message in messages.items():
            self._outputs[topic].publish(message)
        self.sent.append(stamp)
        return stamp

    def infos(self, shape):
        """Return {topic: CameraInfo} of both cameras for images of a shape; no stamps."""
        return {f'{side}/camera_info': self._info(side, shape) for side in SIDES}

    def _tick(self):
        if self._next >= len(self._frames):
            self.finished = True
            self.stop()
            return
        self.publish(*self._frames[self._next])
        self._next += 1
        if self._repeat:
            self._next %= len(self._frames)
        self.finished = self._next >= len(self._frames)

    def _info(self, side, shape):
        rows, columns = shape[:2]
        cx = (columns - 1) / 2 - (self._offset if side == 'right' else 0.0)
        cy = (rows - 1) / 2
        tx = -self._focal * self._baseline if side == 'right' else 0.0
        return CameraInfo(
            height=rows, width=columns, distortion_model='plumb_bob', d=[0.0] * 5,
            k=[self._focal, 0.0, cx, 0.0, self._focal, cy, 0.0, 0.0, 1.0],
            r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p=[self._focal, 0.0, cx, tx, 0.0, self._focal, cy, 0.0, 0.0, 0.0, 1.0, 0.0])


def image_message(image):
    """Return a sensor_msgs/Image of uint8 or uint16, (R, C) or (R, C, 3) BGR; no header."""
    image = np.ascontiguousarray(image)
    data = array('B')
    data.frombytes(memoryview(image.astype(image.dtype.newbyteorder('<'), copy=False)).cast('B'))
    return Image(
        height=image.shape[0], width=image.shape[1],
        encoding=ENCODINGS[image.ndim, image.itemsize], is_bigendian=0,
        step=image.nbytes // image.shape[0], data=data)


def compressed_message(image):
    """Return a sensor_msgs/CompressedImage, PNG, of uint8 or uint16, grey or BGR; no header."""
    return CompressedImage(format='png', data=array('B', cv2.imencode('.png', image)[1].tobytes()))


def main(arguments=None):
    """Publish a made scene that moves, for trying the node, until SIGINT; return 0."""
    parser = argparse.ArgumentParser(description='A stereo rig that is not there: a made scene '
                                     'with exact ground truth moves before two cameras.')
    parser.add_argument('--columns', type=int, default=640)
    parser.add_argument('--rows', type=int, default=480)
    parser.add_argument('--disparities', type=int, default=64)
    parser.add_argument('--frames', type=int, default=12, help='shown forth and back')
    parser.add_argument('--rate', type=float, default=30.0, help='pairs per second')
    parser.add_argument('--reliable', action='store_true', help='reliable QoS, not best effort')
    arguments = sys.argv if arguments is None else arguments
    chosen = parser.parse_args(remove_ros_args(arguments)[1:])
    scene = [(pair.left, pair.right) for pair in made_sequence(
        chosen.rows, chosen.columns, chosen.disparities, chosen.frames, pan=2.0, noise=2.0)]
    try:
        rclpy.init(args=arguments)
        rig = FakeRig('fake_rig', '', scene + scene[-2:0:-1], focal=0.9 * chosen.columns,
                      baseline=0.12, rate=chosen.rate, reliable=chosen.reliable, repeat=True)
        rig.get_logger().info(f'publishing {chosen.columns}x{chosen.rows} at {chosen.rate:g} '
                              'pairs/s')
        rig.start()
        rclpy.spin(rig)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:
        if rclpy.ok():      # otherwise it is the end that a message failed of
            raise
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
