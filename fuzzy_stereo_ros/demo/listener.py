# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Publish a sequence to the node, take in what it makes of it, and count."""
import time

from diagnostic_msgs.msg import DiagnosticArray
from fuzzy_stereo_ros.demo.table import Phase
from fuzzy_stereo_ros.pairs.messages import stamp_of
import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future
from sensor_msgs.msg import Image
from stereo_msgs.msg import DisparityImage

NOT_MATCHED = ('pairs dropped', 'pairs refused')  # keys of the node's diagnostics


class DemoListener(Node):
    """
    Listens to `disparity_node`, and says when a rig shall publish the next pair.

    confidence: float32 (R, C), 0 to 1, of the newest message; None before.
    news: when a pair last went out, came back or was at work, by time.monotonic().
    """

    def __init__(self, rig, sequence, namespace):
        """Subscribe; rig: SimulatedCameras, sequence: MotorcycleWindow, namespace: of all."""
        super().__init__('demo_listener', namespace=namespace)
        self._node = f'{namespace}/disparity_node'
        self.confidence, self.news = None, time.monotonic()
        self._rig, self._sequence = rig, sequence
        self._not_matched, self._phase, self._timer = 0, None, None
        self._newest_disparity, self._newest_confidence = None, None  # stamps
        self._parameters = AsyncParameterClient(self, self._node)
        self.create_subscription(DisparityImage, 'disparity', self._receive, 10)
        self.create_subscription(Image, 'confidence', self._take_confidence, 10)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._count, 10)

    def play(self, name, frames, rate, progress=lambda phase: None):
        """
        Have frames 0 to frames - 1 of the sequence published, rate a second, and listen.

        Return a Future, done when every pair came back or was counted by the node: its result is
        a `Phase` and a list of (frame number, disparity), disparity float32 (R, C), pixels of
        the images, NaN = invalid. progress(phase) is called when a pair went out or came back.
        """
        self._phase, self._done = Phase(name), Future()
        self._frames, self._progress = frames, progress
        self._sent, self._received, self._not_matched_before = {}, [], self._not_matched
        self.news = time.monotonic()
        self._timer = self.create_timer(1 / rate, self._publish_next,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        return self._done

    def end(self):
        """End the phase; pairs that it still waits for are lost."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None
        if not self._done.done():
            self._done.set_result((self._phase, self._received))

    def has_both(self):
        """Return whether disparity and confidence of the same pair came last."""
        return self._newest_disparity == self._newest_confidence

    def change_parameter(self, name, value):
        """Return a Future of the node's answer to a change of one of its parameters."""
        return self._parameters.set_parameters([Parameter(name, value=value)])

    def _publish_next(self):
        number = self._phase.published
        if number == self._frames:
            return
        if not number:
            self._start = time.monotonic()
        shown = self._sequence.frame(number)
        self._sent[self._rig.publish(shown.left, shown.right)] = number
        self._phase.published += 1
        self.news = time.monotonic()
        self._progress(self._phase)

    def _receive(self, message):
        now = self.get_clock().now().nanoseconds
        stamp = self._newest_disparity = stamp_of(message.header)
        if self._phase is None or self._done.done() or stamp not in self._sent:
            return
        self.news = time.monotonic()
        self._phase.latencies.append(1e-9 * (now - stamp))
        self._phase.seconds = self.news - self._start
        self._received.append((self._sent.pop(stamp), self._disparity(message)))
        self._progress(self._phase)
        self._end_if_complete()

    def _disparity(self, message):
        """Return x_left - x_right; the message's values are smaller by the sequence's offset."""
        values = _floats(message.image)
        values[values < message.min_disparity] = np.nan
        return values + np.float32(self._sequence.offset)

    def _take_confidence(self, message):
        self.confidence, self._newest_confidence = _floats(message), stamp_of(message.header)

    def _count(self, message):
        for status in message.status:
            if status.name == f'{self._node}: stereo matching':
                values = {entry.key: entry.value for entry in status.values}
                self._not_matched = sum(int(values[name]) for name in NOT_MATCHED)
                if int(values['pairs waiting']):  # the one at work is among them
                    self.news = time.monotonic()
        self._end_if_complete()

    def _end_if_complete(self):
        phase = self._phase
        if phase is None or self._done.done():
            return
        phase.dropped = self._not_matched - self._not_matched_before
        if phase.published == self._frames and phase.lost <= 0:
            self.end()


def _floats(image):
    """Return a copy of a 32FC1 image: float32 (R, C)."""
    return np.frombuffer(image.data, '<f4').reshape(image.height, image.width).copy()
