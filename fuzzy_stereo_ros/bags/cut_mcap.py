# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The index of an .mcap whose end is missing, of all records that are complete.

Records, their numbers and fields: https://mcap.dev/spec.
"""
from dataclasses import dataclass, field
import io
from struct import pack, Struct

MAGIC = b'\x89MCAP0\r\n'
(FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, DATA_END) = (
    2, 3, 4, 5, 6, 7, 8, 15)
RECORD = Struct('<BQ')              # opcode, length of what follows
MESSAGE_HEAD = Struct('<HIQQ')      # channel, sequence, log time, publish time
CHUNK_HEAD = Struct('<QQQII')       # first and last log time, size, checksum, length of a name
LONGEST_NAME = 16                   # bytes, of a compression


@dataclass
class _Chunk:
    """A chunk: place in the file, fields, and the places of the message indexes behind it."""

    start: int
    end: int
    first: int
    last: int
    size: int
    compression: bytes
    compressed: int
    indexes: dict = field(default_factory=dict)
    indexes_end: int = 0

    def record(self):
        """Return the chunk's record in the index of the file."""
        return _record(
            CHUNK_INDEX, pack('<QQQQ', self.first, self.last, self.start, self.end - self.start),
            _sized(b''.join(pack('<HQ', *one) for one in self.indexes.items())),
            pack('<Q', max(self.indexes_end - self.end, 0)), _sized(self.compression),
            pack('<QQ', self.compressed, self.size))


def indexed_mcap(path, stop):
    """Return head, stop and tail for IndexedPath; ValueError if it does not begin as an .mcap."""
    described, chunks = {SCHEMA: {}, CHANNEL: {}}, []
    with open(path, 'rb') as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise ValueError('it does not begin as an .mcap')
        end = len(MAGIC)
        for opcode, start, end_of_record in _records(file, end, stop):
            if opcode in (FOOTER, DATA_END):
                break
            if opcode == CHUNK and start + RECORD.size + CHUNK_HEAD.size + LONGEST_NAME <= stop:
                chunks.append(_chunk(file, start, end_of_record))
            if end_of_record > stop:
                break
            end = end_of_record
            if opcode == MESSAGE_INDEX and chunks:
                file.seek(start + RECORD.size)
                chunks[-1].indexes[int.from_bytes(file.read(2), 'little')] = start
                chunks[-1].indexes_end = end
            elif opcode in described:
                _describe(described, opcode, _bytes(file, start, end))
        if not chunks or not all(chunk.indexes for chunk in chunks[:-1]):
            # rosbags then reads all records for their channels and times.
            return b'', end, _record(DATA_END, pack('<I', 0)) + _footer(0)
        for chunk in chunks[:-1]:
            if not chunk.indexes.keys() <= described[CHANNEL].keys():
                _read(_content(file, chunk, stop), described)
        last = chunks.pop()     # it may be torn
        tail = _rebuilt(last, _content(file, last, stop), described)
    tail += _record(DATA_END, pack('<I', 0))
    summary = last.start + len(tail)
    records = *described[SCHEMA].values(), *described[CHANNEL].values()
    chunks += [last] if last.indexes else []
    return b'', last.start, b''.join(
        (tail, *records, *(chunk.record() for chunk in chunks), _footer(summary)))


def _rebuilt(chunk, content, described):
    """Return a chunk's record and its indexes, of the complete messages in its content."""
    length, times = _read(content, described)
    if not times:
        chunk.indexes = {}
        return b''
    found = [time for one in times.values() for time, _ in one]
    chunk.first, chunk.last, chunk.size = min(found), max(found), length
    chunk.compressed, chunk.compression, chunk.indexes = length, b'', {}
    tail = _record(CHUNK, CHUNK_HEAD.pack(chunk.first, chunk.last, length, 0, 0),
                   pack('<Q', length), content[:length])
    chunk.end = chunk.start + len(tail)
    for channel, one in times.items():
        chunk.indexes[channel] = chunk.start + len(tail)
        tail += _record(MESSAGE_INDEX, pack('<H', channel),
                        _sized(b''.join(pack('<QQ', *entry) for entry in one)))
    chunk.indexes_end = chunk.start + len(tail)
    return tail


def _read(content, described):
    """
    Read the records of a chunk; return (length of the complete ones, {channel: its messages}).

    described: {SCHEMA, CHANNEL: {number: record}}, gets those of the chunk. A message is (log
    time, place in the content).
    """
    length, times = 0, {}
    for opcode, start, end in _records(io.BytesIO(content), 0, len(content)):
        body = start + RECORD.size
        if end > len(content) or (opcode == MESSAGE and end - body < MESSAGE_HEAD.size):
            break
        if opcode == MESSAGE:
            channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(content, body)
            times.setdefault(channel, []).append((log_time, start))
        elif opcode in described:
            _describe(described, opcode, content[start:end])
        length = end
    return length, times


def _describe(described, opcode, record):
    """Add the record of a schema or channel to described; see `_read`."""
    described[opcode][int.from_bytes(record[RECORD.size:][:2], 'little')] = record


def _records(file, start, stop):
    """Yield (opcode, start, end) of each record; the last one may end behind stop."""
    while start + RECORD.size <= stop:
        file.seek(start)
        opcode, length = RECORD.unpack(file.read(RECORD.size))
        if not opcode:      # zeros, as a file system has them for what was not written
            return
        yield opcode, start, start + RECORD.size + length
        start += RECORD.size + length


def _chunk(file, start, end):
    file.seek(start + RECORD.size)
    first, last, size, _, length = CHUNK_HEAD.unpack(file.read(CHUNK_HEAD.size))
    compression = file.read(min(length, LONGEST_NAME))
    return _Chunk(start, end, first, last, size, compression,
                  int.from_bytes(file.read(8), 'little'))


def _content(file, chunk, stop):
    """Return the content of a chunk as far as it is there; none of a torn compressed one."""
    from rosbags.rosbag2.storage_mcap import DECOMPRESSORS

    start = chunk.start + RECORD.size + CHUNK_HEAD.size + len(chunk.compression) + 8
    stored = _bytes(file, start, min(start + chunk.compressed, stop))
    try:
        return DECOMPRESSORS[chunk.compression.decode()](stored, chunk.size)
    except Exception:   # libraries raise any kind for damaged bytes  # noqa: B902
        return b''


def _bytes(file, start, end):
    file.seek(start)
    return file.read(max(end - start, 0))


def _record(opcode, *parts):
    body = b''.join(parts)
    return RECORD.pack(opcode, len(body)) + body


def _sized(text):
    return pack('<I', len(text)) + text


def _footer(summary):
    return _record(FOOTER, pack('<QQI', summary, 0, 0)) + MAGIC
