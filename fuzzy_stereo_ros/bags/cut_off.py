# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read files of bags without their end and index, as after a power failure.

rosbags reads a file by its index. Here the complete chunks of a file get an index, which is
appended while the file is read, and the complete messages of a database are listed in a temporary
one: the file itself is not changed.
"""
from collections import deque
from collections.abc import Callable
from contextlib import closing, suppress
import io
from pathlib import Path
import re
import sqlite3
from struct import iter_unpack, pack, unpack, unpack_from
import tempfile
from typing import NamedTuple

DISK_BLOCK = 4096   # bytes, of a file system
CHECKED = 64        # of the last large messages in a database
ROW = 64            # bytes, of a row beside its content, at the most
TORN = 16           # zeros at the end of the last large message that show that it is not whole
COMPUTED = re.compile(r'\bVIRTUAL\b|\bAS\b', re.IGNORECASE)   # of tables or columns, in SQL
CHUNK, INDEX, MESSAGE, DESCRIPTION, END = 'chunk', 'index', 'message', 'description', 'end'


class Recovered(NamedTuple):
    """A file of a bag that was given an index."""

    path: object                    # what rosbags opens instead of the file
    content: Callable = bytes       # of a message, from what that has stored of it
    close: Callable = lambda: None  # releases both


def recovered(path):
    """Return the Recovered of a file (Path) of a bag by suffix; any error if there is nothing."""
    if path.suffix == '.db3':
        return _indexed_database(path)
    return Recovered(_indexed(path, Mcap if path.suffix == '.mcap' else Ros1))


class Record(NamedTuple):
    """A complete record: its kind, of those above, and its places in the file."""

    kind: str
    channel: bytes      # of which it is, or what it describes
    start: int
    data: int
    end: int
    fields: dict = {}


class Mcap:
    """An .mcap; records, their numbers and fields: https://mcap.dev/spec."""

    MAGIC, SUFFIX = b'\x89MCAP0\r\n', '.mcap'
    KINDS = {2: END, 3: DESCRIPTION, 4: DESCRIPTION, 5: MESSAGE, 6: CHUNK, 7: INDEX, 15: END}
    SCHEMA, CHANNEL = b'\3', b'\4'

    @classmethod
    def records(cls, file, start, stop):
        """Yield each Record, to the first zeros or that is not complete."""
        while start + 9 <= stop:
            opcode, length = unpack('<BQ', _bytes(file, start, start + 9))
            data, end = start + 9, start + 9 + length
            if not opcode or end > stop:
                return
            of = cls.SCHEMA if opcode == cls.SCHEMA[0] else cls.CHANNEL
            yield Record(cls.KINDS.get(opcode, ''), of + _bytes(file, data, data + 2), start,
                         data, end)
            start = end

    @staticmethod
    def content(file, chunk):
        """Return the content of a chunk, without compression."""
        from rosbags.rosbag2.storage_mcap import DECOMPRESSORS

        head = _bytes(file, chunk.data, chunk.end)
        size, name = unpack_from('<16xQ', head)[0], _sized_at(head, 28)
        return DECOMPRESSORS[name.decode()](head[40 + len(name):], size)

    @classmethod
    def index(cls, file, described, chunks, end):
        """Return head, stop and tail for IndexedPath; without a summary rosbags reads all."""
        if not all(indexes for _, indexes in chunks):
            chunks = []
        # Schemas before channels.
        records = [described[key] for key in sorted(described)] if chunks else []
        for chunk, indexes in chunks:
            head = _bytes(file, chunk.data, chunk.data + 4096)
            (first, last, size), name = unpack_from('<QQQ', head), _sized_at(head, 28)
            places = b''.join(channel[1:] + pack('<Q', one.start)
                              for channel, one in indexes.items())
            length = max(one.end for one in indexes.values()) - chunk.end
            records.append(cls._record(8, b''.join((
                pack('<QQQQ', first, last, chunk.start, chunk.end - chunk.start),
                pack('<I', len(places)), places, pack('<QI', length, len(name)), name,
                head[32 + len(name):40 + len(name)], pack('<Q', size)))))
        return b'', end, b''.join((cls._record(15, bytes(4)), *records, cls._record(2, pack(
            '<QQI', (end + 13) * bool(records), 0, 0)), cls.MAGIC))

    @staticmethod
    def _record(opcode, body):
        return pack('<BQ', opcode, len(body)) + body


