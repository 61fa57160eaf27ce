# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Decorators that compile kernels and cache them on disk for the next process.

There is a file for each kernel, signature and processor, in a folder named by a hash of all
sources. Several processes read and write it at once without locks: two that write the same file
write the same content.
"""
from contextlib import contextmanager, suppress
from functools import partial
import gc
import hashlib
import os
from pathlib import Path
import shutil
import sys
import tempfile
from typing import NamedTuple

import numba
from numba import types
from numba.core.caching import IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.registry import CPUDispatcher

NAME = 'fuzzy_stereo_ros'
MOST_FOLDERS = 8    # in a place: of other sources, other versions of Python and numba
PROBE = bytes(1 << 16)      # a full disk still takes files without content
SOURCES = Path(__file__).parent


class Folders(NamedTuple):
    """
    The folders of compiled kernels.

    writable: a Path to write to, None where there is none. readable: more Paths to read from.
    warning: a sentence on what the lack of a folder costs, '' where there is one.
    """

    writable: Path | None
    readable: tuple
    warning: str


def choose_folders():
    """
    Return the Folders of this process; make the writable one, and remove those long not used.

    It is in NUMBA_CACHE_DIR, else beside the kernels, else in the user's cache. The others that
    cannot be written to are read.
    """
    wanted = [Path(numba.config.CACHE_DIR) / NAME] if numba.config.CACHE_DIR else []
    named = os.environ.get('XDG_CACHE_HOME', '')
    user = Path(named if os.path.isabs(named) else os.path.expanduser('~/.cache')) / NAME
    places = [*wanted, SOURCES / '__pycache__', user]
    # Without HOME and without a name in the system's list of users `~` remains.
    folders = [place.absolute() / folder_name() for place in places if str(place)[0] != '~']
    readable = tuple(folder for folder in folders
                     if folder.is_dir() and not os.access(folder, os.W_OK))
    denied = []
    for folder in folders:
        try:
            make_folder(folder)
        except OSError as error:
            denied.append(f'{folder.parent}: {error.strerror}')
            continue
        return Folders(folder, readable, '' if not (wanted and denied) else
                       f'compiled kernels cannot be kept in NUMBA_CACHE_DIR ({denied[0]}): they '
                       f'are kept in {folder.parent}')
    return Folders(None, readable, (
        f"no folder for compiled kernels can be written to ({', '.join(denied)}): they are "
        'compiled at each start, which takes up to 60 s; set NUMBA_CACHE_DIR to a folder that '
        'can be'))


def make_folder(folder):
    """Make a folder where there is none, and remove those not used for longest beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder, buffering=0) as probe:
        if probe.write(PROBE) < len(PROBE):
            probe.write(PROBE)      # tells why
    os.utime(folder)    # it is in use
    ages = {}
    for other in folder.parent.glob('kernels_*'):
        with suppress(OSError):     # another process has removed it
            ages[other] = -other.stat().st_mtime_ns
    for other in sorted(ages, key=ages.get)[MOST_FOLDERS:]:
        shutil.rmtree(other, ignore_errors=True)


def folder_name():
    """Return the name of the cache folder: hash of the sources, Python and numba versions."""
    digest = hashlib.sha256(repr(numba.config.BOUNDSCHECK).encode())
    for source in sorted(SOURCES.rglob('*.py')):
        content = source.read_bytes()
        name = source.relative_to(SOURCES).as_posix()
        digest.update(f'{name} {len(content)} '.encode() + content)
    return (f'kernels_{sys.implementation.cache_tag}_numba-{numba.__version__}_'
            f'{digest.hexdigest()[:16]}')


_remarks, _prepare = {}, []     # sentences, and whether they were returned; what to call


def remarks():
    """Return new sentences on kernels that could not be read or cached, each only once."""
    new = [remark for remark, told in list(_remarks.items()) if not told]
    _remarks.update(dict.fromkeys(new, True))
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


