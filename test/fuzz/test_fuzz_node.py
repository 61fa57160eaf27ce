# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node lives on whatever its topics bring over DDS, counts it, and still matches."""
from array import array
from contextlib import suppress
import time

from bench.soak.events import TOPICS
from bench.soak.promises import (
    broken_sums, faults_of, losses_of, losses_told, whole_numbers)
from drawn_messages import BENT_INFOS, COLUMNS, FILES, FORMATS, IMAGES, INFOS, ROWS
from fuzzed import damages, examples
from hypothesis import given, Phase, settings, strategies as st
from made_messages import compressed, values_of
from made_scenes import shifted_pair
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not importable: no ROS 2 here')
from rclpy.serialization import serialize_message  # noqa: E402, I100
from sensor_msgs.msg import CameraInfo, Image, PointCloud2  # noqa: E402

SHIFT = 3
GOOD = shifted_pair(SHIFT, 24, 40)
PAUSE = 0.01        # s after a pair, so that the next one seldom takes its place
EACH = 'each'
NOT_EMPTY = b'\0'
OTHER_OUTPUTS = {'depth/image_rect': Image, 'depth/camera_info': CameraInfo,
                 'points2': PointCloud2, 'preview': Image}
SMALL = shifted_pair(3, ROWS, COLUMNS)      # as small as what is drawn
DEPTH = 1000        # messages; more than are sent before an answer is awaited
QUEUE_SIZE = 5
OFTEN = 500         # pairs, after which the counts are looked at in between
MOMENTS = st.one_of(st.none(), st.none(), st.just('each'), st.tuples(
    st.integers(-2**31, 2**31 - 1), st.integers(0, 2**32 - 1)))
CAMERA_INFOS = st.one_of(INFOS, BENT_INFOS, BENT_INFOS, damages())
RAW = st.one_of(IMAGES, IMAGES, IMAGES, damages())
FORMED = st.builds(compressed, FILES, FORMATS)
COMPRESSED = st.one_of(FORMED, FORMED, FORMED, damages())


class SpoiltPairs:
    """Sends pairs and counts their messages."""

    # sent: {topic: messages sent while the node was subscribed}. pairs: since the last `settle`.

    def __init__(self, bench):
        """Subscribe to all outputs of the node on a Bench, and have a first pair matched."""
        self._bench, self.sent, self.pairs = bench, dict.fromkeys(TOPICS, 0), 0
        for topic, kind in OTHER_OUTPUTS.items():
            bench.collect(kind, topic, {})
        bench.begin(*GOOD)
        self.match()        # what was sent before it has arrived, too, or never will
        counts = self._counts()
        self.sent = {topic: counts[f'received {topic}'] + counts[f'lost {topic}']
                     for topic in TOPICS}

    def send(self, pair, moment, spoilt):
        # moment: (s, ns), the stamp of all four; None is now; `EACH`, that of each stand-in.
        # spoilt: {topic: stand-in of a message, or a function of its bytes that returns others};
        # what is not there is sound.
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
        assert np.mean(np.abs(found[:, 8:] - SHIFT) < 0.5) > 0.8

    def settle(self):
        """Return the counts of diagnostics when all that was sent has come to something."""
        def settled():
            counts = self._counts()
            return counts if all(
                counts[f'received {topic}'] + counts[f'lost {topic}'] >= sent
                for topic, sent in self.sent.items()) else None

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
    message.header.stamp.sec, message.header.stamp.nanosec = second, nanosecond


def spoilt_pairs(images):
    """Return a strategy of what `SpoiltPairs.send` takes as (moment, spoilt)."""
    drawn = {topic: CAMERA_INFOS if 'info' in topic else images for topic in TOPICS}
    one = st.one_of([st.fixed_dictionaries({topic: what}) for topic, what in drawn.items()])
    some = st.fixed_dictionaries({}, optional=drawn)
    return st.tuples(MOMENTS, st.one_of(one, one, some))


@pytest.mark.parametrize('images, suffix, parameters', [
    (RAW, '', {}),
    (COMPRESSED, '/compressed', {
        'image_transport': 'compressed', 'rectify': 'true', 'crop': 'true'})],
    ids=['raw', 'compressed and rectified'])
def test_whatever_the_topics_bring_is_counted_and_the_next_sound_pair_is_matched(
        make_bench, images, suffix, parameters):
    depths = {f"qos_overrides./{topic}{suffix if 'image' in topic else ''}.subscription.depth":
              DEPTH for topic in TOPICS}
    values = {'disparity_range': 8, 'queue_size': QUEUE_SIZE, **parameters, **depths}
    with make_bench('--ros-args', *(word for name, value in values.items()
                                    for word in ('-p', f'{name}:={value}')),
                    depth=DEPTH, compressed=bool(suffix)) as bench:
        cameras = SpoiltPairs(bench)

        def counts_that_add_up():
            counts = cameras.settle()
            assert broken_sums({**counts, 'queue_size': QUEUE_SIZE}, cameras.sent) == []
            return counts

        # A node that has died fails whatever follows: the first example is the one to be told.
        @settings(examples(50), phases=[Phase.explicit, Phase.generate])
        @given(spoilt_pairs(images))
        def any_pair(drawn):
            mark = bench.node.mark()
            cameras.send(SMALL, *drawn)
            cameras.match()
            assert not faults_of(bench.node.log(mark))
            if cameras.pairs > OFTEN:
                counts_that_add_up()

        any_pair()
        counts = counts_that_add_up()
        assert counts['pairs rejected'] > 0     # how many is a matter of chance
        assert bench.node.finish() == 0
        assert not faults_of(bench.node.log())
        assert losses_told(bench.node.log()) == losses_of(counts)
