# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Memory that is free goes back to the system."""
import ctypes


def give_back_memory():
    """
    Give memory that was freed back to the system, where the C library has a call for it.

    glibc keeps what one thread frees for threads that use the same of its arenas: with a matcher
    made in a new thread at every change of parameters, a process would grow to twice its size.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
