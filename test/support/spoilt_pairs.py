# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cameras that send pairs with anything in their messages to the node on a bench, and count."""
from array import array
from contextlib import suppress
import time

from node_process import shifted_pair, values_of
import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from soak_figures import is_under_way, whole_numbers
from soak_script import TOPICS

SHIFT = 3
GOOD = shifted_pair(SHIFT, 24, 40)
PAUSE = 0.01        # s after a pair, so that the next one seldom takes its place
EACH = 'each'
NOT_EMPTY = b'\0'
OTHER_OUTPUTS = {'depth/image_rect': Image, 'depth/camera_info': CameraInfo,
                 'points2': PointCloud2, 'preview': Image}


class SpoiltPairs:
    """
    Sends pairs and counts their messages.

    sent: {topic: messages sent while the node was subscribed}. pairs: since the last `settle`.
    """

    def __init__(self, bench):
        """Subscribe to all outputs of the node on a Bench, and have a first pair matched."""
        self._bench, self.sent, self.pairs = bench, dict.fromkeys(TOPICS, 0), 0
        bench.listen()
        for topic, kind in OTHER_OUTPUTS.items():
            bench.collect(kind, topic, {})
        bench.connect()
        bench.first_match(*GOOD)
        self.match()        # what was sent before it has arrived, too, or never will
        counts = self._counts()
        self.sent = {topic: counts[f'received {topic}'] + counts[f'lost {topic}']
                     for topic in TOPICS}

    def send(self, pair, moment, spoilt):
        """
        Send a pair of images.

        moment: (s, ns), the stamp of all four; None is now; `EACH`, that of each stand-in.
        spoilt: {topic: stand-in of a message, or a function of its bytes that returns others};
        what is not there is sound.
        """
        def spoil(messages):
            if moment not in (None, EACH):
                for message in messages.values():
                    stamp(message, *moment)
            for topic, what in spoilt.items():
                if callable(what):
                    # After one of no bytes Fast DDS delivers nothing more of its publisher.
                    messages[topic] = what(serialize_message(messages[topic])) or NOT_EMPTY
                else:
                    put(what, messages[topic], moment == EACH)
            self._count(messages)

        self._bench.rig.publish(*pair, change=spoil)
        self.pairs += 1
        next_one = time.monotonic() + PAUSE
        while (rest := next_one - time.monotonic()) > 0:
            self._bench.executor.spin_once(timeout_sec=rest)

    def match(self):
        """Send a sound pair and see that it is matched."""
        found = values_of(self._bench.match(*GOOD, change=self._count).image)
        assert np.mean(np.abs(found[:, 8:] - SHIFT) < 0.5) > 0.9

    def settle(self):
        """Return the counts of diagnostics when all that was sent has come to something."""
        def settled():
            counts = self._counts()
            return None if is_under_way(counts, self.sent) else counts

        self.pairs = 0
        return self._bench.until(settled, f'{self.sent} are received or lost')

    def _count(self, messages):
        for topic in messages:
            self.sent[topic] += 1

    def _counts(self):
        return whole_numbers(self._bench.counts())


def put(drawn, message, stamped):
    """Give a ROS message the fields of a stand-in, as far as its type can hold them."""
    for name, value in vars(drawn).items():
        if name == 'header':
            message.header.frame_id = value.frame_id
            if stamped:
                stamp(message, value.stamp.sec, value.stamp.nanosec)
        elif name == 'roi':
            message.roi = type(message.roi)(**vars(value))
        elif name == 'data':
            message.data = array('B', value)
        else:
            with suppress(AssertionError):      # k, r and p have one length
                setattr(message, name, [*map(float, value)] if name in 'dkrp' else value)


def stamp(message, second, nanosecond):
    """Give a message a stamp."""
    message.header.stamp.sec, message.header.stamp.nanosec = second, nanosecond