class Ros1:
    """A .bag of ROS 1; records and their fields: http://wiki.ros.org/Bags/Format/2.0."""

    MAGIC, SUFFIX = b'#ROSBAG V2.0\n', '.bag'
    KINDS = {2: MESSAGE, 4: INDEX, 5: CHUNK, 6: END, 7: DESCRIPTION}

    @classmethod
    def records(cls, file, start, stop):
        """Yield each Record, to the first one that is none or not complete."""
        while start + 8 <= stop:
            data = start + 8 + unpack('<I', _bytes(file, start, start + 4))[0]
            header, fields = _bytes(file, start + 4, data - 4) if data <= stop else b'', {}
            while header:
                field = _sized_at(header, 0)
                name, _, value = field.partition(b'=')
                fields[name.decode('latin-1')], header = value, header[4 + len(field):]
            if len(fields.get('op', b'')) != 1:
                return
            end = data + unpack('<I', _bytes(file, data - 4, data))[0]
            if end > stop:
                return
            yield Record(cls.KINDS.get(fields['op'][0], ''), fields.get('conn', b''), start, data,
                         end, fields)
            start = end

    @staticmethod
    def content(file, chunk):
        """Return the content of a chunk, without compression."""
        from rosbags.rosbag1.reader import decompressors

        return decompressors[chunk.fields['compression'].decode()](
            _bytes(file, chunk.data, chunk.end))

    @classmethod
    def index(cls, file, described, chunks, end):
        """Return head, stop and tail for IndexedPath; ValueError if it does not begin as one."""
        infos = []
        for chunk, indexes in chunks:
            entries = {channel: [*iter_unpack('<II4x', _bytes(
                file, one.data, one.end - (one.end - one.data) % 12))]
                for channel, one in indexes.items()}
            times = [time for several in entries.values() for time in several]
            if times:
                infos.append(cls._record(
                    6, b''.join(channel + pack('<I', len(several))
                                for channel, several in entries.items()),
                    ver=pack('<I', 1), chunk_pos=pack('<Q', chunk.start),
                    count=pack('<I', len(entries)), start_time=pack('<II', *min(times)),
                    end_time=pack('<II', *max(times))))
        begin = len(cls.MAGIC)
        head = bytearray(_bytes(file, 0, next(cls.records(file, begin, end)).end))
        for name, value in (('index_pos', pack('<Q', end)),
                            ('conn_count', pack('<I', len(described))),
                            ('chunk_count', pack('<I', len(infos)))):
            place = head.index(name.encode() + b'=') + len(name) + 1
            head[place:place + len(value)] = value
        return bytes(head), end, b''.join((*described.values(), *infos))

    @staticmethod
    def _record(kind, data, **fields):
        header = b''.join(
            pack('<I', len(name) + 1 + len(value)) + name.encode() + b'=' + value
            for name, value in {'op': bytes([kind]), **fields}.items())
        return pack('<I', len(header)) + header + pack('<I', len(data)) + data


