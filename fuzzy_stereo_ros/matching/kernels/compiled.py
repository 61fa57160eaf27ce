# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Decorators that compile kernels and cache them on disk for the next process.

The cache folder is named by a hash of the sources, since numba's own cache does not see a change
in a function that a kernel calls. It has a file for each kernel, signature and processor: in the
place of numba's index of signatures, which two processes that write it at once can mix up.
"""
from contextlib import contextmanager, suppress
from functools import partial
import hashlib
import os
from pathlib import Path
import shutil
import sys

import numba
from numba.core.caching import IndexDataCacheFile, NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder

NAME = 'fuzzy_stereo_ros'
KEPT = 8        # folders in a place: of other sources, other versions of Python and numba
SOURCES = Path(__file__).parent
_remarks, _prepare = {}, []


def choose_folders():
    """
    Return (folder, others, warning): where compiled kernels are written to, and only read from.

    folder is in NUMBA_CACHE_DIR, else beside the kernels, else in the user's cache; it is made,
    and others there that were not used for long are removed. It is None where every place is
    denied. warning: a sentence on what that costs, '' if nothing.
    """
    wanted = [Path(numba.config.CACHE_DIR) / NAME] if numba.config.CACHE_DIR else []
    places = [*wanted, SOURCES / '__pycache__', *_user_cache()]
    folders = {place: place.absolute() / folder_name() for place in places}
    others = [folder for folder in folders.values()
              if folder.is_dir() and not os.access(folder, os.W_OK)]
    denied = []
    for place, folder in folders.items():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            os.utime(folder)    # it is in use
        except OSError as error:
            denied.append(f'{place}: {error.strerror}')
            continue
        _remove_older(folder)
        return folder, others, '' if not (wanted and denied) else (
            f'compiled kernels cannot be kept in NUMBA_CACHE_DIR ({denied[0]}): they are kept in '
            f'{place}')
    return None, others, (
        f"no folder for compiled kernels can be written to ({', '.join(denied)}): they are "
        'compiled at each start, which takes up to 60 s; set NUMBA_CACHE_DIR to a folder that '
        'can be')


def folder_name():
    """Return the name of the cache folder: hash of the sources, Python and numba versions."""
    digest = hashlib.sha256(repr(numba.config.BOUNDSCHECK).encode())
    for source in sorted(SOURCES.rglob('*.py')):
        content = source.read_bytes()
        name = source.relative_to(SOURCES).as_posix()
        digest.update(f'{name} {len(content)} '.encode() + content)
    return (f'kernels_{sys.implementation.cache_tag}_numba-{numba.__version__}_'
            f'{digest.hexdigest()[:16]}')


def _user_cache():
    """Return the user's cache for this package in a list, which is empty where there is none."""
    named = os.environ.get('XDG_CACHE_HOME', '')
    place = Path(named if os.path.isabs(named) else os.path.expanduser('~/.cache'))
    # Without HOME and without a name in the system's list of users `~` remains.
    return [place / NAME] if place.is_absolute() else []


def _remove_older(folder):
    """Remove all but the most recently used folders of kernels in a folder's parent."""
    ages = {}
    for other in folder.parent.glob('kernels_*'):
        with suppress(OSError):     # another process may have removed it
            ages[other] = -other.stat().st_mtime_ns
    for other in sorted(ages, key=ages.get)[KEPT:]:
        shutil.rmtree(other, ignore_errors=True)


def note(remark):
    """Add a sentence to `remarks`, once in a process."""
    _remarks.setdefault(remark, True)


def remarks():
    """Return new sentences on kernels that could not be cached, each only once."""
    new = [remark for remark, is_new in [*_remarks.items()] if is_new]
    _remarks.update(dict.fromkeys(new, False))
    return new


@contextmanager
def before_compiling(prepare):
    """Call prepare() once, before the first kernel that is not cached is compiled."""
    _prepare.append(prepare)
    try:
        yield
    finally:
        with suppress(ValueError):
            _prepare.remove(prepare)


