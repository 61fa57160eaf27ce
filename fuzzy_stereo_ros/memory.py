# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Return freed memory to the system; does nothing unless the C library is glibc."""
import ctypes

M_ARENA_MAX = -8        # of glibc's malloc.h


def use_one_arena():
    """
    Make all threads allocate from one arena; to be called before other threads start.

    glibc gives each thread its own arena, and `malloc_trim` does not trim the top of any but the
    first: each thread would keep up to 64 MB of free memory.
    """
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if mallopt is not None:
        mallopt(M_ARENA_MAX, 1)


def give_back_memory():
    """
    Return freed memory to the system, which takes some ms.

    glibc keeps freed memory that lies below memory in use: as every change of parameters makes a
    new matcher, the process would grow to twice its size.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
