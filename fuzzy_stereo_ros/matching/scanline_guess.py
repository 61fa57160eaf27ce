# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The best guess that data alone gives: a chromosome of scanline optima over the possibility.

Not in the paper: a random population never arrives at this chromosome length. Four scanline
passes (Hirschmueller, 2008) are a memetic step done once for all rows and columns.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands, OVERLAP
from fuzzy_stereo_ros.matching.kernels import sweep
from fuzzy_stereo_ros.matching.kernels.costs import Prior
from fuzzy_stereo_ros.matching.kernels.polish import polish_rows
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

_SLACK = 64


def gene_type(disparities):
    """Return the smallest dtype of genes."""
    return np.uint8 if disparities <= 256 else np.uint16


def prior_of(labels, weights, disparities, *rows):
    """
    Return a map as a prior of a search among a number of disparities.

    labels: (R, C); weights: uint8 (R, C), 0 where it says nothing; rows: (dead_zone, cut) for the
    weights 1, 2, ...: what is added grows by 1 a label beyond the dead zone, up to the cut.
    """
    reach = -(-disparities // LANES) * LANES + LANES
    distance = np.abs(np.arange(-reach, reach))
    table = [np.zeros_like(distance)]
    table += [np.clip(distance - dead_zone, 0, cut) for dead_zone, cut in rows]
    return Prior(labels, weights, np.concatenate(table).astype(np.uint8), reach)


class ScanlineGuess:
    """Scanline optima for one image size: memory, windows of labels, and what was chosen."""

    def __init__(self, possibility, tile):
        """tile: pixels of a side of the tiles that search labels of their own; 0 for one tile."""
        rows, columns = possibility.rows, possibility.columns
        self.possibility, self.bands = possibility, cut_bands(rows)
        self.most_blocks = -(-possibility.disparities // LANES)
        row_size = columns * LANES * self.most_blocks
        self._volume = sweep.Volume(np.zeros(rows * row_size + _SLACK, np.uint8),
                                    np.zeros(rows * row_size + _SLACK, np.uint8))
        self._scratch = [_scratch(columns, self.most_blocks) for _ in self.bands]
        self._winners = [np.zeros(columns, np.int64) for _ in self.bands]
        self.chosen = sweep.Chosen(
            np.zeros((rows, columns), gene_type(possibility.disparities)),
            np.zeros((rows, columns), np.int8), *(
                np.zeros((rows, columns), np.uint8) for _ in range(3)))
        tile = tile or max(rows, columns)
        self.windows = sweep.Windows(tile, tile, *(
            np.zeros((-(-rows // tile), -(-columns // tile)), np.int64) for _ in range(3)), *(
                np.zeros(-(-rows // tile), np.int64) for _ in range(2)))
        self.no_prior = prior_of(
            np.zeros((rows, columns), self.chosen.labels.dtype),
            np.zeros((rows, columns), np.uint8), possibility.disparities)
        self.search_everything()

    def search_everything(self):
        """Let each tile search all labels."""
        self.windows.low[:] = 0
        self.windows.blocks[:] = self.most_blocks
        self.pack()

    def pack(self):
        """Lay the tiles' windows one behind the other in the volume."""
        rows, columns = self.chosen.labels.shape
        windows = self.windows
        tile_rows, tile_columns = windows.low.shape
        widths = np.minimum(windows.width, columns - np.arange(tile_columns) * windows.width)
        heights = np.minimum(windows.height, rows - np.arange(tile_rows) * windows.height)
        sizes = windows.blocks * LANES * widths
        windows.offset[:] = np.cumsum(sizes, axis=1) - sizes
        windows.row_size[:] = sizes.sum(axis=1)
        windows.base[:] = np.cumsum(windows.row_size * heights) - windows.row_size * heights

    def search(self, crew, half_prior=None, previous_prior=None):
        """Run the passes; the result is in `chosen`. Priors default to none."""
        possibility, model = self.possibility, self.possibility.model
        priors = half_prior or self.no_prior, previous_prior or self.no_prior
        crew.each(lambda band: sweep.downwards(
            possibility.features, model.box, *priors, self.windows, self._volume,
            possibility.penalties, band[1], band[2], OVERLAP, self._scratch[band[0]]), self.bands)
        crew.each(lambda band: sweep.upwards(
            possibility.features, self.windows, self._volume, possibility.penalties,
            band[1], band[2], OVERLAP, self._scratch[band[0]], self.chosen), self.bands)

    def polish(self, crew, penalties, chromosome):
        """Sweep a chromosome, in place: even rows, then odd ones, each to its exact optimum."""
        for parity in (0, 1):
            crew.each(lambda band, parity=parity: polish_rows(
                self._volume.costs, self.windows, penalties, chromosome, parity, band[1], band[2],
                self._scratch[band[0]].paths, self._winners[band[0]],
                self._scratch[band[0]].labels, self._scratch[band[0]].chains), self.bands)


def _scratch(columns, blocks):
    row = columns * LANES * blocks
    sizes = {
        'paths': row, 'other_paths': row, 'least': columns, 'chains': 4 * LANES * blocks,
        'labels': LANES * blocks + 2 * _SLACK, 'outside': row, 'ring': 3 * row,
        'best_sums': columns + LANES * blocks + _SLACK,
        'best_labels': columns + LANES * blocks + _SLACK}
    return sweep.Scratch(**{name: np.zeros(size + _SLACK, np.uint8)
                            for name, size in sizes.items()})
