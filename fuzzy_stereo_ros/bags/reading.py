# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of ROS 1 and ROS 2 as one stream of messages, in the order in which they were logged."""
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
FIRST_LOOK = 1_000_000_000      # ns, and then longer ones: most topics have a message in it
LATEST = 1 << 63                # ns; no storage takes what is later
REPAIR = ('a recording that was cut off is repaired by `ros2 bag reindex` (a folder), '
          '`mcap recover` (.mcap), `sqlite3 OLD .recover | sqlite3 NEW` (.db3) or '
          '`rosbag reindex` (.bag)')


class DamagedBag(ValueError):
    """A bag that can be read so far and no further."""


class BagTopic(NamedTuple):
    """A topic: its type, as ROS 2 writes it, and how many messages there are."""

    kind: str
    messages: int


class BagMessage(NamedTuple):
    """
    A message as it is stored.

    topic: begins with a slash. logged: ns, when it was recorded. content: bytes.
    connection, reader: of rosbags, what the content is and what can read it.
    """

    topic: str
    logged: int
    content: bytes
    connection: object
    reader: object


class BagReader:
    """
    Bags that are open; a context manager.

    paths: of the bags; names: the same in a sentence. topics: {name: BagTopic} of those that have
    messages, but for names with signs that a terminal obeys.
    begin, end: ns, when the first and the last message was recorded.
    While they are open rosbags keeps 150 bytes of each message of a .bag, whatever its topic,
    1.6 kB of each chunk of an .mcap (about 1 MiB), and nothing that grows of a .db3.
    """

    def __init__(self, paths):
        """
        Open the bags: .bag, .mcap or .db3 files, or folders with metadata.yaml.

        Raises ValueError with a sentence for what is missing, no bag, or damaged.
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
        """Return [(connection, reader)] of a topic, as of rosbags."""
        return [(connection, reader) for reader in self._readers.values()
                for connection in reader.connections if slashed(connection.topic) == topic]

    def messages(self, topics, start=None, stop=None):
        """
        Yield each BagMessage of some topics, in the order in which they were logged.

        start, stop: ns; from start on and before stop.
        Raises DamagedBag where a bag cannot be read any further.
        """
        return heapq.merge(
            *(_messages(path, reader, topics, start, stop)
              for path, reader in self._readers.items()), key=lambda message: message.logged)

    def newest(self, topic, stop, count=1):
        """
        Return the last few BagMessages of a topic that were logged before stop, ns, in order.

        count: how many, if there are so many. Raises DamagedBag as `messages`.
        """
        back = FIRST_LOOK
        while True:
            found = deque(self.messages([topic], stop - back, stop), count)
            if len(found) == count or stop - back <= self.begin:
                return tuple(found)
            back *= 4


def read_stamped(message):
    """
    Return the stamp, ns, and the message that a BagMessage with a header holds.

    Raises BadPair where its bytes are no such message.
    """
    kind = message.connection.msgtype
    try:
        content = message.reader.deserialize(message.content, kind)
        return stamp_of(content.header), content
    except Exception as error:  # rosbags raises many kinds for foreign bytes  # noqa: B902
        raise BadPair('damaged message', f'a message of {message.topic} cannot be read as '
                      f'{kind}: {text_of(error)}') from error


def slashed(topic):
    """Return the name of a topic with the leading slash that ROS 1 may leave out."""
    return '/' + topic.lstrip('/')


def text_of(error):
    """
    Return the first line of what an exception says, its type where it says nothing.

    What a terminal would obey is escaped: some exceptions quote a bag.
    """
    said = getattr(error, 'strerror', None) or str(error).strip()
    first = said.splitlines()[0].rstrip('.') if said else type(error).__name__
    return first if first.isprintable() else ascii(first)


def _opened(path):
    """Return an AnyReader that is open; ValueError with a sentence where it cannot be one."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import get_typestore, Stores
    except ImportError:
        raise ValueError(NO_ROSBAGS) from None
    if not path.exists():
        raise ValueError(f'{path} does not exist; give a bag: a .bag, .mcap or .db3 file, or a '
                         'folder with metadata.yaml')
    if path.is_dir() and not (path / 'metadata.yaml').exists():
        raise ValueError(f'{path} is a folder without metadata.yaml, so no bag; give the files '
                         f'in it one by one, or repair it: {REPAIR}')
    if path.is_file() and path.suffix not in SUFFIXES:
        raise ValueError(f"{path} has the suffix '{path.suffix}'; bags have "
                         f"{', '.join(SUFFIXES)}, or are folders with metadata.yaml")
    reader = None
    try:
        reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
        reader.open()
        # rosbags takes over values of wrong types as they stand.
        values = [(int, reader.message_count, reader.start_time, reader.end_time)]
        for one in reader.connections:
            values += [(str, one.topic, one.msgtype), (int, one.msgcount)]
        for kind, *found in values:
            for value in found:
                if not isinstance(value, kind):
                    raise TypeError(f'{value!r} is no {kind.__name__}')
    except Exception as error:  # rosbags raises many kinds for foreign bytes  # noqa: B902
        _close(reader)
        raise ValueError(f'{path} cannot be read as a bag: {text_of(error)}; {REPAIR}') from error
    return reader


def _close(reader):
    """Close an AnyReader, as far as what stands in its bag lets it."""
    with suppress(Exception):
        for part in reader.readers:
            if hasattr(part, 'storage'):    # of ROS 2
                part.storage.files = []     # which it clears, a list or not
        reader.close()


def _messages(path, reader, topics, start, stop):
    """Yield each BagMessage of one bag; see `BagReader.messages`."""
    wanted = [connection for connection in reader.connections
              if slashed(connection.topic) in topics]
    if not wanted:
        return
    try:
        for connection, logged, content in reader.messages(wanted, start=start, stop=stop):
            if not (isinstance(logged, int) and 0 <= logged < LATEST
                    and isinstance(content, bytes)):
                raise ValueError('a message has no content or no time')
            yield BagMessage(slashed(connection.topic), logged, content, connection, reader)
    except Exception as error:  # rosbags raises many kinds here too  # noqa: B902
        raise DamagedBag(f'{path} is damaged: {text_of(error)}') from error
