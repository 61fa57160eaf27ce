# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How kernels are compiled, and kept for the next process: the decorators of all of them."""
from contextlib import contextmanager
from functools import partial
from pathlib import Path
import threading

from fuzzy_stereo_ros.matching.kernels.cache_folder import choose_folder
from fuzzy_stereo_ros.matching.kernels.keeping import Kept, note
from numba import config, njit

FOLDER, _remark = choose_folder()
if _remark:
    note(_remark)
_setting = threading.Lock()


def kernel(function=None, **options):
    """
    Compile a function that Python calls: without the GIL, and kept for the next process.

    options: more of them for njit. What Python calls it with are no named tuples but their fields,
    which the kernel names again. numba reads all names at each call; before 0.60 it then forgets
    the first 40 bytes of what it has read, and keeps that call for ever.
    """
    if function is None:
        return partial(kernel, **options)
    dispatcher = njit(nogil=True, **options)(function)
    if config.DISABLE_JIT or FOLDER is None:
        return dispatcher
    return _kept(dispatcher) or njit(nogil=True, **options)(function)


def inlined(function):
    """Compile a function into every kernel that calls it."""
    return njit(forceinline=True)(function)


def _kept(dispatcher):
    """Return a dispatcher with its cache in FOLDER, None where numba does not take that."""
    with _numba_keeps_in(FOLDER):
        try:
            dispatcher.enable_caching()
        except RuntimeError:
            return None
    if FOLDER not in Path(dispatcher.stats.cache_path).parents:
        return None
    # Not numba's public interface, in which an error of the cache comes out of whatever calls a
    # kernel, or compiles another one that calls it. Older versions take a source for another one
    # when its time is, which images of containers cut to seconds; FOLDER's name says enough.
    dispatcher._cache._cache_file._source_stamp = None
    dispatcher._cache = Kept(dispatcher._cache, dispatcher.py_func)
    return dispatcher


@contextmanager
def _numba_keeps_in(folder):
    """Set where numba keeps what it compiles, until the end."""
    # the second name: not in older versions of numba
    wanted = {'CACHE_DIR': str(folder), 'CACHE_LOCATOR_CLASSES': 'UserProvidedCacheLocator'}
    with _setting:
        before = {name: getattr(config, name) for name in wanted if hasattr(config, name)}
        try:
            for name in before:
                setattr(config, name, wanted[name])
            yield
        finally:
            for name, value in before.items():
                setattr(config, name, value)
