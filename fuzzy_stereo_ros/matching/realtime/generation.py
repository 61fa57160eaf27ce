# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A frame is a generation: its map is selected among the genes of its parents.

Not in the paper, whose random population does not converge in the time of a frame. The parents
are the chromosome of this pair at half the size, as it was found and as it was smoothed, and the
previous frame's best, moved into this frame. The cells of a tile exchange their genes (crossover),
which are changed by one (mutation); the gene whose sum of four scanline paths (Hirschmueller,
2008) is least is selected. What is selected is, as it was found, a parent of the next frame. At
the smallest size all labels are genes.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import MOST_PARTS
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.scanlines import selection
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import Found, Scratch, SearchResult
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import (
    list_genes, MOST_GENES, Parent, SIDE, stride_of, Tiles)
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np

GROW = 8        # px around a tile whose genes of half the size it inherits, as they were found
NO_PARENT = Parent(*(0,) * 5, 1, 1, *(0,) * 5)
SPARE = 4       # by 1 / SPARE more memory is made than a frame needs
USUAL = 12      # genes of a tile, for which memory is made before the first frame


def gene_type(disparities):
    """Return the smallest dtype of genes, whose largest number is none."""
    return np.uint8 if disparities < 256 else np.uint16


def parent_of(labels, validity=None, cell=1, scale=1, grow=0, choices=None, shift=(0, 0)):
    """
    Return a map as a `Parent`.

    labels: uint8 or uint16 (rows, columns); validity: uint8, alike, which labels are inherited;
    choices, shift: where the picture stayed or moved, and how far, see `Parent`
    """
    validity, choices = (0 if one is None else address_of(one) for one in (validity, choices))
    return Parent(address_of(labels), labels.itemsize, validity, *labels.shape, cell, scale,
                  grow, choices, TILE, *shift)


