# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A frame is a generation: its map is selected among the genes of its parents.

Not in the paper, whose random population does not converge in the time of a frame. The parents
are the half-size chromosome of this pair, as it was found and as it was smoothed, and the previous
frame's best, moved into this frame. The cells of a tile exchange their genes (crossover), which
are changed by one (mutation); the gene whose sum of four scanline paths (Hirschmueller, 2008) is
least is selected. What is selected is, as it was found, a parent of the next frame.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import MOST_PARTS
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.scanlines import selection
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import Found, PITCH, Scratch
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import (
    list_genes, MOST_GENES, Parent, SIDE, Tiles)
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.realtime.scanlines import new_result
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
import numpy as np

GROW = 8        # px around a tile whose half-size genes it inherits, as they were found
NO_PARENT = Parent(*(0,) * 5, 1, 1, *(0,) * 5)
SPARE = 4       # by 1 / SPARE more memory is made than a frame needs
USUAL = 12      # genes of a tile, for which memory is made before the first frame


def parent_of(labels, validity=None, cell=1, scale=1, grow=0, choices=None, shift=(0, 0)):
    """
    Return a map as a `Parent`.

    labels: uint8 or uint16 (rows, columns); validity: uint8, alike, which labels are inherited;
    choices, shift: where the picture stayed or moved, and how far, see `Parent`
    """
    validity, choices = (0 if one is None else address_of(one) for one in (validity, choices))
    return Parent(address_of(labels), labels.itemsize, validity, *labels.shape, cell, scale,
                  grow, choices, TILE, *shift)


class Generation:
    """
    The generation of one image size: the genes of its tiles, memory, and what is selected.

    Costs and paths of rows of tiles are independent, and then those of columns of tiles.
    """

    def __init__(self, possibility, few=False, mutation=1):
        """
        Allocate for the size of a `CensusPossibility`.

        few: whether a tile inherits of the half-size chromosome only what it has there, smoothed
        mutation: by how much genes are changed
        """
        self._parents_of = _smooth_parent_of if few else _parents_of
        self._possibility, self.chosen = possibility, new_result(possibility)
        rows, columns = possibility.rows, possibility.columns
        tiles = self._tiles = -(-rows // SIDE), -(-columns // SIDE)
        number = tiles[0] * tiles[1]
        self._last_parent = 2 * (half_disparities(possibility.disparities) - 1)
        self.genes, self.origins = (zeros((number, MOST_GENES), kind)
                                    for kind in (np.uint16, np.uint8))
        self.counts, self._places = zeros(number, np.int64), zeros(number + 1, np.int64)
        self._addresses = tuple(Tiles(
            *tiles, mutation, *map(address_of, (
                self.genes, self.origins, self.counts, self._places))))
        self._no_prior = Prior(self.chosen.labels, zeros((rows, columns), np.uint8))
        sizes = selection.scratch_sizes(
            possibility.disparities, tiles[1], self.chosen.target.shape[1])
        ends = np.cumsum([-(-size // SIDE) * SIDE for size in sizes]).tolist()
        self._memory = [zeros(ends[-1], np.uint8) for _ in range(MOST_PARTS)]
        self._own = [[address_of(memory) + start for start in (0, *ends[:-1])]
                     for memory in self._memory]
        self._sums, self._lines = np.empty(0, np.uint8), np.empty((MOST_PARTS, 2, 0), np.uint8)
        self.counts[:] = USUAL
        self._have_memory()

    def _scratch_of_lines(self):
        """Return the Scratch of each part, with the memory for rows and columns of tiles."""
        return [tuple(Scratch(*own, *map(address_of, lines)))
                for own, lines in zip(self._own, self._lines)]

    def select(self, chain, half, previous, prior):
        """
        Select the genes of the cells, in `chosen`, which the next generation overwrites.

        chain: a Chain, whose mark of this stage is returned; half: the `HalfSizeResult`;
        previous: the `Parent` of the previous best, None where there is none; prior: its `Prior`
        """
        parents = tuple(map(tuple, (*self._parents_of(half), previous or NO_PARENT)))
        features = tuple(self._possibility.features)
        rows, columns = (chain.parts(side * SIDE, SIDE, 2) for side in self._tiles)

        def listed(part):
            list_genes(*parents, self._addresses, self._scratch[part[0]][0],
                       self._possibility.disparities, self._last_parent, *_tiles_of(part))

        def place(_):
            np.cumsum(self.counts, out=self._places[1:])
            self._have_memory()
            self._found = tuple(self._found_by(half.prior, prior))
        chain.each(listed, rows)
        chain.each(place, [0])
        for kernel, parts in (selection.sum_across, rows), (selection.select_down, columns):
            chain.each(lambda part, kernel=kernel: kernel(
                features, self._found, self._addresses, self._scratch[part[0]], *_tiles_of(part)),
                parts)
        return chain.each(lambda part: selection.select_of_target(
            features, self._found, self._scratch[part[0]], *part[1:]),
            chain.parts(self._possibility.rows))

    def origin_of_genes(self):
        """
        Return where the selected genes are from: uint8 (R, C).

        MUTATED, HALF_SIZE (of this pair) or PREVIOUS (the previous best), where both have them.
        """
        labels = self.chosen.labels
        origin = np.empty(labels.shape, np.uint8)
        for tile, count in enumerate(self.counts.tolist()):
            cells = tuple(slice(place * SIDE, (place + 1) * SIDE)
                          for place in divmod(tile, self._tiles[1]))
            index = np.searchsorted(self.genes[tile, :count], labels[cells])
            origin[cells] = self.origins[tile, index]
        return origin

    def _have_memory(self):
        """Have memory for the genes listed: sums of all, and costs of a row or column of tiles."""
        counts = self.counts.reshape(self._tiles)
        of_line = max(counts.sum(axis=0).max(), counts.sum(axis=1).max())
        if self._sums.size < counts.sum() * PITCH:
            self._sums = zeros(_with_spare(counts.sum()) * PITCH, np.uint8)
        if self._lines.shape[2] < of_line * PITCH:
            self._lines = zeros((MOST_PARTS, 2, _with_spare(of_line) * PITCH), np.uint8)
            self._scratch = self._scratch_of_lines()

    def _found_by(self, half, previous):
        """Return the `Found` of two priors."""
        possibility, chosen = self._possibility, self.chosen
        penalties = possibility.penalties
        return Found(
            possibility.rows, penalties.small, *map(address_of, (
                penalties.across, penalties.down)), chosen.labels.itemsize,
            *map(address_of, (*half, *(previous or self._no_prior), self._sums, *chosen)),
            chosen.target.shape[1])


def _parents_of(half):
    """Return a `HalfSizeResult` as parents: as it was found, and as it was smoothed and voted."""
    return (parent_of(half.prior.labels),
            parent_of(half.chosen.labels, cell=2, scale=2, grow=GROW))


def _smooth_parent_of(half):
    """Return a `HalfSizeResult` as one parent, smoothed, and none in the place of the other."""
    return parent_of(half.prior.labels), NO_PARENT


def _with_spare(genes):
    """Return for how many genes memory is made where so many are needed."""
    return int(genes + genes // SPARE)


def _tiles_of(part):
    """Return the first and the last row or column of tiles of a part of pixels."""
    return part[1] // SIDE, -(-part[2] // SIDE)
