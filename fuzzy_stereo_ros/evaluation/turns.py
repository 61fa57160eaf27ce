# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Times and memory of matchers that run in turns.

Other programs make times longer. Matchers that take turns are slowed down alike: ratios of their
medians hold even if the times do not.
"""
from pathlib import Path
import re
import time

STATUS = Path('/proc/self/status')
RESET = Path('/proc/self/clear_refs')


def take_turns(works, turns, frames):
    """
    Call the functions of {matcher: function of a frame's number} in turns; return a dict per call.

    Its keys: matcher; milliseconds; processor, the processor time of all threads in ms; and what
    the function returns, {name: number} or None. A first turn, which allocates memory, does not
    count.
    """
    for work in works.values():
        work(0)
    taken = []
    for turn in range(turns):
        for name, work in works.items():
            start, processor_start = time.perf_counter(), time.process_time()
            stages = work(turn % frames) or {}
            processor = 1000 * (time.process_time() - processor_start)
            taken.append({'matcher': name, 'processor': processor,
                          'milliseconds': 1000 * (time.perf_counter() - start), **stages})
    return taken


def peak_memory(work):
    """Return by how many MB the process grows in work() at the most; None if not on Linux."""
    try:
        RESET.write_text('5')       # sets VmHWM to VmRSS
    except OSError:
        return None
    before = _kilobytes('VmRSS')
    work()
    return (_kilobytes('VmHWM') - before) / 1000


def _kilobytes(name):
    """Return a figure of the memory of the process."""
    return int(re.search(rf'^{name}:\s*(\d+)', STATUS.read_text(encoding='utf-8'),
                         re.MULTILINE)[1])
