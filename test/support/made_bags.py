# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of a small made rig, of ROS 1 and ROS 2, written with rosbags alone; and their content."""
from contextlib import contextmanager
from functools import cache

import cv2
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
from made_messages import values_of
import numpy as np
import pytest

pytest.importorskip('rosbags', reason='rosbags is not installed: no bags here')
from rosbags.convert.converter import default_message  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402
from rosbags.rosbag1 import Writer as Writer1  # noqa: E402
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2  # noqa: E402
from rosbags.typesys import get_typestore, Stores  # noqa: E402

FORMATS = 'ros1', 'sqlite3', 'mcap'
ROWS, COLUMNS, DISPARITIES = 48, 96, 16
FOCAL, BASELINE = 200.0, 0.12
BEGIN, STEP = 1_000_000_000_000, 33_333_333         # ns
LATER = 7_000_000       # ns, from the stamp of a message to its recording
TOPICS = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')


class BagOf:
    """A bag that is being written; a context manager."""

    def __init__(self, path, form='mcap'):
        """Begin a bag: a file for ros1, else a folder."""
        self.is_ros_1 = form == 'ros1'
        self.typestore = get_typestore(Stores.ROS1_NOETIC if self.is_ros_1 else Stores.ROS2_JAZZY)
        self.writer = Writer1(path) if self.is_ros_1 else Writer2(
            path, version=9, storage_plugin=StoragePlugin[form.upper()])
        self.writer.open()
        self._connections = {}

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.writer.close()

    def make(self, kind, stamp=None, **values):
        """Return a message; stamp: ns, of its header."""
        message = default_message(self.typestore, kind)
        if stamp is not None:
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            message.header.frame_id = 'left_optical'
        for name, value in values.items():
            setattr(message, name if hasattr(message, name) else name.upper(), value)
        return message

    def write(self, topic, message, log_time, **options):
        """Write a message; options: of the connection."""
        content = (self.typestore.serialize_ros1 if self.is_ros_1
                   else self.typestore.serialize_cdr)(message, message.__msgtype__)
        self.write_content(topic, message.__msgtype__, content, log_time, **options)

    def write_content(self, topic, kind, content, log_time, **options):
        """Write the bytes of a message."""
        if topic not in self._connections:
            self._connections[topic] = self.writer.add_connection(
                topic, kind, typestore=self.typestore, **options)
        self.writer.write(self._connections[topic], log_time, content)

    def image(self, pixels, stamp):
        """Return an Image of uint8 (R, C) or (R, C, 3) BGR."""
        return self.make('sensor_msgs/msg/Image', stamp, height=pixels.shape[0],
                         width=pixels.shape[1], step=pixels.nbytes // pixels.shape[0],
                         encoding='mono8' if pixels.ndim == 2 else 'bgr8', data=pixels.ravel())

    def compressed(self, pixels, stamp):
        """Return a CompressedImage, PNG."""
        return self.make('sensor_msgs/msg/CompressedImage', stamp, format='png',
                         data=cv2.imencode('.png', pixels)[1].ravel())

    def info(self, side, shape, stamp, offset=0.0):
        """Return a CameraInfo; offset: px, cx of the left camera minus that of the right one."""
        rows, columns = shape[:2]
        cx, cy = (columns - 1) / 2 - (offset if side == 'right' else 0), (rows - 1) / 2
        tx = -FOCAL * BASELINE if side == 'right' else 0.0
        return self.make(
            'sensor_msgs/msg/CameraInfo', stamp, height=rows, width=columns,
            distortion_model='plumb_bob', d=np.zeros(5),
            k=np.array([FOCAL, 0, cx, 0, FOCAL, cy, 0, 0, 1]), r=np.eye(3).ravel(),
            p=np.array([FOCAL, 0, cx, tx, 0, FOCAL, cy, 0, 0, 0, 1, 0]))


@cache
def scene(frames=6, rows=ROWS, columns=COLUMNS, disparities=DISPARITIES, **options):
    """Return made pairs that stay but for noise, so that a warm start matters; only to be read."""
    return tuple(make_sequence(rows, columns, disparities, frames, seed=5,
                               **{'noise': 6.0, **options}))


def stamps(frames=6):
    """Return the stamps of the frames of `write_bag`, ns."""
    return [BEGIN + number * STEP for number in range(frames)]


def write_bag(path, form='mcap', pairs=None, topics=TOPICS, image=BagOf.image, infos=True,
              change=None, more=None, first=0):
    """
    Write a bag of pairs with equal stamps, each message recorded a little after its stamp.

    topics: left image and info, right image and info. image(bag, pixels, stamp): makes a message.
    change(number, messages): may change {topic: message} of a pair, or remove some.
    more(bag, number, log_time): may write what stands before a pair. first: number of the first.
    """
    pairs = scene() if pairs is None else pairs
    with BagOf(path, form) as bag:
        for number, pair in enumerate(pairs, first):
            stamp = BEGIN + number * STEP
            if more is not None:
                more(bag, number, stamp)
            messages = {topics[0]: image(bag, pair.left, stamp),
                        topics[2]: image(bag, pair.right, stamp)}
            if infos:
                messages[topics[1]] = bag.info('left', pair.left.shape, stamp)
                messages[topics[3]] = bag.info('right', pair.right.shape, stamp)
            if change is not None:
                change(number, messages)
            for place, (topic, message) in enumerate(messages.items()):
                log_time = stamp + LATER + place
                if isinstance(message, bytes):
                    bag.write_content(topic, 'sensor_msgs/msg/Image', message, log_time)
                else:
                    bag.write(topic, message, log_time)
    return path


def name_of(form):
    """Return a name for a bag of a format."""
    return 'bag.bag' if form == 'ros1' else form


def file_of(bag):
    """Return the file with the messages of a bag that has one."""
    return bag if bag.is_file() else next(bag.glob('*.[md][cb]*'))


@contextmanager
def open_bag(path):
    """Give an AnyReader of a bag."""
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        yield reader


def write_torn_bag(path, pairs, number, form, skipped, length):
    """Write a bag of pairs, with bytes overwritten from the left image of a pair on."""
    # skipped: bytes before those; length: how many.
    file = file_of(write_bag(path, form, pairs))
    whole = file.read_bytes()
    place = whole.index(pairs[number].left.tobytes()[:64]) + skipped
    file.write_bytes(whole[:place] + b'\xff' * length + whole[place + length:])


def content(path, topic=None):
    """Return [(topic, log_time, message)] of a bag, or of one topic of it."""
    with open_bag(path) as reader:
        return [(connection.topic, log_time, reader.deserialize(raw, connection.msgtype))
                for connection, log_time, raw in reader.messages()
                if topic in (None, connection.topic)]


def disparities(path):
    """Return {stamp: float32 (R, C), px} of the DisparityImages of a bag, in its order."""
    return {stamp_of(message.header): values_of(message.image)
            for _, _, message in content(path, '/disparity')}


def same(one, other):
    """Return whether two messages are the same in each field, bit for bit."""
    if hasattr(one, '__dataclass_fields__'):
        return all(same(getattr(one, name), getattr(other, name))
                   for name in one.__dataclass_fields__)
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.tobytes() == other.tobytes()
    return one == other
