# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A bag of ROS 2 that is readable whatever ends its writing, and can be continued."""
from array import array
from collections import Counter
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
import shutil
import sqlite3

from fuzzy_stereo_ros.bags.database_paths import DatabasePath
from fuzzy_stereo_ros.bags.parts import (
    number_of, read_part, read_parts, rescue, SUFFIXES, write_metadata)
from fuzzy_stereo_ros.bags.reading import NO_ROSBAGS, text_of
import numpy as np

FORMATS = tuple(SUFFIXES)
PART_BYTES = 2**30      # a file ends beyond; viewers read one without an index up to this size
UNFINISHED = 'unfinished'       # folder in the bag's folder, where a file is while it is written
ROOM = 'room'           # file in UNFINISHED that is given up on a full disk, so that a bag can end
ROOM_BYTES = 2**16
MOST_GIVEN_UP = 3       # chunks, where that is not enough


class BagFolder:
    """
    A folder with a bag in files of limited size, written by one thread.

    counts: Counter of messages by topic, of all files. last: ns, when the newest was logged, None
    before the first.
    """

    def __init__(self, folder, storage='mcap'):
        """
        Continue the bag of a folder, or begin one; nothing is written yet.

        storage: one of `FORMATS`.
        Raises ValueError where the folder's files cannot be read, OSError where not written.
        """
        self._folder, self._storage = Path(folder), storage
        self._writer, self._connections, self._broken = None, {}, False
        self._parts = read_parts(self._folder, storage)
        for left in self._unfinished():
            self._keep(left)
        self._count_parts()

    def write(self, topic, kind, typestore, content, logged, qualities=()):
        """
        Write a message.

        kind, typestore: of rosbags, the type and where its definition is. content: bytes, CDR.
        logged: ns, never less than that of the message before. qualities: list of rosbags' Qos.
        Raises OSError where it cannot be written; what was written so far is then a bag.
        """
        self._guard(self._write, topic, kind, typestore, content, logged, qualities)

    def commit(self):
        """
        Have what was written survive the end of the process, but for the last chunk of an .mcap.

        Raises OSError as `write` does.
        """
        self._guard(self._commit)

    def close(self):
        """Close the bag; OSError as of `write`."""
        self._guard(self._close)

    def _write(self, topic, kind, typestore, content, logged, qualities):
        if self._writer is None:
            self._writer = self._opened()
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=typestore, offered_qos_profiles=qualities)
        self._writer.write(self._connections[topic], logged, content)
        self.counts[topic] += 1
        self.last = logged

    def _opened(self):
        from rosbags.rosbag2 import StoragePlugin, Writer

        number = 1 + max((number_of(Path(part.name)) for part in self._parts), default=-1)
        shutil.rmtree(self._folder / UNFINISHED, ignore_errors=True)    # without a message in it
        name = f'{self._folder.resolve().name}_{number}'     # `.` has no name of its own
        path = self._folder / UNFINISHED / name
        writer = Writer(path, version=Writer.VERSION_LATEST,
                        storage_plugin=StoragePlugin[self._storage.upper()])
        writer.path = DatabasePath(path)    # it makes a plain one of what it is given
        writer.open()
        (self._folder / UNFINISHED / ROOM).write_bytes(bytes(ROOM_BYTES))
        if self._storage == 'sqlite3':
            # Survives the end of the process, if not that of the machine; waits for no disk.
            writer.storage.conn.execute('PRAGMA synchronous = OFF')
        return writer

    def _commit(self):
        if self._writer is None:
            return
        if self._storage == 'sqlite3':
            self._writer.storage.conn.commit()
        if sum(path.stat().st_size for path in self._unfinished()) > PART_BYTES:
            self._close()

    def _close(self):
        if self._writer is None:
            return
        self._writer.close()
        self._writer, self._connections = None, {}
        for left in self._unfinished():
            self._keep(left)

    def _guard(self, action, *arguments):
        """Call what writes; where that fails, make what was written a bag, once."""
        if self._broken:
            return
        try:
            action(*arguments)
        except (OSError, sqlite3.Error) as error:
            self._broken = True
            self._rescue()
            self._count_parts()
            raise OSError(f'{self._folder} cannot be written any further: {text_of(error)}') \
                from error

    def _rescue(self):
        if self._writer is not None:
            with suppress(OSError, sqlite3.Error):  # its buffer has no room on the disk either
                self._writer.abort()
        with suppress(OSError):
            (self._folder / UNFINISHED / ROOM).unlink(missing_ok=True)
        for given_up in range(MOST_GIVEN_UP + 1):
            with suppress(OSError):
                for left in self._unfinished():
                    self._keep(left, given_up)
                return

    def _keep(self, left, given_up=0):
        """Make the unfinished file a part of the bag."""
        part = read_part(left) if rescue(left, given_up) else None
        if part is not None:
            self._parts.append(part)
        try:
            write_metadata(self._folder, self._storage, self._parts)
        except OSError:
            if part is not None:
                self._parts.pop()       # another attempt gives up more of it
            raise
        if part is not None:
            left.rename(self._folder / left.name)
        shutil.rmtree(self._folder / UNFINISHED)

    def _count_parts(self):
        self.counts = sum((part.counts for part in self._parts), Counter())
        self.last = max((part.last for part in self._parts), default=None)

    def _unfinished(self):
        """Return the file that is not finished, in a list, which is empty where there is none."""
        return list(self._folder.glob(f'{UNFINISHED}/*/*{SUFFIXES[self._storage]}'))


class Messages:
    """Messages of ROS 2 Jazzy as rosbags has them: made empty, filled by others, made bytes."""

    def __init__(self):
        """Load the types; ValueError where there is no rosbags."""
        try:
            from rosbags.typesys import get_typestore, Stores
        except ImportError:
            raise ValueError(NO_ROSBAGS) from None

        self.typestore = get_typestore(Stores.ROS2_JAZZY)

    def make(self, kind, **values):
        """Return a message of a type, as `sensor_msgs/msg/Image`, empty but for the values."""
        from rosbags.convert.converter import default_message

        message = default_message(self.typestore, kind)
        for name, value in values.items():
            setattr(message, name, value)
        return message

    def content(self, message):
        """Return the bytes of a message, CDR."""
        _make_arrays(message)
        return self.typestore.serialize_cdr(message, message.__msgtype__)


def _make_arrays(message):
    """Make each array.array of a message a NumPy array of the same memory, as rosbags wants it."""
    for field in fields(message):
        value = getattr(message, field.name)
        if isinstance(value, array):
            setattr(message, field.name, np.asarray(value))
        elif is_dataclass(value):
            _make_arrays(value)
