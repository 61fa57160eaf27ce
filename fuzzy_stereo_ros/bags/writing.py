# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A bag of ROS 2 in parts that are closed whole.

A part becomes a file of the bag, and is listed in metadata.yaml, once it is complete: whatever
ends the writing, the folder holds a bag, and a part that was not closed is lost.
"""
from array import array
from collections import Counter
from contextlib import closing, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
import shutil
import sqlite3

from fuzzy_stereo_ros.bags.reading import NO_ROSBAGS, text_of
from fuzzy_stereo_ros.pairs.camera_files import rectified_cameras
from fuzzy_stereo_ros.pairs.image_files import write_whole
import numpy as np

SUFFIXES = {'mcap': '.mcap', 'sqlite3': '.db3'}
FORMATS = tuple(SUFFIXES)
METADATA = 'metadata.yaml'
CONTENT = 'rosbag2_bagfile_information'     # the one entry of metadata.yaml
UNFINISHED = 'unfinished'   # folder in the bag's folder, where a part is while it is written
ENCODINGS = {(2, 1): 'mono8', (2, 2): 'mono16', (3, 1): 'bgr8', (3, 2): 'bgr16'}
FRAME = 'left_camera_optical_frame'
START = 1_700_000_000_000_000_000   # ns, the first stamp: any will do, but 0, which is no stamp
PART_BYTES = 2**28          # a part is closed beyond: the most that a killed process loses


class BagWriter:
    """
    Writes a bag into a folder, in one thread; a bag that is there is continued.

    counts: Counter of messages by topic. last: ns, when the newest was logged, None before the
    first. Both are of all parts, and after a failure of those that are closed.
    """

    def __init__(self, folder, storage='mcap'):
        """
        Read what is in the bag already; nothing is written yet.

        storage: one of `FORMATS`. Raises ValueError where metadata.yaml is damaged.
        """
        self._folder, self._storage = Path(folder), storage
        self._writer, self._connections, self._size, self._failed = None, {}, 0, False
        self._closed = read_description(self._folder)
        self._count_closed()

    def write(self, topic, kind, typestore, content, logged, qualities=()):
        """
        Write a message.

        kind, typestore: of rosbags, the type and where its definition is. content: bytes, CDR.
        logged: ns, never less than that of the message before. qualities: list of rosbags' Qos.
        Raises OSError where it cannot be written; the parts closed before are then a bag.
        """
        self._guard(self._write, topic, kind, typestore, content, logged, qualities)

    def commit(self):
        """Allow the part to end here, after messages that belong together; OSError as `write`."""
        if self._size > PART_BYTES:
            self.close()

    def close(self):
        """Close the part that is being written, if any; OSError as `write`."""
        self._guard(self._close)

    def _guard(self, action, *arguments):
        """Call what writes; where it fails, give up the open part and write nothing more."""
        if self._failed:
            return
        try:
            action(*arguments)
        except (OSError, sqlite3.Error) as error:
            self._failed = True
            with suppress(OSError, sqlite3.Error):
                self._writer.abort()
            shutil.rmtree(self._folder / UNFINISHED, ignore_errors=True)
            self._count_closed()
            raise OSError(f'{self._folder} cannot be written any further: {text_of(error)}') \
                from error

    def _write(self, topic, kind, typestore, content, logged, qualities):
        if self._writer is None:
            self._open()
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=typestore, offered_qos_profiles=qualities)
        self._writer.write(self._connections[topic], logged, content)
        self._size += len(content)
        self.counts[topic] += 1
        self.last = logged

    def _open(self):
        from rosbags.rosbag2 import StoragePlugin, Writer

        shutil.rmtree(self._folder / UNFINISHED, ignore_errors=True)    # of a killed process
        number = len(self._closed['files']) if self._closed else 0
        name = f'{self._folder.resolve().name}_{number}'    # `.` has no name of its own
        self._writer = Writer(self._folder / UNFINISHED / name, version=Writer.VERSION_LATEST,
                              storage_plugin=StoragePlugin[self._storage.upper()])
        self._writer.open()

    def _close(self):
        import yaml     # only for those who write bags

        if self._writer is None:
            return
        self._writer.close()
        part = self._writer.path
        description = _joined(self._closed, read_description(part))
        file = f'{part.name}{SUFFIXES[self._storage]}'
        (part / file).replace(self._folder / file)
        write_whole(self._folder / METADATA, yaml.safe_dump(
            {CONTENT: description}, sort_keys=False).encode())
        shutil.rmtree(self._folder / UNFINISHED)
        self._writer, self._connections, self._size = None, {}, 0
        self._closed = description

    def _count_closed(self):
        self.counts, self.last = Counter(), None
        if self._closed is not None:
            self.counts.update({topic['topic_metadata']['name']: topic['message_count']
                                for topic in self._closed['topics_with_message_count']})
            self.last = _extent(self._closed)[1]


def read_description(folder):
    """Return what metadata.yaml of a bag says, None where there is none; ValueError if damaged."""
    import yaml

    path = Path(folder) / METADATA
    if not path.exists():
        return None
    try:
        description = yaml.safe_load(path.read_bytes())[CONTENT]
        _joined(description, description)
    except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f'{path} is damaged: {text_of(error)}') from error
    return description


def _joined(one, other):
    """Return the description of a bag with the parts of two; one: None, or a description."""
    if one is None:
        return other
    first, last = (choose(ends) for choose, ends in zip(
        (min, max), zip(_extent(one), _extent(other))))
    topics = {}
    for topic in (*one['topics_with_message_count'], *other['topics_with_message_count']):
        name = topic['topic_metadata']['name']
        before = topics.get(name, {'message_count': 0})['message_count']
        topics[name] = {**topic, 'message_count': before + topic['message_count']}
    return {**one, 'starting_time': {'nanoseconds_since_epoch': first},
            'duration': {'nanoseconds': last - first},
            'topics_with_message_count': list(topics.values()),
            **{name: one[name] + other[name]
               for name in ('message_count', 'relative_file_paths', 'files')}}


def _extent(description):
    """Return when the first and the last message of a bag were logged, ns."""
    first = description['starting_time']['nanoseconds_since_epoch']
    return first, first + description['duration']['nanoseconds']


class Messages:
    """Messages of ROS 2 Jazzy as rosbags has them: made empty, filled by others, made bytes."""

    def __init__(self):
        """Load the types; ValueError where rosbags is not installed."""
        try:
            from rosbags.typesys import get_typestore, Stores
        except ImportError:
            raise ValueError(NO_ROSBAGS) from None

        self.typestore = get_typestore(Stores.ROS2_JAZZY)

    def make(self, kind, **values):
        """Return a message of a type, as `sensor_msgs/msg/Image`, empty but for the values."""
        from rosbags.convert.converter import default_message

        message = default_message(self.typestore, kind)
        for name, value in values.items():
            setattr(message, name, value)
        return message

    def content(self, message):
        """Return the bytes of a message, CDR."""
        _make_arrays(message)
        return self.typestore.serialize_cdr(message, message.__msgtype__)


def _make_arrays(message):
    """Make each array.array of a message a NumPy array of the same memory, as rosbags wants it."""
    for field in fields(message):
        value = getattr(message, field.name)
        if isinstance(value, array):
            setattr(message, field.name, np.asarray(value))
        elif is_dataclass(value):
            _make_arrays(value)


def encoding_of(image):
    """Return ROS's word for an image, uint8 or uint16, (R, C) or (R, C, 3) BGR."""
    return ENCODINGS[image.ndim, image.itemsize]


