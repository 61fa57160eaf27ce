# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Decorators that compile kernels and cache them on disk for the next process.

There is a file for each kernel, signature and processor, in a folder named by a hash of all
sources. Several processes read and write it at once without locks: two that write the same file
write the same content.
"""
from contextlib import suppress
from functools import partial
import hashlib
import os
from pathlib import Path
from queue import SimpleQueue
import shutil
import sys
import tempfile
import threading

import numba
from numba.core import types
from numba.core.caching import IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary, ll
from numba.core.compiler import Compiler, CompileResult
from numba.core.runtime import rtsys
from numba.extending import register_jitable
from numba.np import arrayobj

NAME = 'fuzzy_stereo_ros'
MOST_FOLDERS = 8    # in a place: of other sources, other versions of Python and numba
PROBE = bytes(1 << 16)      # a full disk still takes files without content
SOURCES = Path(__file__).parent
OPTIONS = {'boundscheck': None, 'no_cfunc_wrapper': True, 'error_model': 'numpy'}

kernels = []    # all that `kernel` has made
compilers = []  # compile(config), to be called where kernels of a MatcherConfig are not cached
before_first = []   # of these the calls for the newest matcher, until the first such kernel
_remarks = {}   # sentences, and whether `remarks` returned them


def remarks():
    """Return new sentences on kernels that could not be read or cached, each only once."""
    new = [remark for remark in list(_remarks) if not _remarks[remark]]
    _remarks.update(dict.fromkeys(new, True))
    return new


def expect(config):
    """Have the kernels of a MatcherConfig compiled by the compilers, unless they are cached."""
    before_first[:] = [partial(one, config) for one in compilers if FOLDER]


def choose_folders():
    """
    Return a folder to keep compiled kernels in, all to read from, and what denied ones cost.

    The first (a Path, None where there is none) is made in NUMBA_CACHE_DIR, else beside the
    kernels, else in the user's cache. Those before it, which cannot be written to, are read, too.
    The last is a sentence, '' if nothing is to be said.
    """
    chosen = os.environ.get('XDG_CACHE_HOME', '')
    user = chosen if os.path.isabs(chosen) else os.path.expanduser('~/.cache')
    wanted = [Path(numba.config.CACHE_DIR, NAME)] if numba.config.CACHE_DIR else []
    # Without HOME and without a name in the system's list of users `~` remains.
    places = [place.absolute() for place in (*wanted, SOURCES / '__pycache__', Path(user, NAME))
              if str(place)[0] != '~']
    folders, denied = [place / folder_name() for place in places], []
    for number, folder in enumerate(folders, 1):
        try:
            make_folder(folder)
        except OSError as error:
            denied.append(f'{folder.parent}: {error.strerror}')
            continue
        return folder, folders[:number], '' if not (wanted and denied) else (
            f'compiled kernels cannot be kept in NUMBA_CACHE_DIR ({denied[0]}): they are kept in '
            f'{folder.parent}')
    return None, folders, (
        f"no folder for compiled kernels can be written to ({', '.join(denied)}): they are "
        'compiled at each start, which takes up to 60 s; set NUMBA_CACHE_DIR to a folder that '
        'can be')


def make_folder(folder):
    """Make a folder where there is none, and remove those not used for longest beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as probe:
        probe.write(PROBE)
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


FOLDER, READ, WARNING = choose_folders()
if WARNING and (FOLDER or not any(any(folder.glob('*.nbi')) for folder in READ)):
    _remarks[WARNING] = False   # else what is read may suffice