class _KernelCache(NullCache):
    """Cache of one kernel for numba; no error of a file or disk leaves it."""

    def __init__(self, function):
        self._name = f'{function.__module__}.{function.__qualname__}'

    def load_overload(self, signature, context):
        """Return the cached code of a signature, or None."""
        context.refresh()
        found = self._found(signature, context)
        if found is None:
            if FOLDER is None:
                note(_warning)
            if _prepare:
                _prepare.pop()()
                found = self._found(signature, context)
        return found

    def save_overload(self, signature, compiled):
        """Cache the code of a signature, or note why that cannot be done."""
        if FOLDER is None or compiled.library.has_dynamic_globals:
            return
        file = self._file(FOLDER, signature, compiled.codegen)
        try:
            file.flush()        # what is there may be damaged
            file.save(signature, compiled._reduce())
        except OSError as error:
            note(f'compiled kernels can no longer be kept in {FOLDER} ({error.strerror}): '
                 'those that are not there are compiled at each start; make room, or set '
                 'NUMBA_CACHE_DIR to another folder')

    def _found(self, signature, context):
        """Return the cached code of a signature for this processor, or None."""
        for folder in filter(None, (FOLDER, *_others)):
            # Whatever is there and damaged is compiled and replaced; it may raise anything.
            with suppress(Exception):
                kept = self._file(folder, signature, context.codegen()).load(signature)
                if kept is not None:
                    return CompileResult._rebuild(context, *kept)
        return None

    def _file(self, folder, signature, codegen):
        """Return numba's index and data files for a signature and the processor of codegen."""
        about = repr((signature, *codegen.magic_tuple())).encode()
        name = f'{self._name}-{hashlib.sha256(about).hexdigest()[:16]}'
        return IndexDataCacheFile(str(folder), name, None)


FOLDER, _others, _warning = choose_folders()
if _warning and (FOLDER or not _others):        # else what is read may suffice
    note(_warning)


class _Part(JITCodeLibrary):
    """Code that callers link: optimised, but never made machine code alone."""

    def _finalize_final_module(self):
        self._finalized = True

    @property
    def codegen(self):
        """Where numba sets the environment of machine code: there is neither."""
        return self

    def set_env(self, *_):
        """Do nothing."""


class _PartCompiler(CompilerBase):
    def define_pipelines(self):
        state = self.state
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        return [DefaultPassBuilder.define_nopython_pipeline(state)]


def kernel(function=None, *, allocates=False, **options):
    """
    Compile a function that Python calls: without the GIL, and cached for the next process.

    allocates: it makes arrays. Elsewhere numba need not count who uses an array: that costs more
    than a short function, most of all where several threads count. options: further ones of njit.
    Numba does not look for divisions by 0. Python passes the fields of named tuples, which the
    kernel names again: numba before 0.60 loses the types of the first fields of a named tuple at
    each call, and keeps the rest in memory for ever.
    """
    if function is None:
        return partial(kernel, allocates=allocates, **options)
    dispatcher = _compiled(function, nogil=True, _nrt=allocates, **options)
    dispatcher._cache = _KernelCache(function)
    return dispatcher


def inlined(function):
    """Compile a function into every kernel that calls it, which takes a third less time."""
    return _compiled(function, forceinline=True, _nrt=False, no_cpython_wrapper=True,
                     pipeline_class=_PartCompiler)


def _compiled(function, **options):
    dispatcher = numba.njit(boundscheck=None, no_cfunc_wrapper=True, error_model='numpy',
                            **options)(function)
    call = dispatcher.get_call_template
    # A literal among the arguments would make numba compile the function again.
    dispatcher.get_call_template = lambda arguments, names: call(
        tuple(map(numba.types.unliteral, arguments)), names)
    return dispatcher
