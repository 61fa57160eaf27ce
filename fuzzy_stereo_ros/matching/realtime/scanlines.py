# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The scanline chromosome: the best map that the data of one pair give.

Not in the paper, whose random population does not converge in the time of a frame. Four scanline
passes (Hirschmueller, 2008) take its place, a memetic step on all rows and columns.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import cut_bands, cut_by_work, OVERLAP
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.scanlines import sweep
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_paths import ROWS_AT_ONCE
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    blocks_of, Scratch, Search, SearchResult, Windows)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

_SLACK = 64          # bytes behind an array that a vector may read or write
# Rows and arrays a multiple of a page apart would evict each other from the cache.
PAGE = 4096          # bytes
SHIFT = 448          # bytes


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
    """Scanline optima for one image size: memory, ranges of labels, and the chosen labels."""

    stage, by_membership = 'scanlines', True

    def __init__(self, possibility, tile):
        """
        Allocate for the size of a possibility.

        tile: pixels of a side, 1 or more, of the tiles that search labels of their own. Costs
        are kept for as many rows of tiles only as a tile and the overlap reach into.
        """
        rows, columns = possibility.rows, possibility.columns
        target_columns = possibility.right.columns
        self.possibility, self.tile, self.bands = possibility, tile, cut_bands(rows, tile)
        self.most_blocks = blocks_of(possibility.disparities)
        tiles = -(-rows // tile), -(-columns // tile)
        height, kept = min(tile, rows), min(1 + -(-OVERLAP // tile), tiles[0])
        self._scratch, self._memory = zip(*(
            _scratch(columns, target_columns, self.most_blocks, height, kept) for _ in self.bands))
        self.chosen = new_result(possibility)
        self.windows = Windows(*(zeros(tiles, np.int64) for _ in range(3)),
                               zeros(tiles[0], np.int64))
        self.no_prior = prior_of(
            zeros((rows, columns), self.chosen.labels.dtype),
            zeros((rows, columns), np.uint8), possibility.disparities)

    def search(self, pool, windows=None, half_prior=None, previous_prior=None, then=None):
        """
        Run the passes; return the `SearchResult`, memory that the next search overwrites.

        windows: `self.windows`, written, None for all labels everywhere; priors: None for none;
        then: called with each of the `bands` once its labels are chosen
        """
        if windows is None:
            self.windows.low[:] = 0
            self.windows.blocks[:] = self.most_blocks
        self._pack()
        if windows is not None:
            self.bands = cut_by_work(self._work(), self.bands, OVERLAP)
        # Kept alive: the kernels have only their addresses.
        self._priors = half_prior or self.no_prior, previous_prior or self.no_prior
        self._last = self.search_by(*self._priors)

        def work(band):
            self._search_band(*band)
            if then is not None:
                then(band)
        pool.each(work, self.bands)
        return self.chosen

    def _pack(self):
        """Place the costs of the tiles one behind the other in a row of pixels."""
        columns, windows = self.chosen.labels.shape[1], self.windows
        widths = np.minimum(self.tile, columns - np.arange(0, columns, self.tile))
        sizes = windows.blocks * LANES * widths
        windows.offset[:] = np.cumsum(sizes, axis=1) - sizes
        used = sizes.sum(axis=1)
        windows.row_size[:] = used + (SHIFT - used) % PAGE

    def _work(self):
        """Return about how long each row takes: windows of up to four blocks are fast."""
        blocks = self.windows.blocks
        of_tiles = np.where(blocks <= 4, 2 + blocks, 3 * blocks).sum(axis=1)
        return np.repeat(of_tiles, self.tile)[:len(self.chosen.labels)]

    def _kernel_arguments(self, band):
        """Return the Search and the Scratch of a band, as kernels take them."""
        return tuple(self._last), tuple(self._scratch[band])

    def _search_band(self, band, first, last):
        """Sweep down and up through one row of tiles after the other."""
        arguments = self._kernel_arguments(band)
        start, strip, row = max(first - OVERLAP, 0), first, first
        while strip < last:
            end = min((strip // self.tile + 1) * self.tile, last)
            below = min(end + OVERLAP, self._last.rows)
            sweep.downwards(*arguments, start, first, row, min(below, last), below)
            sweep.upwards(*arguments, strip, end, below - 1)
            strip, row = end, below

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


def _scratch(columns, target_columns, blocks, height, kept):
    """
    Return the working memory of a band: a Scratch and the array that its addresses lie in.

    blocks: of a window at most; height: rows of a row of tiles; kept: rows of tiles.
    """
    row, words, labels = columns * LANES * blocks + PAGE, columns + LANES, LANES * blocks
    sizes = {
        'costs': kept * height * row, 'sums': kept * height * row, 'down': row, 'up': row,
        'carried': row, 'chains': ROWS_AT_ONCE * labels, 'labels': max(labels, 16 * LANES) + 128,
        'outside': labels, 'ring': 3 * row, 'codes': 4 * 4 * ROWS_AT_ONCE * words,
        'priors': 4 * 2 * ROWS_AT_ONCE * words, 'across': 4 * ROWS_AT_ONCE * words,
        'below': 4 * ROWS_AT_ONCE * words, 'chosen': 2 * columns,
        'least_below': columns, 'least_above': columns, 'offers': 2 * target_columns}
    places, end = {}, 0
    for name, size in sizes.items():
        places[name] = end
        end += -(-(size + _SLACK) // PAGE) * PAGE + SHIFT
    memory = zeros(end + PAGE, np.uint8)
    start = memory.ctypes.data + -memory.ctypes.data % PAGE
    return Scratch(height * row, kept, labels, words,
                   **{name: start + place for name, place in places.items()}), memory
