# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Run a module of the package and note what it does to files, sockets and processes."""
# The environment names the module (AUDITED_MODULE) and where to write the notes (AUDITED_NOTES), a
# line of JSON each: [event, what it concerns].
import json
import os
import runpy
import sys

# What writes, speaks with somebody, or starts something, as Python's audit hooks call it.
EVENTS = ('socket.', 'subprocess.', 'os.system', 'os.exec', 'os.fork', 'os.spawn',
          'os.posix_spawn', 'os.mkdir', 'os.rename', 'os.link', 'os.symlink', 'os.chmod',
          'os.remove', 'os.rmdir', 'os.truncate', 'shutil.rmtree', 'urllib.', 'http.', 'ftplib.',
          'sqlite3.connect')
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_TRUNC


def place(where, others):
    """Return a path as a whole, below the open folder that the last other argument may be."""
    if isinstance(where, bytes):
        where = os.fsdecode(where)
    if not isinstance(where, (str, os.PathLike)):
        return str(where)
    if others and type(others[-1]) is int and os.path.isdir(f'/proc/self/fd/{others[-1]}'):
        where = os.path.join(os.readlink(f'/proc/self/fd/{others[-1]}'), where)
    return os.path.abspath(where)


def note_all(notes):
    """Have each event written to a file descriptor from now on."""
    def hook(event, arguments):
        if event == 'open':
            path, mode, flags = arguments
            writes = flags & WRITING if isinstance(flags, int) else set(mode or 'r') & set('wxa+')
            if not writes or isinstance(path, int):
                return
        elif not event.startswith(EVENTS):
            return
        others = () if event == 'open' else arguments[1:]
        for where in arguments[:2 if event in ('os.rename', 'os.link', 'os.symlink') else 1]:
            os.write(notes, (json.dumps([event, place(where, others)]) + '\n').encode())

    sys.addaudithook(hook)


if __name__ == '__main__':
    descriptor = os.open(os.environ['AUDITED_NOTES'], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    note_all(descriptor)
    runpy.run_module(os.environ['AUDITED_MODULE'], run_name='__main__', alter_sys=True)
