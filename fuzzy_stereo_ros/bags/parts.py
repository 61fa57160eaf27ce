# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The files of a bag folder of ROS 2: what each holds, metadata.yaml over all, and their rescue.

A file of which the end was never written is cut to what is whole and closed without an index.
"""
from collections import Counter
from contextlib import closing
import io
import sqlite3
import struct
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import opened, text_of
from fuzzy_stereo_ros.pairs.whole_files import write_whole

SUFFIXES = {'mcap': '.mcap', 'sqlite3': '.db3'}
METADATA = 'metadata.yaml'
MCAP_START = b'\x89MCAP0\r\n'
CHUNK, DATA_END, FOOTER = 0x06, 0x0f, 0x02
# The end of data without a checksum, a footer without a summary, and the same bytes as in front.
MCAP_END = (struct.pack('<BQI', DATA_END, 4, 0) + struct.pack('<BQQQI', FOOTER, 20, 0, 0, 0)
            + MCAP_START)


class Part(NamedTuple):
    """A file of a bag: when its messages were logged, ns, and what metadata.yaml says of it."""

    name: str
    first: int
    last: int
    counts: Counter
    topics: dict


def read_part(path):
    """Return the Part of a .mcap or .db3 file, None where no message is in it; or ValueError."""
    from rosbags.rosbag2.metadata import dump_qos_v9

    with closing(opened(path)) as reader:
        if not reader.message_count:
            return None
        counts, topics = Counter(), {}
        for connection in reader.connections:
            counts[connection.topic] += connection.msgcount
            topics[connection.topic] = {
                'name': connection.topic, 'type': connection.msgtype,
                'serialization_format': connection.ext.serialization_format,
                'offered_qos_profiles': dump_qos_v9(connection.ext.offered_qos_profiles),
                'type_description_hash': _hash_of(path, reader, connection)}
        return Part(path.name, reader.start_time, reader.end_time - 1, counts, topics)


def _hash_of(path, reader, connection):
    try:
        return reader.typestore.hash_rihs01(connection.msgtype)
    except Exception as error:  # rosbags raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(f'{path} is damaged: {connection.msgtype} is not described: '
                         f'{text_of(error)}') from error


def read_parts(folder, storage):
    """Return the Part of each file of a bag folder, in order."""
    return [part for part in map(read_part, part_paths(folder, storage)) if part is not None]


def part_paths(folder, storage):
    """Return the paths of the files that are taken for parts of a bag folder, in order."""
    return sorted(folder.glob(f'*_*{SUFFIXES[storage]}'), key=number_of)


def number_of(path):
    """Return the number at the end of a part's name, -1 where there is none."""
    number = path.stem.rpartition('_')[2]
    return int(number) if number.isdecimal() else -1


def write_metadata(folder, storage, parts):
    """Write metadata.yaml, with which a folder of parts is a bag; nothing where there is none."""
    import yaml     # only for those who write bags

    if not parts:
        return
    counts = sum((part.counts for part in parts), Counter())
    topics = {name: topic for part in parts for name, topic in part.topics.items()}
    content = yaml.safe_dump({'rosbag2_bagfile_information': {
        'version': 9, 'storage_identifier': storage, 'ros_distro': 'rosbags',
        'compression_format': '', 'compression_mode': '', 'custom_data': None,
        'relative_file_paths': [part.name for part in parts],
        **_extent(min(part.first for part in parts), max(part.last for part in parts),
                  sum(counts.values())),
        'topics_with_message_count': [
            {'topic_metadata': topic, 'message_count': counts[name]}
            for name, topic in topics.items()],
        'files': [{'path': part.name,
                   **_extent(part.first, part.last, sum(part.counts.values()))}
                  for part in parts],
    }}, sort_keys=False)
    write_whole(folder / METADATA, content.encode())


def rescue(path, given_up=0):
    """
    Make a file readable whose writer did not come to its end.

    Returns whether it can be read: not where its writer did not come to the first message.
    given_up: whole chunks of an .mcap to be given up as well, where the disk has no room left.
    Raises OSError where that is not possible.
    """
    if path.suffix == SUFFIXES['sqlite3']:
        connection = sqlite3.connect(path)
        try:    # reading rolls back what was not committed
            tables = connection.execute('SELECT name FROM sqlite_master').fetchall()
        except sqlite3.Error as error:
            raise OSError(f'{path}: {error}') from error
        finally:
            connection.close()
        return ('messages',) in tables
    with open(path, 'r+b') as file:
        ends, closed = _whole_records(file)
        if not ends or closed and not given_up:
            return bool(ends)
        file.truncate(ends[max(len(ends) - 1 - given_up, 0)])
        file.seek(0, io.SEEK_END)
        file.write(MCAP_END)
    return True


def _extent(first, last, messages):
    return {'starting_time': {'nanoseconds_since_epoch': first},
            'duration': {'nanoseconds': last - first}, 'message_count': messages}


def _whole_records(file):
    """
    Return where a .mcap may be cut, ascending, and whether it was closed properly.

    It may be cut behind its header and behind each whole chunk.
    """
    size, ends = file.seek(0, io.SEEK_END), []
    place = file.seek(len(MCAP_START))
    while True:
        head = file.read(9)
        if len(head) < 9:
            return ends, False
        kind, length = struct.unpack('<BQ', head)
        place += 9 + length
        if place > size:
            return ends, False
        if kind == FOOTER:
            return ends, place + len(MCAP_START) == size
        if kind == CHUNK or not ends:
            ends.append(place)
        file.seek(place)
