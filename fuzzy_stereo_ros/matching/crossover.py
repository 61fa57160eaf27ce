# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Crossover of two parents, shared by all profiles: which cells take the second parent's genes.

A profile writes the changes of cost into an `Exchange`; a crossover chooses the cells in it and
returns the change of cost: connected regions (Whitley et al., Partition crossover, 2009), or the
best of all choices, by a minimum cut (Lempitsky et al., Fusion moves for Markov random field
optimization, 2010).
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import copy_taken, take_regions
from fuzzy_stereo_ros.matching.kernels.genetic.minimum_cut import (
    load, maximum_flow, OUTSIDE, SOURCE, Trees)
import numpy as np

LARGEST_CHANGE = 2**26  # largest change of cost of one cell or of two cells together


class Exchange:
    """
    The changes of cost where a child takes genes of its second parent, in the place of its first.

    cells: int32 (n,), row * C + column of the cells where they differ, ascending
    alone: int32 (n,), change of cost if this cell alone takes the second parent's gene
    pairs: int32 (n, K), further change if the cell and an earlier neighbour both take it, 0 where
    that neighbour is no cell; K = 2: left, up; K = 4: left, up-left, up, up-right
    taken: bool (n,), which cells a crossover has chosen
    """

    def __init__(self, rows, columns, neighbours):
        """Allocate for a size; neighbours: 4 or 8, of a cell in the sums of costs."""
        self.shape, self.neighbours = (rows, columns), neighbours
        size = rows * columns
        # one more: kernels write each cell, and keep it only where the parents differ
        self.all_cells = zeros(size + 1, np.int32)
        self._alone, self._taken = zeros(size, np.int32), zeros(size, np.bool_)
        self._pairs = zeros((size, neighbours // 2), np.int32)
        self.set_size(0)

    def set_size(self, number):
        """Set the number of cells, which are written in all_cells; then write their changes."""
        self.cells, self.alone, self.pairs, self.taken = (
            memory[:number]
            for memory in (self.all_cells, self._alone, self._pairs, self._taken))

    def set_cells(self, selected):
        """Set the cells: bool (R, C); then write their changes."""
        cells = np.flatnonzero(selected)
        self.all_cells[:cells.size] = cells
        self.set_size(cells.size)

    def changes(self, part=slice(None)):
        """Return cells, alone and pairs of all cells or some, as kernels take them."""
        return self.cells[part], self.alone[part], self.pairs[part]

    def take(self, first, second):
        """Give the first parent the genes of the second one, (R, C), in the cells taken."""
        copy_taken(self.cells, self.taken, first, second)


class PartitionCrossover:
    """Partition crossover: takes connected regions of cells, as a whole, where that is cheaper."""

    def __init__(self, rows, columns, advantage=0):
        """advantage: cost a cell by which a region must be the cheaper one to be taken."""
        self._advantage, self._region = advantage, zeros((rows + 3, columns + 1), np.int32)
        self._sets = [zeros(rows * columns // 2 + 2, kind) for kind in (np.int32, np.int64)]

    def __call__(self, exchange, random=None):
        """Choose the cells; return the change of cost, not above 0."""
        exchange.taken[:] = True
        return self.keep_gains(exchange)

    def keep_gains(self, exchange):
        """Take only the connected regions of the taken cells that gain; return the change."""
        return take_regions(
            exchange.changes(), self._advantage, exchange.taken, self._region, *self._sets)


class Cut:
    """
    Fusion by minimum cut: the cheapest choice of cells; among equal costs the fewest cells.

    It is exact where no pair is above 0. Pairs above 0 count as 0 in the cut; afterwards each
    connected region of the chosen cells is taken only if that is cheaper.

    regions: the `PartitionCrossover` of the same size that does so
    """

    def __init__(self, rows, columns, neighbours):
        """Allocate the grid: the image with a border."""
        self._columns = columns
        wide = columns + 1
        ahead = [1, wide + 1, wide, wide - 1] if neighbours == 8 else [1, wide]
        self._offsets = np.array([sign * step for step in ahead for sign in (-1, 1)])
        places = (rows + 2) * wide + 1
        self._capacity = zeros((places, neighbours), np.int32)
        self._supply = zeros(places, np.int32)
        self._trees = Trees(*(zeros(places, kind) for kind in (
            np.int8, np.int8, np.int32, np.int32)))
        self._trees.tree[:] = OUTSIDE
        self._places = np.zeros(0, int)     # that the last call used
        self.regions = PartitionCrossover(rows, columns)

    def __call__(self, exchange, random=None):
        """Choose the cells; return the change of cost, not above 0."""
        if any(max(changes.max(initial=0), -int(changes.min(initial=0))) > LARGEST_CHANGE
               for changes in (exchange.alone, exchange.pairs)):
            raise ValueError(f'a change of cost is beyond {LARGEST_CHANGE}')
        row, column = np.divmod(exchange.cells, self._columns)
        places = (row + 1) * (self._columns + 1) + column + 1
        network, tree = (self._offsets, self._capacity, self._supply), self._trees.tree
        # At the begin: an interrupt may have ended the last call anywhere.
        self._capacity[self._places], tree[self._places] = 0, OUTSIDE
        self._places = places
        load(exchange.alone, exchange.pairs, places, network, tree)
        maximum_flow(places, network, tuple(self._trees))
        exchange.taken[:] = tree[places] == SOURCE
        return self.regions.keep_gains(exchange)
