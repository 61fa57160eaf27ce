# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The scanline chromosome: the best map that the data of one pair give.

Not in the paper, whose random population does not converge in the time of a frame. Four scanline
passes (Hirschmueller, 2008) take its place, a memetic step on all rows and columns.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import cut_rows
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.scanlines.column_paths import (
    choose_of_targets, down_and_up)
from fuzzy_stereo_ros.matching.kernels.scanlines.disparity_ranges import (
    pack_windows, tile_windows)
from fuzzy_stereo_ros.matching.kernels.scanlines.row_paths import across
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_paths import ROWS_AT_ONCE
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    blocks_of, Scratch, Search, SearchResult, Windows)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
import numpy as np

_SLACK = 64          # bytes behind an array that a vector may read or write
# Rows and arrays a multiple of a page apart would evict each other from the cache.
PAGE = 4096          # bytes
SHIFT = 448          # bytes
OVERLAP = 16         # rows by which paths from below start early
PART = 16            # rows that a thread begins at a time,
FINISHED = 32        # and finishes
NOTHING = (), ()     # to do beside a search
GROW, MARGIN = 8, 4  # px around a tile whose labels it searches too; labels around its range
STEP = 4 << 20       # bytes of costs of the rows of tiles that are completed at a time, if several


def nothing(band):
    """Do nothing with a band."""


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
    """

    stage, by_membership = 'scanlines', True

    def __init__(self, possibility, tile):
        """
        Allocate for the size of a possibility.

        tile: pixels of a side, 1 or more, of the tiles that search labels of their own. Costs
        are kept for as many rows of tiles only as are worked on at a time.
        """
        rows, columns = possibility.rows, possibility.columns
        self.possibility, self.tile, self.bands = possibility, tile, cut_rows(rows, FINISHED)
        self.most_blocks = blocks_of(possibility.disparities)
        self.chosen = new_result(possibility)
        tiles = -(-rows // tile), -(-columns // tile)
        row = columns * LANES * self.most_blocks + PAGE
        strip = min(tile, rows) * row
        at_a_time = min(max(STEP // strip, 1), tiles[0])
        kept = min(2 * at_a_time + -(-(OVERLAP + PART - 1) // tile), tiles[0])
        self._items, self._needs = self._cut(rows, *tiles, at_a_time, kept)
        self._numbers = {'strip': strip, 'kept': kept, 'chain': LANES * self.most_blocks,
                         'words': columns + LANES}
        self._shared, self._shared_memory = _placed(
            {'costs': kept * strip, 'sums': kept * strip, 'down': row})
        self._free, self._memory, self._half_labels = [], [], None
        self.windows = Windows(*(zeros(tiles, np.int64) for _ in range(3)),
                               zeros(tiles[0], np.int64))
        self.windows.blocks[:] = self.most_blocks
        self.no_prior = prior_of(
            zeros((rows, columns), self.chosen.labels.dtype),
            zeros((rows, columns), np.uint8), possibility.disparities)

    def limit(self, half_labels):
        """Limit the labels of each tile of searches by a half-size map: (R / 2, C / 2)."""
        self._half_labels = half_labels

    def search(self, pool, half_prior=None, previous_prior=None, finish=nothing, join=nothing,
               beside=NOTHING):
        """
        Run the passes; return the `SearchResult`, memory that the next search overwrites.

        Priors: None for none. finish: called with each of the `bands` once it is complete; join:
        called with each in their order, once it and those before are finished; beside: functions,
        and what each needs of them, as `ThreadPool.each` takes both: they are called meanwhile
        """
        # Kept alive: the kernels have only their addresses.
        self._priors = half_prior or self.no_prior, previous_prior or self.no_prior
        self._search = tuple(self.search_by(*self._priors))
        self._reserve(pool.threads)
        functions, needs = beside
        before = len(functions)
        self._finish, self._join = finish, join
        try:
            pool.each(self._work, [*((function,) for function in functions), *self._items],
                      [*needs, *((before + first, before + last) for first, last in self._needs)])
        finally:        # they may have what has this search, which would not be freed at once
            self._finish = self._join = nothing
        return self.chosen

    def _work(self, item):
        """Call the function of an item, a method with working memory if it has a place."""
        function, *place = item
        if not place:
            function()
            return
        scratch = self._free.pop()
        try:
            function(self, scratch, *place)
        finally:
            self._free.append(scratch)

    def _cut(self, rows, tile_rows, tile_columns, at_a_time, kept):
        """
        Return the items of a search, and what each needs, as `ThreadPool.each` takes both.

        An item is a method, called with a Scratch and the rest of it. Some rows of
        tiles are completed, column by column, while the next ones are begun and those before are
        finished: all is still in the cache, and hardly any item waits for those just before it.
        """
        items = [(Scanlines._limit, tile_row) for tile_row in range(tile_rows)]
        needs = [(0, 0)] * tile_rows
        parts = [(top, min(top + PART, rows)) for top in range(0, rows, PART)]
        ends = *range(at_a_time, tile_rows, at_a_time), tile_rows
        begun = done = number = 0       # parts, rows of tiles, finished bands
        before, completed = tile_rows, [0] * tile_rows     # after how many items
        to_join, block = (0, 0), (0, 0)
        for end, ahead in zip((0, *ends, tile_rows), (*ends, tile_rows, tile_rows)):
            first, begun = begun, -(-min(ahead * self.tile + OVERLAP, rows) // PART)
            for part in parts[first:begun]:
                overwritten = (part[1] - 1) // self.tile - kept
                items.append((Scanlines._begin, *part))
                needs.append((0, completed[overwritten] if overwritten >= 0
                              else (part[1] - 1) // self.tile + 1))
            start = len(items)
            if end > done:
                items += ((Scanlines._complete, tile, done, end)
                          for tile in range(tile_columns))
                needs += ((0, before + (tile + 1 if done > 0 else 0))
                          for tile in range(tile_columns))
            completed[done:end] = [len(items)] * (end - done)
            first_band, number = number, len(self.bands) if done == tile_rows else (
                done * self.tile // FINISHED)
            finished = len(items)
            items += ((Scanlines._finish_band, band) for band in self.bands[first_band:number])
            needs += [(0, completed[done - 1])] * (number - first_band)
            items.append((Scanlines._join_bands, *to_join))
            needs.append(block)
            to_join, block = (first_band, number), (finished, len(items))
            done, before = end, start
        items.append((Scanlines._join_bands, *to_join))
        needs.append(block)
        return items, needs

    def _limit(self, scratch, tile_row):
        """Choose the labels that the tiles of a row search, and place their costs."""
        windows, rows = self.windows, (tile_row, tile_row + 1)
        disparities = self.possibility.disparities
        if self._half_labels is not None:
            tile_windows(self._half_labels, half_disparities(disparities), disparities, self.tile,
                         GROW, MARGIN, windows.low, windows.blocks, *rows)
        pack_windows(windows.blocks, self.tile, self.possibility.columns, SHIFT, PAGE,
                     windows.offset, windows.row_size, *rows)

    def _begin(self, scratch, first, last):
        """Compute the costs and the horizontal paths of the rows first .. last - 1."""
        across(self._search, scratch, first, last)

    def _finish_band(self, scratch, band):
        """Choose the labels of the target pixels of a band, and call what finishes it."""
        choose_of_targets(self._search, scratch, *band[1:])
        self._finish(band)

    def _join_bands(self, scratch, first, last):
        """Call what joins each of the bands first .. last - 1 to those before."""
        for band in self.bands[first:last]:
            self._join(band)

    def _complete(self, scratch, tile, first, last):
        """Choose the labels of a column of tiles in the rows of tiles first .. last - 1."""
        rows = len(self.chosen.labels)
        for tile_row in range(first, last):
            start = min((tile_row + 1) * self.tile + OVERLAP, rows) - 1
            down_and_up(self._search, scratch, tile, tile_row, start)

    def _reserve(self, threads):
        """Have working memory for so many threads."""
        columns, labels = self.chosen.labels.shape[1], LANES * self.most_blocks
        words, tile = self._numbers['words'], min(self.tile, columns) * labels
        sizes = {
            'up': tile, 'carried': tile, 'chains': ROWS_AT_ONCE * labels,
            'labels': max(labels, 16 * LANES) + 128, 'outside': labels,
            'ring': 3 * columns * labels if self.possibility.model.box else 0,
            'codes': 4 * 4 * ROWS_AT_ONCE * words, 'priors': 4 * 2 * ROWS_AT_ONCE * words,
            'across': 4 * ROWS_AT_ONCE * words, 'chosen': 2 * columns, 'least_below': columns,
            'least_above': columns, 'offers': 2 * self.chosen.target.shape[1]}
        while len(self._memory) < threads:
            places, memory = _placed(sizes)
            self._memory.append(memory)
            self._free.append(tuple(Scratch(**self._numbers, **self._shared, **places)))

    def search_by(self, half_prior, previous_prior):
        """Return the Search of two priors; it has addresses of arrays here and in the priors."""
        features, model = self.possibility.features, self.possibility.model
        penalties, windows, chosen = self.possibility.penalties, self.windows, self.chosen
        return Search(
            *chosen.labels.shape, features.disparities, chosen.labels.itemsize, model.box,
            features.near_weight, features.census_cut, features.slope_cut, penalties.small,
            *map(address_of, (penalties.across, penalties.down)),
            features.census, features.slopes, features.target_census, features.target_slopes,
            features.census_stride, features.slope_stride, features.target_stride,
            chosen.target.shape[1], *_addresses(half_prior), *_addresses(previous_prior),
            self.tile, windows.low.shape[1], *map(address_of, windows), *map(address_of, chosen))


def _addresses(prior):
    """Return the fields of a Search for a prior."""
    return (*map(address_of, (prior.labels, prior.weights, prior.table)), prior.reach)


def _placed(sizes):
    """Return {name: address} of parts of memory, and the array that they lie in; sizes: bytes."""
    places, end = {}, 0
    for name, size in sizes.items():
        places[name] = end
        end += -(-(size + _SLACK) // PAGE) * PAGE + SHIFT
    memory = zeros(end + PAGE, np.uint8)
    start = memory.ctypes.data + -memory.ctypes.data % PAGE
    return {name: start + place for name, place in places.items()}, memory