class KernelCache:
    """
    The cache of one kernel, as numba's dispatchers use it; no error of a file or disk leaves it.

    cache_path: the folder that it is written to, or None
    """

    def __init__(self, function, folders):
        """Cache the compiled forms of a Python function in Folders."""
        self._name = f'{function.__module__}.{function.__qualname__}'
        self.cache_path, self._folders = folders.writable, folders

    def load_overload(self, signature, context):
        """Return the cached code of a signature, or None."""
        context.refresh()
        found = self._found(signature, context)
        if found is None:
            if self.cache_path is None:
                _remarks.setdefault(self._folders.warning, False)
            if _prepare:
                _prepare.pop()()
                found = self._found(signature, context)
        return found

    def save_overload(self, signature, compiled):
        """Cache the code of a signature, or remark why that cannot be done."""
        if self.cache_path is None or compiled.library.has_dynamic_globals:
            return
        file = self._file(self.cache_path, signature, compiled.codegen)
        try:
            file.flush()        # what is there may be damaged
            file.save(signature, compiled._reduce())
        except OSError as error:
            _remarks.setdefault(
                f'compiled kernels can no longer be kept in {self.cache_path} ({error.strerror}): '
                'those that are not there are compiled at each start; make room, or set '
                'NUMBA_CACHE_DIR to another folder', False)

    def _found(self, signature, context):
        """Return the cached code of a signature for this processor, or None."""
        for folder in filter(None, (self.cache_path, *self._folders.readable)):
            # Whatever is there and damaged is compiled and replaced; it may raise anything.
            with suppress(Exception):
                cached = self._file(folder, signature, context.codegen()).load(signature)
                if cached is not None:
                    return CompileResult._rebuild(context, *cached)
        return None

    def _file(self, folder, signature, codegen):
        """Return numba's index and data files for a signature and the processor of codegen."""
        about = repr((signature, *codegen.magic_tuple())).encode()
        name = f'{self._name}-{hashlib.sha256(about).hexdigest()[:16]}'
        return IndexDataCacheFile(str(folder), name, None)


_folders = choose_folders()
FOLDER = _folders.writable
if _folders.warning and (FOLDER or not _folders.readable):      # else what is read may suffice
    _remarks[_folders.warning] = False


class _PartLibrary(JITCodeLibrary):
    """Code that only callers link: optimised, but never made machine code alone."""

    def _finalize_final_module(self):
        self._finalized = True

    @property
    def codegen(self):
        """Where numba sets the environment of machine code: there is neither."""
        return self

    def set_env(self, *_):
        """Do nothing."""


class _PartCompiler(Compiler):
    def define_pipelines(self):
        self.state.library = _PartLibrary(self.state.targetctx.codegen(),
                                          self.state.func_id.func_qualname)
        return super().define_pipelines()


class _Kernel(CPUDispatcher):
    """The dispatcher of a kernel; kernels that call it link its unfinished library."""

    def __init__(self, function, allocates=False, **options):
        options |= {'nopython': True, 'boundscheck': None, 'no_cfunc_wrapper': True,
                    'error_model': 'numpy', '_nrt': allocates}
        super().__init__(function, targetoptions=options)
        self._part = CPUDispatcher(function, targetoptions={**options, 'no_cpython_wrapper': True},
                                   pipeline_class=_PartCompiler)

    def get_call_template(self, args, kws):
        """Return what numba types a call by; whether arguments are literals makes no new part."""
        return self._part.get_call_template(tuple(map(types.unliteral, args)), kws)

    def get_overload(self, signature):
        """Return the code that a call links."""
        return self._part.get_overload(signature)

    def compile(self, signature):       # noqa: A003  numba calls it so
        """Compile it, without searching memory for garbage meanwhile: a fifth of the time."""
        enabled = gc.isenabled()
        gc.disable()
        try:
            return super().compile(signature)
        finally:
            if enabled:
                gc.enable()


def kernel(function=None, **options):
    """
    Compile a function that Python calls: without the GIL, and cached for the next process.

    options: `allocates`, for a function that makes arrays, and further ones of njit. Elsewhere
    numba need not count who uses an array: that costs more than a short function, most of all
    where several threads count. Numba does not look for divisions by 0. Python passes the fields
    of named tuples, which the kernel names again: numba before 0.60 loses the types of the first
    fields of a named tuple at each call, and keeps the rest in memory for ever.
    """
    if function is None:
        return partial(kernel, **options)
    dispatcher = _Kernel(function, nogil=True, **options)
    # Not numba's public interface, whose caches do not know of changes in the kernels that a
    # kernel calls, read no folder that cannot be written to, and let errors of disks out.
    dispatcher._cache = KernelCache(function, _folders)
    return dispatcher


def inlined(function):
    """Compile a function into every kernel that calls it."""
    return _Kernel(function, forceinline=True)
