# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read files of bags without their end and index, as after a power failure.

rosbags reads a file by its index. Here the complete part of a file gets an index, which is
appended while the file is read, or is a temporary database: the file itself is not changed.
"""
from collections.abc import Callable
from contextlib import closing, suppress
import io
from pathlib import Path
import re
import sqlite3
import tempfile
from typing import NamedTuple

from fuzzy_stereo_ros.bags.cut_mcap import indexed_mcap
from fuzzy_stereo_ros.bags.cut_ros1 import indexed_ros1

DISK_BLOCK = 4096   # bytes, of a file system
CHECKED = 64        # of the last large messages in a database
TORN = 16           # zeros at the end of the last large message that show that it is not whole
COMPUTED = re.compile(r'\bVIRTUAL\b|\bAS\b', re.IGNORECASE)   # of tables or columns, in SQL


class Recovered(NamedTuple):
    """A file of a bag that was given an index."""

    path: object                    # what rosbags opens instead of the file
    content: Callable = bytes       # of a message, from what that has stored of it
    close: Callable = lambda: None  # releases both


def recovered(path):
    """Return the Recovered of a file (Path) of a bag by suffix; any error if there is nothing."""
    if path.suffix == '.db3':
        return _indexed_database(path)
    stop = _written(path)
    if path.suffix == '.mcap':
        return Recovered(IndexedPath(path, '.mcap', *indexed_mcap(path, stop)))
    return Recovered(IndexedPath(path, '.bag', *indexed_ros1(path, stop)))


def is_torn_database(path):
    """Return whether a file (Path) is a .db3 that ends within a page, which rosbags overlooks."""
    if path.suffix != '.db3':
        return False
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


def _database(path, **options):
    """Return a connection to a .db3 that is only read; options: of sqlite3."""
    mode = 'mode=ro' if log_of(path) else 'mode=ro&immutable=1'
    return sqlite3.connect(f'{path.resolve().as_uri()}?{mode}', uri=True, **options)


def log_of(path):
    """
    Return the write-ahead log (Path) of a file (Path) if it is a .db3 that has one, else None.

    Messages stay there, where rosbags does not look, until the database is closed.
    """
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

    def exists(self):
        """Return that the file exists."""
        return True

    def is_dir(self):
        """Return that it is no folder."""
        return False

    def open(self, mode):   # noqa: A003  rosbags calls it
        """Return the file, open for reading."""
        return io.BufferedReader(_IndexedFile(self._path.open(mode, buffering=0), *self._parts))


class _IndexedFile(io.RawIOBase):
    """The open file of an IndexedPath."""

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

    def tell(self):
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
    cut = _database(path, check_same_thread=False)
    folder = tempfile.TemporaryDirectory()

    def close():
        cut.close()
        folder.cleanup()

    def content(row):
        return cut.execute('SELECT data FROM messages WHERE rowid = ?', (int(row),)).fetchone()[0]

    try:
        cut.execute('PRAGMA writable_schema = ON')      # reads a file shorter than it says
        name = Path(folder.name) / f'index{path.suffix}'
        with closing(sqlite3.connect(name)) as index:
            _copy_rows(cut, index, content, sum(
                file.stat().st_size for file in (path, log_of(path)) if file))
            index.commit()
    except BaseException:
        close()
        raise
    return Recovered(name, content, close)


def _copy_rows(cut, index, content, size):
    """Copy what `_indexed_database` needs to another; content: of Recovered. size: bytes."""
    index.executescript("""
        CREATE TABLE schema (schema_version INTEGER, ros_distro TEXT);
        INSERT INTO schema VALUES (4, '');
        CREATE TABLE topics (id INTEGER PRIMARY KEY, name, type, serialization_format,
                             offered_qos_profiles, type_description_hash);
        CREATE TABLE message_definitions (id INTEGER PRIMARY KEY, topic_type, encoding,
                                          encoded_message_definition, type_description_hash);
        CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, data, size);
    """)
    index.executemany('INSERT INTO topics VALUES (:id, :name, :type, :serialization_format, '
                      ':offered_qos_profiles, :type_description_hash)', _topics(cut))
    with suppress(sqlite3.OperationalError):    # older ones have none
        index.executemany('INSERT INTO message_definitions VALUES (?, ?, ?, ?, ?)', cut.execute(
            'SELECT id, topic_type, encoding, encoded_message_definition, type_description_hash '
            'FROM message_definitions'))
    index.executemany('INSERT INTO messages VALUES (?, ?, ?, CAST(? AS BLOB), ?)',
                      _rows(cut, size))
    page, = cut.execute('PRAGMA page_size').fetchone()
    while (lost := _first_lost(rows := index.execute(
            'SELECT id FROM messages WHERE size > ? ORDER BY id DESC LIMIT ?',
            (page, CHECKED)).fetchall(), content)) is not None:
        index.execute('DELETE FROM messages WHERE id >= ?', (lost,))
    # SQLite takes zeros for what a torn page lacks.
    if rows and content(rows[0][0])[-TORN:] == bytes(TORN):
        index.execute('DELETE FROM messages WHERE id >= ?', rows[0])


def _topics(cut):
    """Yield {column: value} of the topics, with what older ones lack."""
    rows = cut.execute('SELECT * FROM topics')
    for row in rows:
        yield {'offered_qos_profiles': '[]', 'type_description_hash': '',
               **dict(zip((column for column, *_ in rows.description), row))}


def _first_lost(rows, content):
    """Return the first row, of the last ones in reverse order, that cannot be read, or None."""
    for row, in reversed(rows):
        try:
            content(row)
        except sqlite3.Error:
            return row
    return None


def _rows(cut, left):
    """Yield the rows of messages in their order, as far as they are; left: bytes of the file."""
    with suppress(sqlite3.Error):
        for row, topic, log_time, size in cut.execute(
                'SELECT rowid, topic_id, timestamp, length(data) FROM messages NOT INDEXED '
                'ORDER BY rowid'):
            left -= size or 0
            if left < 0:
                return
            yield row, topic, log_time, str(row), size
