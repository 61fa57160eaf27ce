# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scanline optima among all labels, of images at half size: a chromosome of this pair's data alone.

Not in the paper, whose random population does not converge in the time of a frame. Four scanline
passes (Hirschmueller, 2008) take its place, a memetic step on all rows and columns.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.scanlines.column_paths import OVERLAP
from fuzzy_stereo_ros.matching.kernels.scanlines.row_paths import ROWS_AT_ONCE
from fuzzy_stereo_ros.matching.kernels.scanlines.tasks import (
    ACROSS, COMPLETE, take_tasks, TARGETS, Tasks)
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    blocks_of, Scratch, Search, SearchResult)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

_SLACK = 64          # bytes behind an array that a vector may read or write
# Rows and arrays a multiple of a page apart would evict each other from the cache.
PAGE = 4096          # bytes
SHIFT = 448          # bytes
PART = 8             # rows that a thread begins at a time
STRIP_BYTES = 1 << 20   # of costs of the rows of tiles that are completed at a time, if several


def gene_type(disparities):
    """Return the smallest dtype of genes."""
    return np.uint8 if disparities <= 256 else np.uint16


def new_result(possibility):
    """Return memory for what is chosen of a possibility: a `SearchResult`."""
    rows, columns = possibility.rows, possibility.columns
    return SearchResult(
        zeros((rows, columns), gene_type(possibility.disparities)),
        zeros((rows, columns), np.int8), *(
            zeros((rows, width), np.uint8)
            for width in (columns, columns, possibility.right.columns)))


class Scanlines:
    """
    Scanline optima for one image size: memory and the chosen labels.

    Horizontal paths are independent by row, vertical ones by column, so that neither needs a
    neighbour's rows: while columns of tiles complete one row of tiles, the next one is begun.
    """

    def __init__(self, possibility, tile):
        """
        Allocate for the size of a possibility.

        tile: pixels of a side, 1 or more, of the tiles that are completed at a time. Costs are
        kept for as many rows of tiles only as are worked on at a time.
        """
        rows, columns = possibility.rows, possibility.columns
        self.possibility, self.tile = possibility, tile
        self._blocks = blocks_of(possibility.disparities)
        self.chosen = new_result(possibility)
        tiles = -(-rows // tile), -(-columns // tile)
        size = columns * LANES * self._blocks
        row = self._row_size = size + (SHIFT - size) % PAGE
        strip = min(tile, rows) * row
        at_a_time = min(max(STRIP_BYTES // strip, 1), tiles[0])
        kept = min(2 * at_a_time + -(-(OVERLAP + PART - 1) // tile), tiles[0])
        self._tasks = self._cut(rows, *tiles, at_a_time, kept)
        self._needs = self._tasks[:, -1].tolist()
        self._taken, self._done = np.zeros(1, np.int64), np.zeros(len(self._tasks), np.uint8)
        self._addresses_of_tasks = tuple(Tasks(
            len(self._tasks), *map(address_of, (self._tasks, self._taken, self._done))))
        self._numbers = {'kept': kept, 'path_size': LANES * self._blocks,
                         'row_words': columns + LANES}
        self._shared, self.memory = _placed(
            {'costs': kept * strip, 'sums': kept * strip, 'down': row})
        self._scratches, self._memory = [], []

    def search(self, pool, after=None):
        """
        Run the passes, which write `chosen`: memory that the next search overwrites.

        pool: a ThreadPool, or a Chain, whose mark of this stage is returned; after: a stage of it
        """
        self._reserve(pool.threads)
        self._taken[0] = 0
        self._done[:] = 0
        return pool.share(self._take, self._needs, after)

    def _take(self, most):
        """Do up to so many tasks."""
        scratch = self._free.pop()
        take_tasks(self._search, scratch, self._addresses_of_tasks, most)
        self._free.append(scratch)

    def _cut(self, rows, tile_rows, tile_columns, at_a_time, kept):
        """
        Return the tasks of a search: int64 (n, FIELDS), see `Tasks`.

        Some rows of tiles are completed, column by column, while the next ones are begun: what is
        completed is still in the cache, and hardly any task waits for those just before it.
        """
        parts = [(top, min(top + PART, rows)) for top in range(0, rows, PART)]
        ends = *range(at_a_time, tile_rows, at_a_time), tile_rows
        tasks, begun, done, before, above = [], 0, 0, 0, 0
        completed = [0] * tile_rows     # after how many tasks
        for end, ahead in zip((0, *ends, tile_rows), (*ends, tile_rows, tile_rows)):
            first, begun = begun, -(-min(ahead * self.tile + OVERLAP, rows) // PART)
            for part in parts[first:begun]:
                overwritten = (part[1] - 1) // self.tile - kept
                tasks.append((ACROSS, *part, 0, completed[overwritten] if overwritten >= 0 else 0))
            if done > above:
                tasks.append((TARGETS, above * self.tile, min(done * self.tile, rows), 0,
                              completed[done - 1]))
            start = len(tasks)
            if end > done:
                tasks += ((COMPLETE, done, end, tile, before + (tile + 1 if done > 0 else 0))
                          for tile in range(tile_columns))
            completed[done:end] = [len(tasks)] * (end - done)
            above, done, before = done, end, start
        return np.array(tasks, np.int64)

    def _reserve(self, threads):
        """Have working memory for so many threads."""
        columns, labels = self.chosen.labels.shape[1], LANES * self._blocks
        words, tile = self._numbers['row_words'], min(self.tile, columns) * labels
        sizes = {
            'up': tile, 'row_paths': ROWS_AT_ONCE * labels,
            'labels': max(labels, 16 * LANES) + 128, 'unused_sums': labels,
            'raw_rows': 3 * columns * labels, 'codes': 4 * 4 * words,
            'jumps': 4 * ROWS_AT_ONCE * words, 'chosen': 2 * columns, 'least_below': columns,
            'least_above': columns, 'offers': 2 * self.chosen.target.shape[1]}
        while len(self._scratches) < threads:
            places, memory = _placed(sizes)
            self._memory.append(memory)
            self._scratches.append(tuple(Scratch(**self._numbers, **self._shared, **places)))
        self._free = self._scratches.copy()     # all, also after a search that was interrupted

    @property
    def _search(self):
        """The fields of the Search; it has addresses of arrays of this object."""
        features, model, chosen = self.possibility.features, self.possibility.model, self.chosen
        return tuple(Search(
            *chosen.labels.shape, features.disparities, self._blocks, chosen.labels.itemsize,
            model.box, features.near_weight, features.census_cut, features.slope_cut, model.small,
            *map(address_of, self.possibility.penalties[1:]),
            features.census, features.slopes, features.target_census, features.target_slopes,
            features.census_stride, features.slope_stride, features.target_stride,
            chosen.target.shape[1], self.tile, self._row_size, *map(address_of, chosen)))


def _placed(sizes):
    """Return {name: address} of parts of memory, and the array that they lie in; sizes: bytes."""
    places, end = {}, 0
    for name, size in sizes.items():
        places[name] = end
        end += -(-(size + _SLACK) // PAGE) * PAGE + SHIFT
    memory = zeros(end + PAGE, np.uint8)
    start = memory.ctypes.data + -memory.ctypes.data % PAGE
    return {name: start + place for name, place in places.items()}, memory
