# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The node as it is soaked: SIGUSR1 has it tell what it holds, and a fault can be planted in it.

The environment names the fault (`FAULT`), one of `FAULTS`, by which to see that a soak finds it;
empty: none.
"""
import ctypes
import gc
import json
import os
import signal
import sys
import threading
import time

from fuzzy_stereo_ros.node.worker import Worker
from fuzzy_stereo_ros.pair_matcher import PairMatcher

FAULT = 'FUZZY_STEREO_ROS_SOAK_FAULT'   # environment variable
FAR_BETWEEN = 10    # calls of a method
HANG = 40.0     # s; more than any limit, less than what is waited for an event
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


def _before(kind, name, work):
    """Have work(number of the call, *its arguments) done before each call of a method."""
    calls, original = [], getattr(kind, name)

    def method(self, *arguments):
        calls.append(len(calls))
        work(len(calls), *arguments)
        return original(self, *arguments)

    setattr(kind, name, method)


def _keep_an_image():
    kept = []

    def keep(number, pair):
        if number % FAR_BETWEEN == 0:
            kept.append(pair.left.copy())

    _before(PairMatcher, 'match', keep)


def _leave_a_thread():
    def leave(number, config):
        threading.Thread(target=threading.Event().wait, name='left over', daemon=True).start()

    _before(PairMatcher, 'request', leave)


def _drop_a_pair():
    submit, calls = Worker.submit, []

    def lossy(self, pair):
        calls.append(None)
        if len(calls) % FAR_BETWEEN:
            submit(self, pair)

    Worker.submit = lossy


def _scan_a_list():
    seen = []

    def scan(number, pair):
        seen.extend([number] * 2000)
        for _ in range(FAR_BETWEEN):
            seen.count(None)

    _before(PairMatcher, 'match', scan)


def _lose_a_line():
    from fuzzy_stereo_ros.node.diagnostics import LossReports    # needs ROS
    lines = LossReports.lines
    LossReports.lines = lambda *arguments: lines(*arguments)[1:]


def _hang_once():
    def hang(number, config):
        if number == FAR_BETWEEN - 1:
            time.sleep(HANG)

    _before(PairMatcher, 'request', hang)


FAULTS = {
    '': lambda: None, 'memory': _keep_an_image, 'thread': _leave_a_thread, 'drop': _drop_a_pair,
    'latency': _scan_a_list, 'line': _lose_a_line, 'hang': _hang_once}


def _tell(number, frame):
    os.write(sys.stdout.fileno(), f'{SAID}{json.dumps(held())}\n'.encode())


if __name__ == '__main__':
    from fuzzy_stereo_ros.node import disparity_node    # needs ROS
    signal.signal(signal.SIGUSR1, _tell)    # runs when the executor wakes, each s at the latest
    FAULTS[os.environ[FAULT]]()
    sys.exit(disparity_node.main())
