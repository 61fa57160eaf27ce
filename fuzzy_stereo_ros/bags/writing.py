# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Write bags of ROS 2 in parts, and copy topics into them.

A part becomes a file of the bag, and is listed in metadata.yaml, only when it is complete. So the
folder always holds a valid bag, however the process ends; only the unfinished part is lost.
Topics of a bag of ROS 1 or ROS 2 can be copied.
"""
from array import array
from collections import Counter
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
import sqlite3
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import NO_ROSBAGS, slashed, text_of
from fuzzy_stereo_ros.pairs.camera_files import rectified_cameras
from fuzzy_stereo_ros.pairs.image_files import remove, write_whole
from fuzzy_stereo_ros.pairs.messages import (
    encoding_of, fill_camera, fill_pixels, set_stamp)
import numpy as np

RENAMED = {'tf/msg/tfMessage': 'tf2_msgs/msg/TFMessage'}
HEADER = 'std_msgs/msg/Header'
STORAGE_SUFFIXES = {'mcap': '.mcap', 'sqlite3': '.db3'}
FORMATS = tuple(STORAGE_SUFFIXES)
METADATA = 'metadata.yaml'
CONTENT = 'rosbag2_bagfile_information'     # the one entry of metadata.yaml
UNFINISHED = 'unfinished'   # subfolder of the bag in which a part is written
FRAME = 'left_camera_optical_frame'
START = 1_700_000_000_000_000_000   # ns, first stamp of a synthetic sequence; 0 means no stamp
PART_BYTES = 2**28          # size at which a part is closed; a killed process loses no more


class BagWriter:
    """
    Writes a bag into a folder, or appends to the bag in it; for one thread.

    counts: Counter of messages by topic. last: ns, log time of the newest. Both cover all parts,
    after a failure only the closed ones.
    """

    def __init__(self, folder, storage='mcap'):
        """Read the bag's metadata.yaml if there is one; ValueError if it is damaged."""
        self._folder, self._storage = Path(folder), storage
        self._writer, self._connections, self._size, self._failed = None, {}, 0, False
        self._closed = read_description(self._folder)
        self._count_closed()

    def write(self, topic, kind, typestore, content, log_time, qualities=()):
        """
        Write a message; OSError if it cannot be written: the closed parts remain a valid bag.

        kind: its type, which the typestore of rosbags defines. content: bytes, CDR. log_time: ns,
        not before the previous message. qualities: list of rosbags' Qos.
        """
        self._guard(self._write, topic, kind, typestore, content, log_time, qualities)

    def commit(self):
        """Close the part if it is large enough; call it after messages that belong together."""
        if self._size > PART_BYTES:
            self.close()

    def close(self):
        """Close the open part, if there is one; raises OSError as `write`."""
        self._guard(self._close)

    def _guard(self, action, *arguments):
        """Call an action that writes; if it fails, discard the open part and stop writing."""
        if self._failed:
            return
        try:
            action(*arguments)
        except (OSError, sqlite3.Error) as error:
            self._failed = True
            with suppress(OSError, sqlite3.Error):
                if self._writer is not None:
                    self._writer.abort()
            with suppress(OSError):
                remove(self._folder / UNFINISHED)
            self._count_closed()
            raise OSError(
                f'{self._folder} cannot be written any further: {text_of(error)}') from error

    def _write(self, topic, kind, typestore, content, log_time, qualities):
        if self._writer is None:
            from rosbags.rosbag2 import StoragePlugin, Writer

            unfinished = self._folder / UNFINISHED
            remove(unfinished)      # left by a killed process
            unfinished.mkdir(parents=True)      # fails where a link was put meanwhile
            number = len(self._closed['files']) if self._closed else 0
            name = f'{self._folder.resolve().name}_{number}'    # resolved, as it may be `.`
            self._writer = Writer(unfinished / name, version=Writer.VERSION_LATEST,
                                  storage_plugin=StoragePlugin[self._storage.upper()])
            self._writer.open()
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=typestore, offered_qos_profiles=qualities)
        self._writer.write(self._connections[topic], log_time, content)
        self._size += len(content)
        self.counts[topic] += 1
        self.last = log_time

    def _close(self):
        import yaml     # only for those who write bags

        if self._writer is None:
            return
        self._writer.close()
        part = self._writer.path
        description = _joined(self._closed, read_description(part))
        file = f'{part.name}{STORAGE_SUFFIXES[self._storage]}'
        (part / file).replace(self._folder / file)
        write_whole(self._folder / METADATA, yaml.safe_dump(
            {CONTENT: description}, sort_keys=False).encode())
        remove(self._folder / UNFINISHED)
        self._writer, self._connections, self._size = None, {}, 0
        self._closed = description

    def _count_closed(self):
        self.counts, self.last = Counter(), None
        if self._closed is not None:
            self.counts.update({topic['topic_metadata']['name']: topic['message_count']
                                for topic in self._closed['topics_with_message_count']})
            self.last = _extent(self._closed)[1]


def read_description(folder):
    """Return the content of a bag's metadata.yaml, None without one; ValueError if damaged."""
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
    """Return the description of a bag that has the parts of two; the first may be None."""
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
    """Return the times at which the first and the last message of a bag were logged, ns."""
    first = description['starting_time']['nanoseconds_since_epoch']
    return first, first + description['duration']['nanoseconds']