class KernelCache:
    """
    The cache of one kernel, as numba's dispatchers use it; no error of a file or disk leaves it.

    cache_path: the folder that it is written to, or None
    """

    cache_path = FOLDER

    def __init__(self, function):
        """Cache the compiled forms of a Python function."""
        self._name = f'{function.__module__}.{function.__qualname__}'

    def load_overload(self, signature, context):
        """Return the cached code of a signature, or None."""
        rtsys.initialize(context)   # what loaded code needs; numba prepares compiling as it begins
        found = self._found(signature, context)
        if found is None:
            if FOLDER is None:
                _remarks.setdefault(WARNING, False)
            if before_first:
                before_first.pop()()
                found = self._found(signature, context)
        return found

    def save_overload(self, signature, compiled):
        """Cache the code of a signature, or remark why that cannot be done."""
        if FOLDER is None:
            return
        file = self._file(FOLDER, signature, compiled.codegen)
        try:
            file.flush()        # what is there may be damaged
            file.save(signature, _to_be_called(compiled))
        except OSError as error:
            _remarks.setdefault(
                f'compiled kernels can no longer be kept in {FOLDER} ({error.strerror}): those '
                'that are not there are compiled at each start; make room, or set '
                'NUMBA_CACHE_DIR to another folder', False)

    def _found(self, signature, context):
        """Return the cached code of a signature for this processor, or None."""
        for folder in READ:
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


def _to_be_called(compiled):
    """Return what numba caches of a kernel, without what code that it becomes part of needs."""
    # numba calls what the bitcode defines, and reads an environment for its constants alone
    (name, kind, (machine_code, _)), description, *others, environments = compiled._reduce()
    defined = f'define void @"{description.llvm_cpython_wrapper_name}"() {{ ret void }}'
    return ((name, kind, (machine_code, ll.parse_assembly(defined).as_bitcode())), description,
            *others, tuple(one for one in environments if one.consts))


def kernel(function=None, allocates=False):
    """
    Compile a function that Python calls: without the GIL, and cached for the next process.

    allocates: whether it makes arrays. Elsewhere numba need not count who uses an array: that
    costs more than a short function, most of all where several threads count. Numba does not
    look for divisions by 0. Python passes the fields of named tuples, which the kernel names
    again: numba before 0.60 loses the types of the first fields of a named tuple at each call,
    and keeps the rest in memory for ever.
    """
    if function is None:
        return partial(kernel, allocates=allocates)
    dispatcher = numba.njit(function, nogil=True, _nrt=allocates, **OPTIONS)
    # Not numba's public interface, whose caches do not know of changes in the kernels that a
    # kernel calls, read no folder that cannot be written to, and let errors of disks out.
    dispatcher._cache = KernelCache(function)
    dispatcher._compile_for_args = partial(_uninterrupted, dispatcher._compile_for_args)
    kernels.append(dispatcher)
    return dispatcher


def _uninterrupted(call, *arguments, **named):
    """
    Return call(...), which the main thread leaves to another one.

    An interrupt comes to the main thread, at any line: while numba compiles or loads code, its
    locks would stay taken for ever, or the interrupt would be lost in a finalizer.
    """
    if threading.current_thread() is not threading.main_thread():
        return call(*arguments, **named)
    answers = SimpleQueue()

    def answer():
        try:
            answers.put((call(*arguments, **named), None))
        except BaseException as error:      # raised below
            answers.put((None, error))
    threading.Thread(target=answer, daemon=True).start()
    found, error = answers.get()
    if error is not None:
        raise error
    return found


class _PartLibrary(JITCodeLibrary):
    """Code that only callers link: they optimise it once, and make machine code of it."""

    def _optimize_final_module(self):
        pass

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


_usual_index = getattr(arrayobj, 'fix_integer_index', None)     # not of numba's interface


def _index(context, builder, kind, index, size):
    """
    Return an index as numba does, but in kernels only constants may count from the end.

    Else there is a choice at each element, and LLVM before 15, as in numba 0.58, makes no vectors
    of such a loop.
    """
    if hasattr(index, 'constant') or NAME not in builder.function.name:
        return _usual_index(context, builder, kind, index, size)
    return context.cast(builder, index, kind, types.intp)


arrayobj.fix_integer_index = _index     # of what is compiled from now on


def called(function=None, allocates=False, **options):
    """Compile a function for the kernels that call it; allocates: as of `kernel`."""
    if function is None:
        return partial(called, allocates=allocates, **options)
    return register_jitable(_nrt=allocates, no_cpython_wrapper=True,
                            pipeline_class=_PartCompiler, **OPTIONS, **options)(function)


inlined = partial(called, forceinline=True)     # compiled into every kernel that calls it
