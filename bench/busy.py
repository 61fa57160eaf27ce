# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Frames that come with pauses, as from a camera, beside other programs that are busy.

On a robot a camera driver and a planner are such programs. Medians and 95th percentiles count
here, not the minimum, which shows a moment without them.
"""
from contextlib import contextmanager
import subprocess
import sys
import time

from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.pairs.stereo_pair import number_of
import pandas as pd

BUSY, QUICK_BUSY = (0, 1, 2, 4), (0, 1)     # processes that do nothing but work
PAUSE = 0.02            # s before each frame
SETTLING = 60           # frames after the others have begun, which do not count
COUNT, QUICK_COUNT = 400, 3     # medians of 150 frames of the same work differ by 5 %


class FixedPlaces:
    """Helping threads that stay where they are, in the place of `HelperPlaces`."""

    def __init__(self, apart):
        """apart: whether they are kept off the processor of the calling thread."""
        self.apart = apart

    def add(self, elapsed):
        """Measure nothing."""


def busy_table(works, frames, quick, places=()):
    """
    Return the table of times beside busy processes.

    works: {column: function of a frame's number, below `frames`}, called in turns, of which each
    begins with the next one. places: columns of the same work as the first one, by whose better
    median it is measured; none: it is not.
    """
    numbers, count = (QUICK_BUSY, QUICK_COUNT) if quick else (BUSY, COUNT)
    rows, settling = {}, QUICK_COUNT if quick else SETTLING
    for busy in numbers:
        with busy_processes(busy):
            times = pd.DataFrame([
                {name: _milliseconds(works[name], number % frames)
                 for name in _turned(list(works), number)}
                for number in range(-settling, count)], columns=list(works))[settling:]
        medians = times.median()
        behind = {f'{times.columns[0]}, behind the better place [%]':
                  100 * (medians.iloc[0] / medians[list(places)].min() - 1)} if places else {}
        rows[number_of(busy, 'busy process', 'busy processes')] = {
            **behind, **{f'{name}, {what} [ms]': times[name].quantile(share)
                         for name in works
                         for what, share in (('median', 0.5), ('95th percentile', 0.95))}}
    return Table.of('Beside busy processes, frames with pauses', pd.DataFrame(rows).T,
                    f'{count} frames each, in turns, with {1000 * PAUSE:.0f} ms before each. '
                    'Other programs of the machine make times longer as well.')


@contextmanager
def busy_processes(number):
    """Run a number of processes that do nothing but work during the with block."""
    processes = [subprocess.Popen([sys.executable, '-c', 'while True: pass'])
                 for _ in range(number)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _turned(names, number):
    first = number % len(names)
    return names[first:] + names[:first]


def _milliseconds(work, number):
    time.sleep(PAUSE)
    begun = time.perf_counter()
    work(number)
    return 1000 * (time.perf_counter() - begun)