class Messages:
    """Makes empty messages of ROS 2 Jazzy, and serialises them, by rosbags."""

    def __init__(self):
        """Load the message types; ValueError if rosbags is not installed."""
        try:
            from rosbags.typesys import get_typestore, Stores
        except ImportError:
            raise ValueError(NO_ROSBAGS) from None

        self.typestore = get_typestore(Stores.ROS2_JAZZY)

    def make(self, kind, **values):
        """Return a message of a type (`sensor_msgs/msg/Image`) with these values, else empty."""
        from rosbags.convert.converter import default_message

        message = default_message(self.typestore, kind)
        for name, value in values.items():
            setattr(message, name, value)
        return message

    def content(self, message):
        """Return the serialised message: bytes, CDR."""
        _use_numpy_arrays(message)
        return self.typestore.serialize_cdr(message, message.__msgtype__)


def _use_numpy_arrays(message):
    """Replace each array.array of a message by a NumPy array of its memory, for rosbags."""
    for field in fields(message):
        value = getattr(message, field.name)
        if isinstance(value, array):
            setattr(message, field.name, np.asarray(value))
        elif is_dataclass(value):
            _use_numpy_arrays(value)


def write_sequence_bag(path, pairs, calibration, rate):
    """
    Write pairs to image_rect and camera_info of /left and /right, with equal stamps.

    path: a folder that does not exist yet. pairs: iterable of (left, right), each uint8 or
    uint16, (R, C) or (R, C, 3) BGR. calibration: the Calibration of all. rate: pairs per second.
    Raises ValueError if rosbags is not installed, OSError if the bag cannot be written.
    """
    messages = Messages()
    with closing(BagWriter(path)) as bag:
        for number, images in enumerate(pairs):
            stamp = START + round(number * 1e9 / rate)
            cameras = rectified_cameras(calibration, *images[0].shape[:2])
            for (side, camera), image in zip(cameras.items(), images):
                for name, message in (
                        ('image_rect', fill_pixels(
                            messages.make('sensor_msgs/msg/Image'), image, encoding_of(image))),
                        ('camera_info', fill_camera(
                            messages.make('sensor_msgs/msg/CameraInfo'), camera))):
                    set_stamp(message.header, stamp)
                    message.header.frame_id = FRAME
                    bag.write(f'/{side}/{name}', message.__msgtype__, messages.typestore,
                              messages.content(message), stamp)


def is_sequence_bag(folder):
    """Return whether a folder (Path) holds nothing but a bag of `write_sequence_bag`."""
    try:
        described = read_description(folder)
        return (described['starting_time'] == {'nanoseconds_since_epoch': START}
                and {entry.name for entry in folder.iterdir()}
                == {METADATA, *described['relative_file_paths']})
    except (OSError, ValueError, TypeError):
        return False


class Copying(NamedTuple):
    """How the messages of a connection are copied; the first three: see `BagWriter.write`."""

    kind: str
    typestore: object
    qualities: list
    converted: Callable     # from the bytes of a message to CDR


class CopiedMessages:
    """The messages of bags that are copied, in their order; topics: the names, a list."""

    def __init__(self, bags, names=(), results=(), start=None, stop=None):
        """
        Choose messages.

        bags: a BagReader that nobody else reads; names: topics, () = all but the results; results:
        topics that are written; start, stop: log times, ns, see `BagReader.messages`. Raises
        ValueError for a topic that is not there, is a result, or has a type that is not defined.
        """
        self.topics = [slashed(name) for name in names] or [
            topic for topic in bags.topics if topic not in results]
        for topic in self.topics:
            if topic not in bags.topics:
                raise ValueError(f'--keep names {topic}, which is not in {bags.names}; there are '
                                 f"{', '.join(sorted(bags.topics))}")
            if topic in results:
                raise ValueError(f'--keep names {topic}, under which the results are written')
        # By reader too, as bags of ROS 1 and ROS 2 may be read together.
        self._copyings = {(topic, id(reader)): _copying_of(topic, connection, reader)
                          for topic in self.topics
                          for connection, reader in bags.connections(topic)}
        self._messages, self._next = bags.messages(self.topics, start, stop), None

    def until(self, log_time=None):
        """Yield (BagMessage, its Copying) up to a time in ns, None = the end; DamagedBag."""
        while True:
            self._next = self._next or next(self._messages, None)
            if self._next is None or (log_time is not None and self._next.log_time > log_time):
                return
            message, self._next = self._next, None
            yield message, self._copyings[message.topic, id(message.reader)]


def _copying_of(topic, connection, reader):
    kind = connection.msgtype
    if kind not in reader.typestore.fielddefs:
        raise ValueError(f'{topic} cannot be copied: the bag does not define its type {kind}; '
                         'name the topics to keep without it')
    if reader.is2:
        return Copying(kind, reader.typestore, connection.ext.offered_qos_profiles, bytes)
    from rosbags.convert.converter import is_same_wireformat, LATCH

    from rosbags.typesys import get_typestore, Stores

    typestore, new = get_typestore(Stores.ROS2_JAZZY), RENAMED.get(kind, kind)
    if new not in typestore.fielddefs or not is_same_wireformat(
            reader.typestore, typestore, kind, new):
        header, new = typestore.fielddefs[HEADER], kind
        typestore = get_typestore(Stores.EMPTY)
        typestore.register({**reader.typestore.fielddefs, HEADER: header})

    def converted(content):
        return typestore.ros1_to_cdr(content, new)

    return Copying(new, typestore, LATCH if connection.ext.latching else [], converted)
