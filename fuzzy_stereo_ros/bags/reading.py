# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of ROS 1 and ROS 2 as one stream of messages, in the order in which they were logged."""
from collections import deque
from contextlib import ExitStack
import heapq
from pathlib import Path
from typing import NamedTuple

from fuzzy_stereo_ros.bags.database_paths import DatabasePath
from fuzzy_stereo_ros.bags.definitions import defined_as_in_ros
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair

SUFFIXES = '.bag', '.mcap', '.db3'
NO_ROSBAGS = ('there is no rosbags, which reads and writes bags: '
              "pip install 'fuzzy_stereo_ros[bags]'")
CALLED = {int: 'a whole number', str: 'a text'}
FIRST_LOOK = 1_000_000_000     # ns, and then longer ones: most topics have a message in it
LATEST = 1 << 63        # ns; no storage takes what is later
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

    names: of the bags, for sentences. topics: {name: BagTopic} of those that have messages, but
    for names that no ROS gives and a terminal would obey.
    begin, end: ns, when the first and the last message was recorded.
    While they are open rosbags keeps 150 bytes of each message of a .bag, whatever its topic,
    1.6 kB of each chunk of an .mcap (about 1 MiB), and nothing that grows of a .db3.
    """

    def __init__(self, paths):
        """
        Open the bags: .bag, .mcap or .db3 files, or folders with metadata.yaml.

        Raises ValueError with a sentence for what is missing, no bag, or damaged.
        """
        self.names = ', '.join(str(path) for path in paths)
        self._readers, self.topics = {}, {}
        with ExitStack() as opening:
            for path in map(Path, paths):
                self._readers[path] = opened(path)
                opening.callback(self._readers[path].close)
            for topic, connection in self._connections():
                before = self.topics.get(topic, BagTopic(connection.msgtype, 0))
                if connection.msgcount and (topic + connection.msgtype).isprintable():
                    self.topics[topic] = BagTopic(
                        before.kind, before.messages + connection.msgcount)
            filled = [reader for reader in self._readers.values() if reader.message_count]
            if not filled:
                raise ValueError(f'{self.names}: there is no message in it')
            self.begin = min(reader.start_time for reader in filled)
            self.end = max(reader.end_time for reader in filled) - 1
            self._open = opening.pop_all()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def close(self):
        """Close the bags."""
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

    def newest(self, topic, stop):
        """
        Return the last BagMessage of a topic that was logged before stop, ns; None without one.

        Raises DamagedBag as `messages`.
        """
        back = FIRST_LOOK
        while stop > self.begin:
            start = max(stop - back, self.begin)
            found = deque(self.messages([topic], start, stop), 1)
            if found:
                return found[0]
            stop, back = start, 4 * back
        return None

    def _connections(self):
        for reader in self._readers.values():
            for connection in reader.connections:
                yield slashed(connection.topic), connection


def decoded(message):
    """Return the message that a BagMessage holds; BadPair where its bytes cannot be that."""
    kind = message.connection.msgtype
    if not defined_as_in_ros(message.reader.typestore.fielddefs, kind):
        raise BadPair('damaged message', f'a message of {message.topic} cannot be read: the bag '
                      f'defines {kind} otherwise than ROS does')
    try:
        return message.reader.deserialize(message.content, kind)
    except Exception as error:  # rosbags raises many kinds for foreign bytes  # noqa: B902
        raise BadPair('damaged message', f'a message of {message.topic} cannot be read as '
                      f'{kind}: {text_of(error)}') from error


def slashed(topic):
    """Return the name of a topic with the leading slash that ROS 1 may leave out."""
    return '/' + topic.lstrip('/')


def text_of(error):
    """
    Return the first line of what an exception says, its type where it says nothing.

    What a terminal would obey is escaped: some exceptions say what stands in a bag.
    """
    said = getattr(error, 'strerror', None) or str(error).strip()
    first = said.splitlines()[0].rstrip('.') if said else type(error).__name__
    return first if first.isprintable() else ascii(first)


def opened(path):
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
    with ExitStack() as opening:
        try:
            reader = AnyReader([DatabasePath(path)],
                               default_typestore=get_typestore(Stores.ROS2_JAZZY))
            reader.open()
            _let_close(reader)
            opening.callback(reader.close)
            _check_description(reader)
        except Exception as error:  # rosbags raises many kinds for foreign bytes  # noqa: B902
            raise ValueError(
                f'{path} cannot be read as a bag: {text_of(error)}; {REPAIR}') from error
        opening.pop_all()
    return reader


def _let_close(reader):
    """Leave out a wrong list of files in metadata.yaml, which rosbags takes, and cannot close."""
    for part in reader.readers:
        storage = getattr(part, 'storage', None)        # of ROS 2
        if not isinstance(getattr(storage, 'files', []), list):
            storage.files = []


def _check_description(reader):
    """Raise TypeError where what rosbags takes over as it stands is of a wrong type."""
    of_types = [(reader.message_count, int), (reader.start_time, int), (reader.end_time, int)]
    for connection in reader.connections:
        of_types += [(connection.topic, str), (connection.msgtype, str),
                     (connection.msgcount, int)]
    for value, kind in of_types:
        if not isinstance(value, kind):
            raise TypeError(f'{value!r} stands where {CALLED[kind]} belongs')


def _messages(path, reader, topics, start, stop):
    """Yield each BagMessage of one bag; see `BagReader.messages`."""
    wanted = [connection for connection in reader.connections
              if slashed(connection.topic) in topics]
    if not wanted:
        return
    stored = reader.messages(wanted, start=start, stop=stop)
    while True:
        try:
            connection, logged, content = next(stored)
        except StopIteration:
            return
        except Exception as error:  # and of many kinds here too  # noqa: B902
            raise DamagedBag(f'{path} is damaged: {text_of(error)}') from error
        if not (isinstance(logged, int) and 0 <= logged < LATEST and isinstance(content, bytes)):
            raise DamagedBag(f'{path} is damaged: a message has no content or was recorded at no '
                             'time that can be')
        yield BagMessage(slashed(connection.topic), logged, content, connection, reader)
