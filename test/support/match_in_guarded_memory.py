# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A program that matches pairs where each array lies against a page that nobody may touch.

Code that checks no bounds, as explicit SIMD, ends the process there when it reads or writes a
byte too far; bytes on the other side of an array are compared when it is freed. Arguments:
`before` or `behind`, where that page lies; how many kinds of images are matched in each size; the
profiles, each with a colon and how many drawn sequences are matched.
"""
import ctypes
from dataclasses import replace
import gc
import mmap
import os
import sys

from drawn_frames import frames_of, options, SCENES
from fuzzed import examples
from fuzzy_stereo_ros.matching import arrays, MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.compiling import compile_sooner
from hypothesis import given, seed, settings
import numpy as np
try:
    from numpy._core import _multiarray_umath
except ImportError:     # NumPy 1
    from numpy.core import _multiarray_umath

PAGE = mmap.PAGESIZE
NO_ACCESS, READ_AND_WRITE = 0, mmap.PROT_READ | mmap.PROT_WRITE
PRIVATE = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
FILLING = 0xA5              # of bytes that no array owns, and of what was not written yet
SET_HANDLER = 304           # place of PyDataMem_SetHandler in the table of NumPy's C interface
ALLOCATE = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
ALLOCATE_ZEROS = ctypes.CFUNCTYPE(
    ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t)
REALLOCATE = ctypes.CFUNCTYPE(
    ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
FREE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)


class _Handler(ctypes.Structure):
    """A PyDataMem_Handler of NumPy's C interface, version 1 (NEP 49)."""

    _fields_ = [('name', ctypes.c_char * 127), ('version', ctypes.c_uint8),
                ('context', ctypes.c_void_p), ('malloc', ALLOCATE), ('calloc', ALLOCATE_ZEROS),
                ('realloc', REALLOCATE), ('free', FREE)]


class GuardedMemory:
    """Where NumPy takes the memory of arrays from that are made in this thread after `begin`."""

    # before: the forbidden page lies before each array, else behind it. overwritten: how many
    # arrays were freed of which bytes around them had changed. guarded: how many were made.

    def __init__(self, before):
        """Prepare; see the class for `before`."""
        self.before, self.overwritten, self.guarded = before, 0, 0
        self._library = ctypes.CDLL(None, use_errno=True)
        self._library.mmap.restype = ctypes.c_void_p
        self._library.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *3 * [ctypes.c_int],
                                       ctypes.c_long]
        self._library.mprotect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
        self._library.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
        self._mapped = {}       # address of an array: (begin of its mapping, bytes, bytes of it)
        self._handler = _Handler(
            b'guarded', 1, None, ALLOCATE(lambda _, size: self._allocate(size)),
            ALLOCATE_ZEROS(lambda _, count, size: self._allocate(count * size, 0)),
            REALLOCATE(lambda _, address, size: self._reallocate(address, size)),
            FREE(lambda _, address, size: self._free(address)))

    def begin(self):
        """Have NumPy take memory from here from now on, in this thread."""
        get_pointer = ctypes.pythonapi.PyCapsule_GetPointer
        get_pointer.restype, get_pointer.argtypes = ctypes.c_void_p, [
            ctypes.py_object, ctypes.c_char_p]
        make = ctypes.pythonapi.PyCapsule_New
        make.restype, make.argtypes = ctypes.py_object, [
            ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
        table = ctypes.cast(get_pointer(_multiarray_umath._ARRAY_API, None),
                            ctypes.POINTER(ctypes.c_void_p))
        set_handler = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.py_object)(table[SET_HANDLER])
        self._name = b'mem_handler'
        set_handler(make(ctypes.addressof(self._handler), self._name, None))

    def _allocate(self, size, content=FILLING):
        owned = -(-max(size, 1) // PAGE) * PAGE
        begin = self._library.mmap(None, owned + PAGE, READ_AND_WRITE, PRIVATE, -1, 0)
        if begin in (None, ctypes.c_void_p(-1).value):
            return None
        forbidden, first = (begin, begin + PAGE) if self.before else (begin + owned, begin)
        ctypes.memset(first, FILLING, owned)
        address = first if self.before else first + owned - size
        if content != FILLING:
            ctypes.memset(address, content, size)
        self._library.mprotect(forbidden, PAGE, NO_ACCESS)
        self._mapped[address] = first, owned, size
        self.guarded += 1
        return address

    def _reallocate(self, address, size):
        moved = self._allocate(size)
        if moved and address:
            ctypes.memmove(moved, address, min(size, self._mapped[address][2]))
            self._free(address)
        return moved

    def _free(self, address):
        if not address:
            return
        first, owned, size = self._mapped.pop(address)
        around = (ctypes.string_at(first, address - first)
                  + ctypes.string_at(address + size, first + owned - address - size))
        self.overwritten += around != bytes([FILLING]) * len(around)
        self._library.munmap(first - PAGE if self.before else first, owned + PAGE)


# rows, columns, disparities, min_disparity
SIZES = [(2, 2, 1, 0), (2, 2, 2, -2048), (3, 5, 5, -3), (2, 70, 33, -20), (40, 31, 9, -200),
         (17, 63, 63, 0), (63, 97, 64, 2), (131, 129, 128, 0), (9, 310, 256, 5),
         (9, 310, 257, -150), (20, 513, 512, 2048)]
KINDS = [(np.uint8, ()), (np.uint16, (3,)), (np.uint8, (3,)), (np.uint16, ())]
CHANGES = {'realtime': {}, 'fast': {}, 'quality': {'generations': 2},
           'paper': {'population': 4, 'generations': 2}}


def match_all(profile, kinds):
    """Match noise of every size, of some kinds, each twice, the second time warm."""
    random = np.random.default_rng(0)
    for number, (rows, columns, disparities, min_disparity) in enumerate(SIZES):
        config = replace(
            MatcherConfig.from_profile(profile, **CHANGES[profile]), disparities=disparities,
            min_disparity=min_disparity, fill=number % 2 == 0, threads=1, speckle_size=9)
        for kind, channels in (KINDS[number % 4:] + KINDS)[:kinds]:
            images = [random.integers(0, np.iinfo(kind).max, (rows, columns, *channels), kind,
                                      endpoint=True) for _ in range(2)]
            matcher = StereoMatcher(config)
            for _ in range(2):
                matcher.match(*images)
        gc.collect()


def match_drawn(profile, number):
    """Match a number of sequences, others in each profile."""
    @seed(0)
    @settings(examples(number), deadline=None)      # some compile a kernel
    @given(options(profile), SCENES)
    def match(config, scene):
        config = replace(config, threads=1, disparities=min(config.disparities, scene['columns']))
        matcher = StereoMatcher(config)
        for pair in frames_of(config, scene):
            matcher.match(*pair)
        gc.collect(0)
    match()
    gc.collect()


def main():
    """Run, print for each profile how many arrays were guarded and overwritten around, and end."""
    where, kinds, *profiles = sys.argv[1:]
    compile_sooner()
    memory = GuardedMemory(where == 'before')
    memory.begin()
    arrays.SMALL = arrays.OWN       # each array has memory of its own, of any size
    for profile, drawn in (word.split(':') for word in profiles):
        memory.guarded = memory.overwritten = 0
        match_all(profile, int(kinds))
        match_drawn(profile, int(drawn))
        print(profile, memory.guarded, memory.overwritten, flush=True)
    os._exit(0)     # when the interpreter ends it frees arrays after what is called for that


if __name__ == '__main__':
    main()