def _indexed(path, form):
    """Return the IndexedPath of a file of Mcap or Ros1; ValueError if it does not begin as one."""
    stop, described, chunks, end = _written(path), {}, [], len(form.MAGIC)
    with open(path, 'rb') as file:
        if _bytes(file, 0, end) != form.MAGIC:
            raise ValueError(f'it does not begin as {form.SUFFIX}')
        for record in form.records(file, end, stop):
            if record.kind == END:
                break
            if record.kind == CHUNK:
                chunks.append((record, {}))
            elif record.kind == INDEX and chunks:
                chunks[-1][1][record.channel] = record
            elif record.kind == DESCRIPTION:
                described[record.channel] = _bytes(file, record.start, record.end)
            end = record.end
        for chunk, indexes in chunks[:]:
            is_last = chunk is chunks[-1][0]
            if not is_last and indexes.keys() <= described.keys():
                continue
            content, found = b'', []
            with suppress(Exception):   # libraries raise any kind for damaged bytes  # noqa: B902
                content = form.content(file, chunk)
                found = [*form.records(io.BytesIO(content), 0, len(content))]
            for record in found:
                if record.kind == DESCRIPTION:
                    described.setdefault(record.channel, content[record.start:record.end])
            channels = {record.channel for record in found if record.kind == MESSAGE}
            if is_last and (not found or found[-1].end < len(content) or (
                    not channels <= indexes.keys() and any(one for _, one in chunks))):
                end = chunks.pop()[0].start
        return IndexedPath(path, form.SUFFIX, *form.index(file, described, chunks, end))


def _bytes(file, start, end):
    file.seek(start)
    return file.read(max(end - start, 0))


def _sized_at(content, place):
    return content[place + 4:][:int.from_bytes(content[place:place + 4], 'little')]


def is_torn(path, reader):
    """Return whether the end of a file (Path) is missing though a reader of rosbags opened it."""
    if path.suffix != '.db3':   # zeros may end the index of a .bag: no connection has 0 messages
        return any(0 in chunk.connection_counts.values()
                   for chunk in getattr(reader, 'chunk_infos', ()))
    with open(path, 'rb') as file:
        page = int.from_bytes(file.read(18)[16:], 'big')
    return bool(page) and path.stat().st_size % (page if page > 1 else 1 << 16) > 0


def check_tables(path):
    """Raise ValueError if a file (Path) is a .db3 with rows that are not stored, as of views."""
    with suppress(sqlite3.Error), closing(_database(path)) as database:
        database.text_factory = lambda text: text.decode(errors='replace')
        database.execute('PRAGMA writable_schema = ON')
        for kind, name, text in database.execute(
                'SELECT type, name, CAST(sql AS TEXT) FROM sqlite_master'):
            if kind not in ('table', 'index') or COMPUTED.search(text or ''):
                raise ValueError(f'{path} cannot be read as a bag: {name!a} is computed')


def _database(path):
    """Return a connection to a .db3 that is only read, for all threads."""
    return sqlite3.connect(_uri(path), uri=True, check_same_thread=False)


def _uri(path):
    mode = 'mode=ro' if log_of(path) else 'mode=ro&immutable=1'
    return f'{path.resolve().as_uri()}?{mode}'


def log_of(path):
    """Return the log of a .db3, whose messages rosbags does not look at; None without one."""
    log = path.with_name(f'{path.name}-wal')
    return log if path.suffix == '.db3' and log.is_file() and log.stat().st_size else None


def _written(path):
    """Return the size of a file without the zeros that a file system puts for lost blocks."""
    size = end = path.stat().st_size
    with open(path, 'rb') as file:
        while end:
            start = (end - 1) // DISK_BLOCK * DISK_BLOCK
            file.seek(start)
            block = file.read(end - start).rstrip(b'\0')
            end = start + len(block)
            if block:
                break
    return size if size - end < DISK_BLOCK else end


class IndexedPath:
    """A path for rosbags of a file with another beginning and another end."""

    def __init__(self, path, suffix, head, stop, tail):
        """Replace the first bytes of a file (Path) by head, and those from stop on by tail."""
        self._path, self.suffix, self._parts = path, suffix, (head, stop, tail)

    def __str__(self):
        return str(self._path)

    def open(self, mode):   # noqa: A003  rosbags calls it
        """Return the file as it is read, buffered; mode: 'rb'. OSError if it cannot be opened."""
        return io.BufferedReader(_IndexedFile(self._path.open(mode, buffering=0), *self._parts))

    def __getattr__(self, name):
        return getattr(self._path, name)


