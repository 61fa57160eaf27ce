# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bands of rows: cut by the image's size alone, so that threads share work, never results."""
import os
from queue import SimpleQueue
from threading import Thread
import time
from weakref import finalize

OVERLAP = 16        # rows that a band's vertical paths start early
_FEWEST_ROWS = 64   # below this a band is mostly overlap


class ThreadPool:
    """
    The threads of one matcher, with the calling thread as one of them.

    Kernels release the GIL while they run. An executor, with a future for each item, costs five
    times as much, and there are some twenty calls a frame.

    shared: ms spent in `each`; the rest of a frame runs in one thread
    """

    def __init__(self, threads):
        """Start the threads; threads: their number, 0 for one per core."""
        self.threads, self.shared = threads or os.cpu_count() or 1, 0.0
        self._calls = SimpleQueue()
        self._helpers = [Thread(target=_run_calls, args=(self._calls,), name='pool', daemon=True)
                         for _ in range(self.threads - 1)]
        for helper in self._helpers:
            helper.start()
        self._end = finalize(self, _end, self._calls, len(self._helpers))

    def each(self, work, items):
        """Call work(item) for every item and return when all are done; errors are raised here."""
        helpers, begun = min(len(self._helpers), len(items) - 1), time.perf_counter()
        rest, done = iter(items), SimpleQueue()
        for _ in range(helpers):
            self._calls.put((work, rest, done))
        try:
            for item in rest:
                work(item)
        finally:
            errors = [done.get() for _ in range(helpers)]
            self.shared += 1000 * (time.perf_counter() - begun)
        for error in errors:
            if error is not None:
                raise error

    def close(self):
        """End the threads."""
        self._end()
        for helper in self._helpers:
            helper.join()


def by_bands(pool, work, reach, image, result):
    """
    Filter an image band by band.

    work: the filter, called with rows of the image, returns as many; reach: how many rows above
    and below a row its result depends on
    """
    def filter_band(band):
        _, first, last = band
        begin = max(first - reach, 0)
        result[first:last] = work(image[begin:last + reach])[first - begin:last - begin]
    pool.each(filter_band, cut_bands(len(image)))


def _run_calls(calls):
    """Take items of each call of `each`, until None comes in the place of a call."""
    for work, rest, done in iter(calls.get, None):
        error = None
        try:
            for item in rest:
                work(item)
        except BaseException as raised:     # `each` raises it
            error = raised
        done.put(error)
        del work, rest, done, error         # a waiting thread keeps no frame in memory


def _end(calls, helpers):
    for _ in range(helpers):
        calls.put(None)


def cut_bands(rows, height=1):
    """
    Return the bands of an image of a number of rows as (index, first, last) tuples.

    There are 1, 2, 4 or 8 of them: two from 128 rows, four from 640, eight from 1280; each but
    the last has a multiple of `height` rows.
    """
    count = 8 if rows >= 20 * _FEWEST_ROWS else 4 if rows >= 10 * _FEWEST_ROWS else \
        2 if rows >= 2 * _FEWEST_ROWS else 1
    edges = [min(-(-rows * index // (count * height)) * height, rows)
             for index in range(count + 1)]
    return [(index, edges[index], edges[index + 1]) for index in range(count)]
