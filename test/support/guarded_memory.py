# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Memory in which every NumPy array lies against a page that nobody may touch.

Code that checks no bounds, as explicit SIMD, ends the process there when it reads or writes a
byte too far; bytes on the other side of an array are compared when it is freed.
"""
import ctypes
import mmap

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
    """
    Where NumPy takes the memory of arrays from that are made in this thread after `begin`.

    before: the forbidden page lies before each array, else behind it. overwritten: how many
    arrays were freed of which bytes around them had changed. guarded: how many were made.
    """

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
