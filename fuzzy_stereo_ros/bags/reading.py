# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read bags of ROS 1 and ROS 2 as one stream of messages, in the order of logging."""
from collections import deque
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass
import heapq
from pathlib import Path
from typing import NamedTuple

from fuzzy_stereo_ros.bags.cut_off import check_tables, is_torn, log_of, Recovered, recovered
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair

BAG_SUFFIXES = '.bag', '.bag.active', '.mcap', '.db3'
STORAGES = '.mcap', '.db3'      # of the files in a folder
NO_ROSBAGS = ('rosbags, which reads and writes bags, is not installed: '
              "pip install '.[bags]' in the folder of the package")
FIRST_SPAN = 1_000_000_000      # ns, searched first by `newest`, as most topics have 1 Hz or more
PACKED = '.zst', '.zstd'        # of storages that were compressed as files
BAGS = 'a .bag, .mcap or .db3 file, or a folder with metadata.yaml'
LATEST = 1 << 63                # ns; storages hold earlier times only
COMPRESSED = b'\x28\xb5\x2f\xfd'      # how zstd begins, and no message of ROS 2


class DamagedBag(ValueError):
    """Raised when a bag cannot be read any further."""


class BagTopic(NamedTuple):
    """A topic's type, as ROS 2 writes it, and its number of messages."""

    kind: str
    messages: int


class BagMessage(NamedTuple):
    """A message as it is stored."""

    topic: str          # begins with a slash
    log_time: int       # ns, when it was recorded
    content: bytes
    connection: object  # of rosbags, as reader: they describe and deserialise the content
    reader: object


@dataclass
class _OpenFile:
    """An open file or folder of a bag: its path, AnyReader, and Recovered if it was cut off."""

    path: Path
    reader: object
    recovered: Recovered | None = None

    def close(self):
        """Close it; errors by the content of a damaged bag are ignored."""
        with suppress(Exception):
            for part in self.reader.readers:
                if hasattr(part, 'storage'):    # of ROS 2
                    part.storage.files = []     # closing clears it, which fails if it is no list
            self.reader.close()
        if self.recovered is not None:
            self.recovered.close()


class BagReader(AbstractContextManager):
    """
    Open bags; a context manager.

    paths: of the bags. names: the same, for a sentence. topics: {name: BagTopic} of those with
    messages, except names with control characters. begin, end: ns, when the first and the last
    message were recorded. losses: a sentence for each file of a recording that was cut off.
    rosbags needs memory for open bags: 150 bytes for each message of a .bag, 1.6 kB for each chunk
    of an .mcap (about 1 MiB), a constant amount for a .db3.
    """

    def __init__(self, paths):
        """Open files or folders, as far as they are complete; ValueError if missing or no bags."""
        self.paths = tuple(map(Path, paths))
        self.names = ', '.join(map(str, self.paths))
        self._files, self.topics, self.losses = [], {}, []
        with ExitStack() as opening:
            for path in self.paths:
                for file in _opened(path, self.losses):
                    opening.callback(file.close)
                    self._files.append(file)
            for file in self._files:
                for connection in file.reader.connections:
                    topic = slashed(connection.topic)
                    kind, before = self.topics.get(topic, (connection.msgtype, 0))
                    if connection.msgcount and (topic + kind).isprintable():
                        self.topics[topic] = BagTopic(kind, before + connection.msgcount)
            filled = [file.reader for file in self._files if file.reader.message_count]
            self.begin = min((reader.start_time for reader in filled), default=0)
            self.end = max((reader.end_time for reader in filled), default=0) - 1
            self.losses += [self._loss(file) for file in self._files if file.recovered]
            if not filled:
                raise ValueError('; '.join((f'{self.names} has no messages', *self.losses)))
            self._open = opening.pop_all()

    def _loss(self, file):
        count, end = file.reader.message_count, file.reader.end_time - 1
        if not count:
            return f'{file.path} was cut off: it has no complete message'
        return (f'{file.path} was cut off: its {count} messages up to '
                f'{(end - self.begin) / 1e9:.3f} s into the bag are read, any later ones are lost')

    def __exit__(self, *error):
        self._open.close()

    def connections(self, topic):
        """Return the list of (connection, reader) of a topic, both of rosbags."""
        return [(connection, file.reader) for file in self._files
                for connection in file.reader.connections if slashed(connection.topic) == topic]

    def messages(self, topics, start=None, stop=None):
        """Yield each BagMessage of topics as logged, start <= ns < stop, or raise DamagedBag."""
        return heapq.merge(
            *(_messages(file, topics, start, stop) for file in self._files),
            key=lambda message: message.log_time)

    def newest(self, topic, stop, count=1):
        """Return a tuple of the last BagMessages of a topic before stop, ns, at most `count`."""
        span = FIRST_SPAN
        while True:
            found = deque(self.messages([topic], stop - span, stop), count)
            if len(found) == count or stop - span <= self.begin:
                return tuple(found)
            span *= 4


