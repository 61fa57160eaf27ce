# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How kernels are compiled, and kept for the next process: the decorators of all of them."""
from functools import partial

from fuzzy_stereo_ros.matching.kernels.cache_folder import choose_folders
from fuzzy_stereo_ros.matching.kernels.jit_cache import KeptKernel, note
from numba import config, njit

_folders = choose_folders()
FOLDER = _folders.kept
if _folders.warning:
    note(_folders.warning)


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
    if not config.DISABLE_JIT:
        # Not numba's public interface, whose caches do not know of changes in the kernels that a
        # kernel calls, read no folder that cannot be written to, and let errors of disks out.
        dispatcher._cache = KeptKernel(function, _folders)
    return dispatcher


def inlined(function):
    """Compile a function into every kernel that calls it."""
    return njit(forceinline=True)(function)
