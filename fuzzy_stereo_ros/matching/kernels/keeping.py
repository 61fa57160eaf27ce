# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A cache of compiled kernels that may fail, and be used by several processes at once.

numba writes an index and then the code that it names. Two that do so at the same time, or a disk
that is full in between, could leave an index that names the code of other types.
"""
from collections import deque
from contextlib import contextmanager, ExitStack, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:     # where there is none, processes are not kept apart
    fcntl = None

_remarks, _noted = deque(), set()


def note(remark):
    """Have a sentence told by `remarks`, but for one that it has had before."""
    if remark not in _noted:
        _noted.add(remark)
        _remarks.append(remark)


def remarks():
    """Return sentences on what is done without, as kernels cannot be kept; each only once."""
    told = []
    with suppress(IndexError):
        while True:
            told.append(_remarks.popleft())
    return told


@contextmanager
def locked(folder, how):
    """
    Keep other processes out of a folder of kernels, as far as the file system can.

    how: a name of fcntl's. In a folder that can only be read, the lock of those who write is held.
    """
    with ExitStack() as opened:
        for mode in 'ab', 'rb':
            with suppress(OSError):
                lock = opened.enter_context(open(folder / 'lock', mode))
                if fcntl is not None:
                    fcntl.flock(lock, getattr(fcntl, how))
                break
        yield


class Kept:
    """numba's cache of one kernel: what cannot be read is compiled, what cannot be kept is not."""

    def __init__(self, cache, function):
        """Guard a cache of numba's, that of a Python function."""
        self._cache, self._folder = cache, Path(cache.cache_path)
        self._files = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}-*.nb*"

    def __getattr__(self, name):
        return getattr(self._cache, name)

    def load_overload(self, signature, context):
        """Return what was compiled for a signature, None where nothing sound is there."""
        try:
            with locked(self._folder, 'LOCK_SH'):
                return self._cache.load_overload(signature, context)
        except OSError:
            return None
        except Exception:       # noqa: B902  a damaged pickle raises anything
            self._drop()
            return None

    def save_overload(self, signature, compiled):
        """Keep what was compiled for a signature, or note why it cannot be kept."""
        try:
            with locked(self._folder, 'LOCK_EX'):
                self._cache.save_overload(signature, compiled)
        except OSError as error:
            self._drop()
            note(f'compiled kernels can no longer be kept in {self._folder} ({error.strerror}): '
                 'those that are not there are compiled at each start; make room, or set '
                 'NUMBA_CACHE_DIR to another folder')

    def _drop(self):
        """Remove what is kept of this kernel: an index may name what is not there any more."""
        with suppress(OSError), locked(self._folder, 'LOCK_EX'):
            for file in self._folder.glob(self._files):
                file.unlink(missing_ok=True)
