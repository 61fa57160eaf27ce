# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Memory that a matcher keeps from frame to frame, in large pages.

A frame passes over some hundred arrays of a few hundred kB, thousands of pages of 4 kB, more than
a processor has addresses of at hand; in a virtual machine each further one is looked up in two
tables. NumPy asks the system for large pages from 4 MB on, so smaller arrays are cut from blocks.
"""
import math
from threading import Lock
from weakref import ref

from fuzzy_stereo_ros.matching.kernels.simd import LINE
import numpy as np

BLOCK = 1 << 24     # bytes
OWN = 1 << 22       # bytes from which on NumPy asks for large pages itself
SMALL = 4096        # bytes below which an array fills no page


class _Block:
    """The block that arrays are cut from now; it lives as long as one of them."""

    def __init__(self, size):
        self._lock, self._size, self._memory, self._used = Lock(), size, lambda: None, 0

    def cut(self, size):
        """Return the next bytes of the block, or the first ones of a new block: uint8 (size,)."""
        with self._lock:
            memory = self._memory()
            if memory is None or self._used + size > self._size:
                memory = np.zeros(self._size, np.uint8)
                self._memory, self._used = ref(memory), -memory.ctypes.data % LINE
            start = self._used
            # A line more: arrays of whole pages would begin at one place of a page each.
            self._used += -(-size // LINE) * LINE + LINE
        return memory[start:start + size]


_block = _Block(BLOCK)


def zeros(shape, dtype=float):
    """Return an array of zeros, aligned to a cache line, in large pages where available."""
    dtype = np.dtype(dtype)
    size = dtype.itemsize * math.prod(np.atleast_1d(shape).tolist())
    if size < SMALL:
        return np.zeros(shape, dtype)
    block = _block if size < OWN else _Block(size + LINE)
    return block.cut(size).view(dtype).reshape(shape)
