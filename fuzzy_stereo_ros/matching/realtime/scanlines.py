# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The scanline chromosome: the best map that the data of one pair give.

Not in the paper, whose random population does not converge in the time of a frame. Four scanline
passes (Hirschmueller, 2008) take its place, a memetic step on all rows and columns.
"""
from functools import cached_property
from operator import is_

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import all_before
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.scanlines.column_paths import OVERLAP
from fuzzy_stereo_ros.matching.kernels.scanlines.disparity_ranges import tile_windows
from fuzzy_stereo_ros.matching.kernels.scanlines.tasks import (
    ACROSS, COMPLETE, take_tasks, TARGETS, Tasks)
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_paths import ROWS_AT_ONCE
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    blocks_of, place_windows, Scratch, Search, SearchResult, Windows)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
import numpy as np

_SLACK = 64          # bytes behind an array that a vector may read or write
# Rows and arrays a multiple of a page apart would evict each other from the cache.
PAGE = 4096          # bytes
SHIFT = 448          # bytes
PART = 8             # rows that a thread begins at a time
GROW, LABEL_MARGIN = 8, 4  # px around a tile whose labels it searches too; labels around its range
STRIP_BYTES = 1 << 20   # of costs of the rows of tiles that are completed at a time, if several


def gene_type(disparities):
    """Return the smallest dtype of genes."""
    return np.uint8 if disparities <= 256 else np.uint16


def prior_of(labels, weights, disparities, *rows):
    """
    Return a map as a prior of a search among a number of disparities.

    labels: (R, C); weights: uint8 (R, C), 0 where there is no prior; rows: (dead_zone, cut) for
    the weights 1, 2, ...: the cost grows by 1 a label beyond the dead zone, up to the cut.
    """
    reach = -(-disparities // LANES) * LANES + LANES
    distance = np.abs(np.arange(-reach, reach))
    table = [np.zeros_like(distance)]
    table += [np.clip(distance - dead_zone, 0, cut) for dead_zone, cut in rows]
    return Prior(labels, weights, np.concatenate(table).astype(np.uint8), reach)


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
    Scanline optima for one image size: memory, ranges of labels, and the chosen labels.

    Horizontal paths are independent by row, vertical ones by column, so that neither needs a
    neighbour's rows: while columns of tiles complete one row of tiles, the next one is begun.

    memory: uint8 (N,), of any content before and after a search
    """

    stage, by_membership = 'scanlines', True

    def __init__(self, possibility, tile, allocate=zeros):
        """
        Allocate for the size of a possibility.

        tile: pixels of a side, 1 or more, of the tiles that search labels of their own. Costs
        are kept for as many rows of tiles only as are worked on at a time. allocate: as `zeros`
        """
        rows, columns = possibility.rows, possibility.columns
        self.possibility, self.tile = possibility, tile
        self.most_blocks = blocks_of(possibility.disparities)
        self.chosen = new_result(possibility)
        tiles = -(-rows // tile), -(-columns // tile)
        row = columns * LANES * self.most_blocks + PAGE
        strip = min(tile, rows) * row
        at_a_time = min(max(STRIP_BYTES // strip, 1), tiles[0])
        kept = min(2 * at_a_time + -(-(OVERLAP + PART - 1) // tile), tiles[0])
        self._tasks = self._cut(rows, *tiles, at_a_time, kept)
        self._needs = self._tasks[:, -1].tolist()
        self._taken, self._done = np.zeros(1, np.int64), np.zeros(len(self._tasks), np.uint8)
        self._addresses_of_tasks = tuple(Tasks(
            len(self._tasks), *map(address_of, (self._tasks, self._taken, self._done))))
        self._numbers = {'strip': strip, 'kept': kept, 'path_size': LANES * self.most_blocks,
                         'row_words': columns + LANES}
        self._shared, self.memory = _placed(
            {'costs': kept * strip, 'sums': kept * strip, 'down': row}, allocate)
        self._scratches, self._memory, self._made_of = [], [], (None, None, None)
        self.windows = Windows(*(zeros(tiles, np.int64) for _ in range(3)),
                               zeros(tiles[0], np.int64))
        self.windows.blocks[:] = self.most_blocks
        self.place_windows()
        self.no_prior = prior_of(
            zeros((rows, columns), self.chosen.labels.dtype),
            zeros((rows, columns), np.uint8), possibility.disparities)

    def limit(self, pool, half_labels):
        """
        Limit the labels of each tile by a half-size map of the pair.

        pool: a ThreadPool, or a Chain; half_labels: (R / 2, C / 2)
        """
        disparities = self.possibility.disparities

        def limit(part):
            rows = part[1] // self.tile, -(-part[2] // self.tile)
            tile_windows(half_labels, half_disparities(disparities), disparities, self.tile, GROW,
                         LABEL_MARGIN, self.windows.low, self.windows.blocks, *rows)
            self.place_windows(*rows)
        pool.each(limit, pool.parts(self.possibility.rows, self.tile))

    def place_windows(self, first=0, last=None):
        """Place the costs of the tiles of some rows of tiles, once their windows are limited."""
        last = len(self.windows.low) if last is None else last
        place_windows(tuple(self.windows), self.chosen.labels.shape[1], self.tile, PAGE, SHIFT,
                      first, last)

    def search(self, pool, half_prior=None, previous_prior=None, needs=all_before):
        """
        Run the passes; return the `SearchResult`, memory that the next search overwrites.

        pool: a ThreadPool, or a Chain, which completes the result. Priors: None for none. needs: a
        rule, see `all_before`
        """
        # Priors are kept alive: the kernels have only their addresses.
        priors = half_prior or self.no_prior, previous_prior or self.no_prior
        made_of = *priors, self.possibility.model
        if not all(map(is_, made_of, self._made_of)):
            self._made_of, self._search = made_of, tuple(self.search_by(*priors))
        self._reserve(pool.threads)
        self._taken[0] = 0
        self._done[:] = 0
        pool.each(self._take, *pool.shares(self._needs, needs))
        return self.chosen

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
        columns, labels = self.chosen.labels.shape[1], LANES * self.most_blocks
        words, tile = self._numbers['row_words'], min(self.tile, columns) * labels
        sizes = {
            'up': tile, 'carried': tile, 'row_paths': ROWS_AT_ONCE * labels,
            'labels': max(labels, 16 * LANES) + 128, 'unused_sums': labels,
            'raw_rows': 3 * columns * labels if self.possibility.model.box else 0,
            'codes': 4 * 4 * ROWS_AT_ONCE * words, 'priors': 4 * 2 * ROWS_AT_ONCE * words,
            'jumps': 4 * ROWS_AT_ONCE * words, 'chosen': 2 * columns, 'least_below': columns,
            'least_above': columns, 'offers': 2 * self.chosen.target.shape[1]}
        while len(self._scratches) < threads:
            places, memory = _placed(sizes)
            self._memory.append(memory)
            self._scratches.append(tuple(Scratch(**self._numbers, **self._shared, **places)))
        self._free = self._scratches.copy()     # all, also after a search that was interrupted

    def search_by(self, half_prior, previous_prior):
        """Return the Search of two priors; it has addresses of arrays here and in the priors."""
        features, model, chosen = self.possibility.features, self.possibility.model, self.chosen
        penalties, windows_and_chosen = self._own_addresses
        return Search(
            *chosen.labels.shape, features.disparities, chosen.labels.itemsize, model.box,
            features.near_weight, features.census_cut, features.slope_cut, model.small, *penalties,
            features.census, features.slopes, features.target_census, features.target_slopes,
            features.census_stride, features.slope_stride, features.target_stride,
            chosen.target.shape[1], *_addresses(half_prior), *_addresses(previous_prior),
            self.tile, self.windows.low.shape[1], *windows_and_chosen)

    @cached_property
    def _own_addresses(self):
        """The addresses of the penalties of jumps, and those of windows and of what is chosen."""
        return [[*map(address_of, arrays)] for arrays in (
            self.possibility.penalties[1:], (*self.windows, *self.chosen))]


def _addresses(prior):
    """Return the fields of a Search for a prior."""
    return (*map(address_of, (prior.labels, prior.weights, prior.table)), prior.reach)


def _placed(sizes, allocate=zeros):
    """Return {name: address} of parts of memory, and the array that they lie in; sizes: bytes."""
    places, end = {}, 0
    for name, size in sizes.items():
        places[name] = end
        end += -(-(size + _SLACK) // PAGE) * PAGE + SHIFT
    memory = allocate(end + PAGE, np.uint8)
    start = memory.ctypes.data + -memory.ctypes.data % PAGE
    return {name: start + place for name, place in places.items()}, memory
