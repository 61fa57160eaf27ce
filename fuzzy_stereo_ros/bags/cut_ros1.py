# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The index of a ROS 1 .bag whose end is missing, of all records that are complete.

Records and their fields: http://wiki.ros.org/Bags/Format/2.0.
"""
from collections import Counter
from dataclasses import dataclass, field
import io
from struct import pack, Struct

MAGIC = b'#ROSBAG V2.0\n'
MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
SIZE = Struct('<I')
TIME = Struct('<II')        # s, ns
ENTRY = Struct('<III')      # of an index: time, place in the chunk


# The fields of each kind that are read here, and their sizes in bytes.
NEEDED = {MESSAGE: {'conn': 4, 'time': 8}, BAG_HEADER: {'index_pos': 8}, CHUNK: {'size': 4},
          INDEX: {'conn': 4, 'count': 4}, CONNECTION: {'conn': 4}, CHUNK_INFO: {}}


@dataclass
class _Chunk:
    """A chunk: place in the file, and of its messages the times and the number by connection."""

    start: int
    times: list = field(default_factory=list)
    counts: Counter = field(default_factory=Counter)

    def count(self, fields, data):
        """Count the messages of an index: its fields and entries."""
        entries = [*ENTRY.iter_unpack(data[:len(data) // ENTRY.size * ENTRY.size])]
        self.times += [entry[:2] for entry in entries]
        self.counts[fields['conn']] += len(entries)

    def record(self):
        """Return the chunk's record in the index of the file."""
        return _record(
            CHUNK_INFO, b''.join(
                number + SIZE.pack(count) for number, count in self.counts.items()),
            ver=SIZE.pack(1), chunk_pos=pack('<Q', self.start), count=SIZE.pack(len(self.counts)),
            start_time=TIME.pack(*min(self.times)), end_time=TIME.pack(*max(self.times)))


def indexed_ros1(path, size):
    """Return head, stop and tail for IndexedPath; ValueError if it does not begin as a .bag."""
    connections, chunks = {}, []
    with open(path, 'rb') as file:
        records = _records(file, len(MAGIC), size)
        kind, _, _, end = next(records, (None,) * 4)
        if _bytes(file, 0, len(MAGIC)) != MAGIC or kind != BAG_HEADER:
            raise ValueError('it does not begin as a .bag of version 2.0')
        head, stop = bytearray(_bytes(file, 0, end)), end
        for kind, fields, data, record_end in records:
            if kind == CHUNK:
                chunks.append((_Chunk(end), fields, data, min(record_end, size)))
            if kind not in (CHUNK, INDEX) or record_end > size:
                break
            if kind == INDEX and chunks:
                chunks[-1][0].count(fields, _bytes(file, data, record_end))
            end = record_end
        for chunk, *where in chunks[:-1]:
            if not chunk.counts.keys() <= connections.keys():
                _read(_content(file, *where), connections)
        tail = b''
        if chunks:
            last, *where = chunks[-1]       # it may be torn
            stop, last, tail = last.start, *_rebuilt(
                last.start, _content(file, *where), connections)
            chunks[-1] = last, *where
    infos = [chunk.record() for chunk, *_ in chunks if chunk.counts]
    for name, value in (('index_pos', pack('<Q', stop + len(tail))),
                        ('conn_count', SIZE.pack(len(connections))),
                        ('chunk_count', SIZE.pack(len(infos)))):
        place = head.index(name.encode() + b'=') + len(name) + 1
        head[place:place + len(value)] = value
    return bytes(head), stop, b''.join((tail, *connections.values(), *infos))


def has_torn_index(reader):
    """
    Return whether the index of a reader of rosbags ends in zeros, which it takes for entries.

    A chunk is listed with the connections that have messages in it, so that no number is 0.
    """
    return any(0 in chunk.connection_counts.values()
               for chunk in getattr(reader, 'chunk_infos', ()))


def _rebuilt(start, content, connections):
    """Return a _Chunk, and its record and indexes, of the complete messages in a content."""
    length, messages = _read(content, connections)
    chunk, tail = _Chunk(start), _record(
        CHUNK, content[:length], compression=b'none', size=SIZE.pack(length))
    for connection, entries in messages.items():
        data, fields = b''.join(ENTRY.pack(*entry) for entry in entries), {
            'ver': SIZE.pack(1), 'conn': connection, 'count': SIZE.pack(len(entries))}
        tail += _record(INDEX, data, **fields)
        chunk.count(fields, data)
    return chunk, tail if messages else b''


def _read(content, connections):
    """
    Read the records of a chunk; return (length of the complete ones, {connection: its messages}).

    connections: {number: record}, gets those of the chunk. A message is an ENTRY.
    """
    length, messages = 0, {}
    for kind, fields, _, end in _records(io.BytesIO(content), 0, len(content)):
        if end > len(content):
            break
        if kind == CONNECTION:
            connections.setdefault(fields['conn'], content[length:end])
        elif kind == MESSAGE:
            messages.setdefault(fields['conn'], []).append((*TIME.unpack(fields['time']), length))
        length = end
    return length, messages


def _records(file, start, stop):
    """
    Yield (kind, fields, start of the data, end) of each record; the last may end behind stop.

    fields: {name: bytes}. The records end at one that is none, such as zeros, as a file system has
    them for what was not written.
    """
    while start + SIZE.size <= stop:
        length = SIZE.unpack(_bytes(file, start, start + SIZE.size))[0]
        data = start + length + 2 * SIZE.size
        if data > stop:
            return
        header, fields = _bytes(file, start + SIZE.size, data - SIZE.size), {}
        while header:
            size = SIZE.unpack_from(header)[0] if len(header) > SIZE.size else 0
            name, _, value = header[SIZE.size:SIZE.size + size].partition(b'=')
            fields[name.decode('latin-1')] = value
            header = header[SIZE.size + size:]
        kind = fields.get('op', b'\0')[0]
        if any(len(fields.get(name, b'')) != size for name, size in NEEDED.get(
                kind, {'op': 0}).items()):
            return
        end = data + SIZE.unpack(_bytes(file, data - SIZE.size, data))[0]
        yield kind, fields, data, end
        start = end


def _content(file, fields, start, end):
    """Return the content of a chunk as far as it is there; none of a torn compressed one."""
    from rosbags.rosbag1.reader import decompressors

    try:
        return decompressors[fields['compression'].decode()](_bytes(file, start, end))
    except Exception:   # libraries raise any kind for damaged bytes  # noqa: B902
        return b''


def _bytes(file, start, end):
    """Return the bytes of a file from start to end, or to its end."""
    end = min(end, file.seek(0, io.SEEK_END))
    file.seek(start)
    return file.read(max(end - start, 0))


def _record(kind, data, **fields):
    header = b''.join(
        SIZE.pack(len(name) + 1 + len(value)) + name.encode() + b'=' + value
        for name, value in {'op': bytes([kind]), **fields}.items())
    return SIZE.pack(len(header)) + header + SIZE.pack(len(data)) + data