def write_sequence_bag(path, pairs, calibration, rate):
    """
    Write pairs to /left and /right, image_rect and camera_info each, with equal stamps.

    path: a folder that does not exist yet. pairs: iterable of (left, right), each uint8 or
    uint16, (R, C) or (R, C, 3) BGR. calibration: the Calibration of all. rate: pairs a second.
    Needs rosbags: ValueError without it. Raises OSError where it cannot be written.
    """
    messages = Messages()
    with closing(BagWriter(path)) as bag:
        for number, images in enumerate(pairs):
            stamp = START + round(number * 1e9 / rate)
            cameras = rectified_cameras(calibration, *images[0].shape[:2])
            for (side, camera), image in zip(cameras.items(), images):
                image = np.ascontiguousarray(image, image.dtype.newbyteorder('<'))
                pixels = {'height': camera.height, 'width': camera.width,
                          'encoding': encoding_of(image), 'step': image.strides[0],
                          'data': image.reshape(-1).view(np.uint8)}
                numbers = {name: np.array(getattr(camera, name)) for name in 'dkrp'}
                for topic, kind, values in (
                        (f'/{side}/image_rect', 'sensor_msgs/msg/Image', pixels),
                        (f'/{side}/camera_info', 'sensor_msgs/msg/CameraInfo',
                         {**vars(camera), **numbers})):
                    message = messages.make(kind, **values)
                    header = message.header
                    header.stamp.sec, header.stamp.nanosec = divmod(stamp, 1_000_000_000)
                    header.frame_id = FRAME
                    bag.write(topic, kind, messages.typestore, messages.content(message), stamp)


def is_sequence_bag(folder):
    """Return whether a folder (Path) holds a bag of `write_sequence_bag`, and nothing else."""
    try:
        described = read_description(folder)
        return (described['starting_time'] == {'nanoseconds_since_epoch': START}
                and {entry.name for entry in folder.iterdir()}
                == {METADATA, *described['relative_file_paths']})
    except (OSError, ValueError, TypeError):
        return False