class _IndexedFile(io.RawIOBase):
    def __init__(self, file, head, stop, tail):
        self._file, self._place = file, 0
        self._head, self._stop, self._tail = head, stop, tail

    def readable(self):
        return True

    def seekable(self):
        return True

    def seek(self, offset, whence=io.SEEK_SET):
        self._place = max(0, offset + {
            io.SEEK_SET: 0, io.SEEK_CUR: self._place,
            io.SEEK_END: self._stop + len(self._tail)}[whence])
        return self._place

    def readinto(self, buffer):
        place, size = self._place, len(buffer)
        if place < len(self._head):
            found = self._head[place:place + size]
        elif place < self._stop:
            self._file.seek(place)
            found = self._file.read(min(size, self._stop - place))
        else:
            found = self._tail[place - self._stop:][:size]
        buffer[:len(found)] = found
        self._place += len(found)
        return len(found)

    def close(self):
        self._file.close()
        super().close()


def _indexed_database(path):
    """
    Return the Recovered of a .db3.

    A second database has the same rows, but of each message only the number of its row instead of
    its content. Where there is a log SQLite writes its index (-shm) beside it.
    """
    cut, folder, large = _database(path), tempfile.TemporaryDirectory(), deque(maxlen=CHECKED)

    def close():
        cut.close()
        folder.cleanup()

    def content(row):
        return cut.execute('SELECT data FROM messages WHERE rowid = ?', (int(row),)).fetchone()[0]

    def lost():
        """Yield the rows of large messages that are not whole."""
        is_last = True
        for row in reversed(large):
            with suppress(sqlite3.Error):
                # SQLite takes zeros for a page that is not there, if no other one comes after it.
                found, was_last, is_last = content(row), is_last, False
                if found[-TORN:] != bytes(TORN) or not was_last and len(found) > 2 * DISK_BLOCK:
                    continue
            yield row

    try:
        cut.execute('PRAGMA writable_schema = ON')      # reads a file shorter than it says
        name = Path(folder.name) / f'index{path.suffix}'
        with closing(sqlite3.connect(name.as_uri(), uri=True)) as index:
            index.execute('PRAGMA writable_schema = ON')
            index.execute('ATTACH ? AS cut', (_uri(path),))
            index.execute('CREATE TABLE topics AS SELECT * FROM cut.topics')
            with suppress(sqlite3.OperationalError):    # older ones have none
                index.execute('CREATE TABLE schema AS SELECT * FROM cut.schema')
                index.execute('CREATE TABLE message_definitions AS '
                              'SELECT * FROM cut.message_definitions')
            index.execute('CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, '
                          'data)')
            index.executemany('INSERT INTO messages VALUES (?, ?, ?, CAST(? AS BLOB))', _rows(
                cut, sum(file.stat().st_size for file in (path, log_of(path)) if file), large))
            index.execute('DELETE FROM main.messages WHERE id >= ?',
                          (min(lost(), default=1 << 62),))
            index.commit()
    except BaseException:
        close()
        raise
    return Recovered(name, content, close)


def _rows(cut, left, large):
    """Yield the rows of messages in their order, as far as they are; left: bytes of the file."""
    (page,), before = cut.execute('PRAGMA page_size').fetchone(), 0
    with suppress(sqlite3.Error):
        for row, topic, log_time, size in cut.execute(
                'SELECT rowid, topic_id, timestamp, length(data) FROM messages NOT INDEXED '
                'ORDER BY rowid'):
            left -= size or 0
            if left < 0 or row <= before:       # in a torn page rows are zeros
                return
            before = row
            if size and size > page - ROW:
                large.append(row)
            yield row, topic, log_time, str(row)
