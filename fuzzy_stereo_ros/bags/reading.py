# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read bags of ROS 1 and ROS 2 as one stream of messages, in the order of logging."""
from collections import deque
from contextlib import ExitStack, suppress
import heapq
from pathlib import Path
from typing import NamedTuple

from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair

SUFFIXES = '.bag', '.mcap', '.db3'
NO_ROSBAGS = ('rosbags, which reads and writes bags, is not installed: '
              "pip install 'fuzzy_stereo_ros[bags]'")
FIRST_SPAN = 1_000_000_000      # ns, searched first by `newest`, as most topics have 1 Hz or more
LATEST = 1 << 63                # ns; storages hold earlier times only
REPAIR = ('a recording that was cut off is repaired by `ros2 bag reindex` (a folder), '
          '`mcap recover` (.mcap), `sqlite3 OLD .recover | sqlite3 NEW` (.db3) or '
          '`rosbag reindex` (.bag)')


class DamagedBag(ValueError):
    """Raised when a bag cannot be read any further."""


class BagTopic(NamedTuple):
    """A topic's type, as ROS 2 writes it, and its number of messages."""

    kind: str
    messages: int


class BagMessage(NamedTuple):
    """
    A message as it is stored.

    topic: begins with a slash. log_time: ns, when it was recorded. content: bytes.
    connection, reader: of rosbags; they describe and deserialise the content.
    """

    topic: str
    log_time: int
    content: bytes
    connection: object
    reader: object


class BagReader:
    """
    Open bags; a context manager.

    paths: of the bags. names: the same, for a sentence. topics: {name: BagTopic} of those with
    messages, except names with control characters. begin, end: ns, when the first and the last
    message were recorded.
    rosbags needs memory for open bags: 150 bytes for each message of a .bag, 1.6 kB for each chunk
    of an .mcap (about 1 MiB), a constant amount for a .db3.
    """

    def __init__(self, paths):
        """
        Open the bags: .bag, .mcap or .db3 files, or folders with metadata.yaml.

        Raises ValueError with a sentence for a path that is missing, no bag, or damaged.
        """
        self.paths = tuple(map(Path, paths))
        self.names = ', '.join(map(str, self.paths))
        self._readers, self.topics = {}, {}
        with ExitStack() as opening:
            for path in self.paths:
                self._readers[path] = _opened(path)
                opening.callback(_close, self._readers[path])
            for reader in self._readers.values():
                for connection in reader.connections:
                    topic = slashed(connection.topic)
                    kind, before = self.topics.get(topic, (connection.msgtype, 0))
                    if connection.msgcount and (topic + kind).isprintable():
                        self.topics[topic] = BagTopic(kind, before + connection.msgcount)
            filled = [reader for reader in self._readers.values() if reader.message_count]
            if not filled:
                raise ValueError(f'{self.names} has no messages')
            self.begin = min(reader.start_time for reader in filled)
            self.end = max(reader.end_time for reader in filled) - 1
            self._open = opening.pop_all()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._open.close()

    def connections(self, topic):
        """Return the list of (connection, reader) of a topic, both of rosbags."""
        return [(connection, reader) for reader in self._readers.values()
                for connection in reader.connections if slashed(connection.topic) == topic]

    def messages(self, topics, start=None, stop=None):
        """
        Yield each BagMessage of some topics, in the order of logging.

        start, stop: ns; messages logged at start or later, and before stop.
        Raises DamagedBag when a bag cannot be read any further.
        """
        return heapq.merge(
            *(_messages(path, reader, topics, start, stop)
              for path, reader in self._readers.items()), key=lambda message: message.log_time)

    def newest(self, topic, stop, count=1):
        """
        Return the last BagMessages of a topic logged before stop, ns, in order: a tuple.

        count: at most so many. Raises DamagedBag as `messages`.
        """
        span = FIRST_SPAN
        while True:
            found = deque(self.messages([topic], stop - span, stop), count)
            if len(found) == count or stop - span <= self.begin:
                return tuple(found)
            span *= 4


def read_stamped(message):
    """
    Return the stamp, ns, and the deserialised message of a BagMessage with a header.

    Raises BadPair if its bytes are no such message.
    """
    kind = message.connection.msgtype
    try:
        content = message.reader.deserialize(message.content, kind)
        return stamp_of(content.header), content
    except Exception as error:  # rosbags raises any kind for damaged bytes  # noqa: B902
        raise BadPair('damaged message', f'a message of {message.topic} cannot be read as '
                      f'{kind}: {text_of(error)}') from error


def slashed(topic):
    """Return the name of a topic with a leading slash, which ROS 1 may omit."""
    return '/' + topic.lstrip('/')


def text_of(error):
    """
    Return the first line of an exception's text, or its type if it has no text.

    Control characters are escaped, as some exceptions quote a bag.
    """
    text = getattr(error, 'strerror', None) or str(error).strip()
    line = text.splitlines()[0].rstrip('.') if text else type(error).__name__
    return line if line.isprintable() else ascii(line)


def _opened(path):
    """Return an open AnyReader of a bag; ValueError with a sentence if it cannot be opened."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import get_typestore, Stores
    except ImportError:
        raise ValueError(NO_ROSBAGS) from None
    if not path.exists():
        raise ValueError(f'{path} does not exist; give a bag: a .bag, .mcap or .db3 file, or a '
                         'folder with metadata.yaml')
    if path.is_dir() and not (path / 'metadata.yaml').exists():
        raise ValueError(f'{path} is a folder without metadata.yaml, so it is no bag; give the '
                         f'files in it one by one, or repair it: {REPAIR}')
    if path.is_file() and path.suffix not in SUFFIXES:
        raise ValueError(f"{path} has the suffix '{path.suffix}'; bags have "
                         f"{', '.join(SUFFIXES)}, or are folders with metadata.yaml")
    reader = None
    try:
        reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
        reader.open()
        # rosbags does not check the types of these values.
        values = [(int, reader.message_count, reader.start_time, reader.end_time)]
        for one in reader.connections:
            values += [(str, one.topic, one.msgtype), (int, one.msgcount)]
        for kind, *found in values:
            for value in found:
                if not isinstance(value, kind):
                    raise TypeError(f'{value!r} is no {kind.__name__}')
    except Exception as error:  # rosbags raises any kind for damaged bytes  # noqa: B902
        _close(reader)
        raise ValueError(f'{path} cannot be read as a bag: {text_of(error)}; {REPAIR}') from error
    return reader


def _close(reader):
    """Close an AnyReader; errors by the content of a damaged bag are ignored."""
    with suppress(Exception):
        for part in reader.readers:
            if hasattr(part, 'storage'):    # of ROS 2
                part.storage.files = []     # closing clears it, which fails if it is no list
        reader.close()


def _messages(path, reader, topics, start, stop):
    """Yield each BagMessage of one bag, as `BagReader.messages`."""
    wanted = [connection for connection in reader.connections
              if slashed(connection.topic) in topics]
    if not wanted:
        return
    try:
        for connection, log_time, content in reader.messages(wanted, start=start, stop=stop):
            if not (isinstance(log_time, int) and 0 <= log_time < LATEST
                    and isinstance(content, bytes)):
                raise ValueError('a message has no content or no time')
            yield BagMessage(slashed(connection.topic), log_time, content, connection, reader)
    except Exception as error:  # rosbags raises any kind for damaged bytes  # noqa: B902
        raise DamagedBag(f'{path} is damaged: {text_of(error)}') from error