class Squares:
    """
    Memory for the costs and the sums of the genes of all tiles; image sizes take turns.

    places: the addresses of both, others once a larger size has needed more
    """

    def __init__(self):
        """Hold none."""
        self._memory, self.places = np.empty((2, 0), np.uint8), (0, 0)

    def addresses(self, needed):
        """Return `places`, of as many bytes each."""
        if self._memory.shape[1] < needed:
            self._memory = zeros((2, needed + needed // SPARE), np.uint8)
            self.places = tuple(map(address_of, self._memory))
        return self.places


class Selection:
    """
    The choice among genes of the tiles of one image size: memory, and what is selected.

    Costs and paths of rows of tiles are independent, and then those of columns of tiles.

    chosen: a `SearchResult`, which the next pair overwrites; counts: int64 (tiles,), genes of each
    """

    def __init__(self, possibility, squares, most):
        """Allocate for a `CensusPossibility`; squares: `Squares`; most: genes of a tile."""
        self._possibility, self._squares = possibility, squares
        rows, columns = possibility.rows, possibility.columns
        self.chosen = SearchResult(
            zeros((rows, columns), gene_type(possibility.disparities)),
            zeros((rows, columns), np.int8), *(
                zeros((rows, width), np.uint8)
                for width in (columns, columns, possibility.right.columns)))
        self._tiles = -(-rows // SIDE), -(-columns // SIDE)
        number = self._tiles[0] * self._tiles[1]
        self.counts, self._places = zeros(number, np.int64), zeros(number + 1, np.int64)
        self._no_prior = Prior(self.chosen.labels, zeros((rows, columns), np.uint8))
        sizes = selection.scratch_sizes(
            possibility.disparities, most, self._tiles[1], self.chosen.target.shape[1])
        ends = np.cumsum([-(-size // SIDE) * SIDE for size in sizes]).tolist()
        self._memory = [zeros(ends[-1], np.uint8) for _ in range(MOST_PARTS)]
        self._scratch = [tuple(Scratch(*(address_of(memory) + start for start in (0, *ends[:-1]))))
                         for memory in self._memory]
        penalties = possibility.penalties
        self._fixed = Found(
            rows, penalties.small, possibility.model.box, *map(address_of, penalties[1:]),
            self.chosen.labels.itemsize, *map(address_of, self._no_prior * 2), 0, 0,
            *map(address_of, self.chosen[:-1]))

    def _addresses_of(self, mutation, stride, genes, origins=0):
        """Return the fields of the `Tiles`; the arguments are fields, too."""
        return tuple(Tiles(*self._tiles, mutation, stride, genes, origins,
                           address_of(self.counts), address_of(self._places)))

    def _place(self):
        """Place the squares of the genes counted one behind the other."""
        np.cumsum(SIDE * stride_of(self.counts), out=self._places[1:])

    def _find(self, half=None, previous=None):
        """Have memory for what is placed; half, previous: the priors, see `Found`."""
        costs, sums = self._squares.addresses(int(self._places[-1]))
        (labels, weights), (others, other_weights) = (
            map(address_of, prior or self._no_prior) for prior in (half, previous))
        self._found = tuple(self._fixed._replace(
            costs=costs, sums=sums, half_labels=labels, half_weights=weights,
            previous_labels=others, previous_weights=other_weights))

    def _located(self):
        """Return the fields of the `Found`."""
        return self._found

    def _parts(self, chain):
        """Return the parts, for the threads of a chain, of the rows and the columns of tiles."""
        return [chain.parts(side * SIDE, SIDE, 2) for side in self._tiles]

    def select(self, chain, after=None):
        """Select, in `chosen`."""
        features = tuple(self._possibility.features)
        for kernel, parts in zip((selection.sum_across, selection.select_down),
                                 self._parts(chain)):
            chain.each(lambda part, kernel=kernel: kernel(
                features, self._located(), self._addresses, self._scratch[part[0]],
                *_tiles_of(part)), parts, after)
            after = None
        columns, target = self._possibility.columns, self.chosen.target
        return chain.each(lambda part: selection.select_of_target(
            self._located(), self._scratch[part[0]], columns, address_of(target), target.shape[1],
            *part[1:]), chain.parts(len(target)))


class AllLabels(Selection):
    """The selection among all labels: what the smallest size begins with."""

    def __init__(self, possibility, squares):
        """Allocate for the size of a `CensusPossibility`; squares: `Squares`."""
        super().__init__(possibility, squares, possibility.disparities)
        self._genes = np.arange(possibility.disparities, dtype=np.uint16)
        self.counts[:] = possibility.disparities
        self._addresses = self._addresses_of(0, 0, address_of(self._genes))
        self._place()
        self._find()

    def _located(self):
        """Return the same where the squares are now: larger sizes may have had them moved."""
        found = Found(*self._found)
        if (found.costs, found.sums) != self._squares.places:
            self._find()
        return self._found


class InheritedGenes(Selection):
    """
    The selection among the genes of parents; genes, origins: see `Tiles`.

    previous, prior: the `Parent` and the `Prior` of the previous best, None where there is none
    """

    previous = prior = None

    def __init__(self, possibility, squares, few=False, mutation=1, grow=GROW):
        """
        Allocate for the size of a `CensusPossibility`; squares: `Squares`.

        few: whether a tile inherits of the chromosome of half the size only what it has there,
        smoothed; mutation: by how much genes are changed; grow: px around a tile
        """
        super().__init__(possibility, squares, MOST_GENES)
        self._few, self._grow = few, grow
        self.genes, self.origins = (zeros((len(self.counts), MOST_GENES), kind)
                                    for kind in (np.uint16, np.uint8))
        self._addresses = self._addresses_of(
            mutation, MOST_GENES, address_of(self.genes), address_of(self.origins))
        self.counts[:] = USUAL
        self._place()
        self._find()

    def select(self, chain, half):
        """Select the genes of the cells, in `chosen`; half: the `SmallResult` of half the size."""
        smooth = (parent_of(half.labels, cell=2, scale=2) if half.prior is None
                  else parent_of(half.prior.labels))
        found = NO_PARENT if self._few else parent_of(
            half.chosen.labels, cell=2, scale=2, grow=self._grow)
        of_half = tuple(smooth), tuple(found)

        def listed(part):
            list_genes(*of_half, tuple(self.previous or NO_PARENT), self._addresses,
                       self._scratch[part[0]][0], self._possibility.disparities,
                       2 * (half.disparities - 1), *_tiles_of(part))

        def placed(half_prior):
            self._place()
            self._find(half_prior, self.prior)
        chain.each(listed, self._parts(chain)[0])
        chain.each(placed, [half.prior])
        return super().select(chain)

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


def _tiles_of(part):
    """Return the first and the last row or column of tiles of a part of pixels."""
    return part[1] // SIDE, -(-part[2] // SIDE)
