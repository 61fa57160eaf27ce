# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node as it is soaked: SIGUSR1 has it tell what it holds."""
import ctypes
import gc
import json
import os
import signal
import sys
import threading

SAID = 'held by the node: '
MALLINFO = ('arena', 'ordblks', 'smblks', 'hblks', 'mapped', 'usmblks', 'fsmblks', 'in_use',
            'free', 'keepcost')


class _Mallinfo(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in MALLINFO]


def held():
    """
    Return {name: value} of what this process holds, whatever the C library keeps beside it.

    megabytes: asked of the C library and not freed. objects: blocks in Python's own memory.
    threads: {id: name} of those that Python knows.
    """
    gc.collect()
    ask = ctypes.CDLL(None).mallinfo2
    ask.restype = _Mallinfo
    found = ask()
    return {'megabytes': (found.in_use + found.mapped) / 1e6, 'objects': sys.getallocatedblocks(),
            'threads': {one.native_id: one.name for one in threading.enumerate()}}


def _tell(number, frame):
    os.write(sys.stdout.fileno(), f'{SAID}{json.dumps(held())}\n'.encode())


if __name__ == '__main__':
    from fuzzy_stereo_ros.node import disparity_node    # needs ROS
    disparity_node.REPORT_PERIOD = 0.2      # s: a soak waits for reports most of its time
    signal.signal(signal.SIGUSR1, _tell)    # runs when the executor wakes, as for reports
    sys.exit(disparity_node.main())
