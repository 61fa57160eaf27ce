# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Memory that is free goes back to the system; where the C library is not glibc, as it likes."""
import ctypes

ARENAS_AT_MOST = -8     # M_ARENA_MAX of glibc's malloc.h


def share_free_memory():
    """
    Have all threads take memory from the same place; to be called before others run.

    glibc gives threads arenas of their own, and `malloc_trim` leaves the end of each but the first
    as it is: up to 64 MB a thread that are free and stay with the process.
    """
    choose = getattr(ctypes.CDLL(None), 'mallopt', None)
    if choose is not None:
        choose(ARENAS_AT_MOST, 1)


def give_back_memory():
    """
    Give memory that was freed back to the system, where the C library has a call for it.

    glibc keeps what is freed below something in use: with a matcher made anew at every change of
    parameters, a process would grow to twice its size. It takes some ms.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
