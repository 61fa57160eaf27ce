# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compiled kernels kept in files of their own for each kernel, signature and processor.

So several processes read and write at once without locks: who writes the same writes the same.
"""
from collections import deque
from contextlib import contextmanager, suppress
import hashlib

from numba.core.caching import IndexDataCacheFile, NullCache
from numba.core.compiler import CompileResult

# What processors have, by LLVM's names, for which wheels bring kernels; the best comes first.
_V3 = {'avx2', 'bmi', 'bmi2', 'f16c', 'fma', 'lzcnt', 'movbe'}
LEVELS = {'x86-64-v4': _V3 | {'avx512bw', 'avx512cd', 'avx512dq', 'avx512f', 'avx512vl'},
          'x86-64-v3': _V3}

_remarks, _noted, _prepare = deque(), set(), []


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
def before_compiling(prepare):
    """Have prepare() called once, before the first kernel that is kept nowhere is compiled."""
    _prepare.append(prepare)
    try:
        yield
    finally:
        with suppress(ValueError):
            _prepare.remove(prepare)


class KeptKernel(NullCache):
    """numba's cache of one kernel: what cannot be read is compiled, what cannot be kept is not."""

    def __init__(self, function, folders):
        """Keep what a Python function is compiled to in Folders."""
        self._name = f'{function.__module__}.{function.__qualname__}'
        self._folder, self._folders = folders.kept, folders

    @property
    def cache_path(self):
        """The folder that it is kept in; None: nowhere."""
        return self._folder and str(self._folder)

    def load_overload(self, signature, context):
        """Return what was compiled for a signature, None where nothing sound is there."""
        context.refresh()
        found = self._found(signature, context)
        if found is None:
            if self._folders.on_compiling:
                note(self._folders.on_compiling)
            if _prepare:
                _prepare.pop()()
                found = self._found(signature, context)
        return found

    def save_overload(self, signature, compiled):
        """Keep what was compiled for a signature, or note why it cannot be kept."""
        if self._folder is None or compiled.library.has_dynamic_globals:
            return
        file = self._file(self._folder, signature, *compiled.codegen.magic_tuple())
        try:
            file.flush()        # what is there may be damaged
            file.save(signature, compiled._reduce())
        except OSError as error:
            note(f'compiled kernels can no longer be kept in {self._folder} ({error.strerror}): '
                 'those that are not there are compiled at each start; make room, or set '
                 'NUMBA_CACHE_DIR to another folder')

    def _found(self, signature, context):
        """Return what is kept of a signature for this processor or the best of its levels."""
        triple, *processor = context.codegen().magic_tuple()
        has = set(processor[1].replace('+', '').split(','))
        processors = [processor, *([level, ''] for level, needed in LEVELS.items()
                                   if needed <= has)]
        for folder in filter(None, (self._folder, *self._folders.readable)):
            for one in processors:
                # Whatever is there and damaged is compiled and replaced; it may raise anything.
                with suppress(Exception):
                    kept = self._file(folder, signature, triple, *one).load(signature)
                    if kept is not None:
                        return CompileResult._rebuild(context, *kept)
        return None

    def _file(self, folder, signature, triple, processor, features):
        """Return numba's files, an index and what it names, for a signature and a processor."""
        about = repr((signature, triple, processor, features)).encode()
        name = f'{self._name}-{hashlib.sha256(about).hexdigest()[:16]}'
        return IndexDataCacheFile(str(folder), name, None)
