# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bands of rows: cut by the image's size alone, so that threads share work, never results."""
from concurrent.futures import ThreadPoolExecutor
import os

OVERLAP = 16        # rows that a band's vertical paths start early
_FEWEST_ROWS = 64   # below this a band is mostly overlap


class Crew:
    """The threads of one matcher. Kernels release the interpreter's lock while they run."""

    def __init__(self, threads):
        """Start the threads. threads: 0 takes one a core."""
        self.threads = threads or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def each(self, work, items):
        """Call work(item) for every item and return when all are done; errors are raised here."""
        if self._pool is None or len(items) == 1:
            for item in items:
                work(item)
            return
        for _ in self._pool.map(work, items):
            pass

    def close(self):
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()


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