def read_stamped(message):
    """Return the stamp, ns, and the message with a header of a BagMessage; BadPair if none."""
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
    """Return the first line of an exception's text, or its type, escaped: it may quote a bag."""
    text = getattr(error, 'strerror', None) or str(error).strip()
    line = text.splitlines()[0].rstrip('.') if text else type(error).__name__
    return line if line.isprintable() else ascii(line)


def _opened(path, losses):
    """Return the _OpenFiles of a bag; losses gets a sentence for each file that cannot be read."""
    if not path.exists():
        raise ValueError(f'{path} does not exist; give a bag: {BAGS}')
    if path.is_file():
        if not path.name.endswith((*BAG_SUFFIXES, *PACKED)):
            raise ValueError(f"{path} has the suffix '{path.suffix}'; bags have "
                             f"{', '.join(BAG_SUFFIXES)}, or are folders with metadata.yaml")
        return [_opened_file(path)]
    described = (path / 'metadata.yaml').exists()
    if described and not any(map(log_of, path.glob('*.db3'))):     # rosbags reads no log
        try:
            for database in path.glob('*.db3'):
                check_tables(database)
            return [_OpenFile(path, _reader(path))]
        except ValueError as error:
            fault = error
    elif not described:
        fault = ValueError(f'{path} is a folder without metadata.yaml and without '
                           f"{' or '.join(STORAGES)} files, so it is no bag")
    files, faults = [], []
    for name in sorted(one for one in path.iterdir()
                       if one.suffix in (*STORAGES, *PACKED) and not one.name.startswith('.')):
        try:
            files.append(_opened_file(name))
        except ValueError as error:
            faults.append(str(error))
    # Where the files are sound the description is at fault.
    if not files or (described and not faults and not any(file.recovered for file in files)):
        for file in files:
            file.close()
        raise ValueError(faults[0]) if faults else fault
    losses += faults
    return files


def _opened_file(path):
    """Return the _OpenFile of a .bag, .mcap or .db3; ValueError if nothing of it can be read."""
    if path.suffix in PACKED:
        raise ValueError(f'{path} is compressed; unpack it: zstd -d {path}')
    if path.suffix == '.db3':
        check_tables(path)
    log = log_of(path)
    try:
        if log is not None:
            raise ValueError(f'{path} has its newest messages in {log.name}, which cannot be read '
                             'here; copy both into a folder that can be written to')
        file = _OpenFile(path, _reader(path))
        if not is_torn(path, file.reader.readers[0]):
            return file
        file.close()
        raise ValueError(f'{path} cannot be read as a bag: its end is missing')
    except ValueError as error:
        fault = error
    found = None
    try:
        found = recovered(path)
        return _OpenFile(path, _reader(found.path), found)
    except Exception:   # what is no bag at all raises any kind  # noqa: B902
        if found is not None:
            found.close()
        raise fault from None


def _reader(path):
    """Return an open AnyReader of a path; ValueError with a sentence if it cannot be opened."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import get_typestore, Stores
    except ImportError:
        raise ValueError(NO_ROSBAGS) from None
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
        _OpenFile(path, reader).close()
        raise ValueError(f'{path} cannot be read as a bag: {text_of(error)}') from error
    return reader


def _messages(file, topics, start, stop):
    reader = file.reader
    wanted = [connection for connection in reader.connections
              if slashed(connection.topic) in topics]
    if not wanted:
        return
    try:
        from rosbags.rosbag2.reader import zstd     # of the standard library or of a package
        for connection, log_time, content in reader.messages(wanted, start=start, stop=stop):
            if file.recovered is not None:
                content = file.recovered.content(content)
            if reader.is2 and content[:4] == COMPRESSED:    # only metadata.yaml would tell
                content = zstd.decompress(content)
            if not (isinstance(log_time, int) and 0 <= log_time < LATEST
                    and isinstance(content, bytes)):
                raise ValueError('a message has no content or no time')
            yield BagMessage(slashed(connection.topic), log_time, content, connection, reader)
    except Exception as error:  # rosbags raises any kind for damaged bytes  # noqa: B902
        raise DamagedBag(f'{file.path} is damaged: {text_of(error)}') from error
