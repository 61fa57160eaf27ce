# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the profile `realtime`: possibility, smoothness and occlusion in one number.

It replaces Eq. 3 and 4, which prefer wrong maps that point at strong edges. The fitness of a
chromosome decreases with the costs of its genes: matches of little possibility, jumps of disparity
(less at edges of grey), and labels that contradict the target image.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.kernels.genetic import gene_cost
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import differing_cells
import numpy as np

SAMPLE_STEP = 16     # row step where a sample is enough


class CensusFitness:
    """Measures and crosses chromosomes of one image size; a cell costs at most `largest_cost`."""

    def __init__(self, possibility, validity, target):
        """Read from a `CensusPossibility`, the validity of pixels and the target's labels."""
        self._shape, self._possibility = validity.shape, possibility
        self._scene = (*((view.census, view.slopes) for view in (
            possibility.left, possibility.right)), (validity, target, possibility.target_range[0]))
        self._costs, self._sample = zeros((2, validity.size), np.uint8), self._cells(SAMPLE_STEP)
        self._exchange = Exchange(*self._shape, neighbours=4)

    @property
    def largest_cost(self):
        """What a cell of the pair costs at most."""
        return self._possibility.model.largest

    def measure(self, pool, chromosome, every=SAMPLE_STEP, after=None):
        """
        Return the fitness of a chromosome: 1 where all is fully possible and smooth, else lower.

        pool: a ThreadPool, or a Chain, which writes it; every: row step of the sample; gains of
        crossover are exact; after: a stage of the chain, see `Chain.each`
        """
        (rows, columns), costs = self._shape, self._costs[0]
        cells = self._sample if every == SAMPLE_STEP else self._cells(every)
        bands = pool.parts(rows)
        totals, fitness = np.zeros(len(bands), np.int64), np.zeros(1)

        def measure_band(band):
            first, last = (-(-row // every) for row in band[1:])
            part = slice(first * columns, last * columns)
            gene_cost.gene_costs(*self._scene, chromosome, cells[part], costs[part])
            totals[band[0]] = gene_cost.row_costs(
                *self._possibility.penalties, chromosome, costs, every, first, last)

        def sum_up(totals):
            fitness[0] = 1 - totals.sum() / (self.largest_cost * cells.size)
        pool.each(measure_band, bands, after)
        pool.each(sum_up, [totals])
        return fitness

    def cross(self, pool, crossover, random, first, second):
        """
        Give the first parent the genes of the second one that a crossover chooses, if it gains.

        Returns the fitness that it gained.
        """
        exchange = self._exchange
        exchange.set_size(differing_cells(first, second, exchange.all_cells))

        def change(part):
            part = slice(*part[1:])
            cells, alone, _ = changes = exchange.changes(part)
            old, new = self._costs[:, part]
            gene_cost.gene_costs(*self._scene, first, cells, old)
            gene_cost.gene_costs(*self._scene, second, cells, new)
            np.subtract(new, old, out=alone, dtype=np.int32)
            gene_cost.add_jump_changes(*self._possibility.penalties, first, second, changes)
        pool.each(change, pool.parts(exchange.cells.size))
        cost = crossover(exchange, random)
        if cost >= 0:
            exchange.taken[:] = False
        exchange.take(first, second)
        return -min(cost, 0) / (self.largest_cost * first.size)

    def possibility_of(self, pool, chromosome):
        """
        Return the possibility of each gene, hidden ones as the fitness counts them.

        chromosome: (R, C) labels; possibility: float32 (R, C), 0 to 1
        """
        cells, costs = self._cells(), np.empty(self._costs.shape[1], np.uint8)

        def measure(part):
            part = slice(*part[1:])
            gene_cost.gene_costs(*self._scene, chromosome, cells[part], costs[part])
        pool.each(measure, pool.parts(cells.size))
        return (1 - costs / np.float32(self.largest_cost)).reshape(self._shape)

    def _cells(self, every=1):
        """Return the cells of every `every`-th row: int32 (n,)."""
        cells = np.arange(np.prod(self._shape), dtype=np.int32)
        return cells.reshape(self._shape)[::every].reshape(-1)
