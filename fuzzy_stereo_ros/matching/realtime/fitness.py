# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the profile `realtime`: possibility, smoothness and occlusion in one number.

It replaces Eq. 3 and 4, which prefer wrong maps that point at strong edges. The fitness of a
chromosome decreases with the costs of its genes: matches of little possibility, jumps of disparity
(less at edges of grey), and labels that contradict the target image.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import SHORT
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.kernels.genetic import gene_cost
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import differing_cells
from fuzzy_stereo_ros.matching.kernels.possibility.costs import CENSUS_CUT, SLOPE_CUT
import numpy as np

SAMPLE_STEP = 32     # row step where a sample is enough


class CensusFitness:
    """Measures and crosses chromosomes of one image size; a cell costs at most `largest_cost`."""

    largest_cost = CENSUS_CUT + SLOPE_CUT

    def __init__(self, possibility, validity, target):
        """Read from a `CensusPossibility`, the validity of pixels and the target's labels."""
        self._shape, self._possibility = validity.shape, possibility
        self._scene = (*((view.census, view.slopes) for view in (
            possibility.left, possibility.right)), (validity, target, possibility.target_range[0]))
        self._costs = zeros(validity.shape, np.uint8)
        self._exchange = Exchange(*self._shape, neighbours=4)

    def measure(self, pool, chromosome, every=SAMPLE_STEP, after=None):
        """
        Return the fitness of a chromosome: 1 where all is fully possible and smooth, else lower.

        It is written once a Chain has run. every: row step of the sample; gains of crossover are
        exact
        """
        (rows, columns), costs = self._shape, self._costs
        bands, number = pool.parts(rows), -(-rows // every) * columns
        totals, fitness = np.zeros(len(bands), np.int64), np.zeros(1)

        def measure_band(band):
            first, last = (-(-row // every) for row in band[1:])
            gene_cost.gene_costs(*self._scene, chromosome, every, costs, first, last)
            totals[band[0]] = gene_cost.row_costs(
                *self._possibility.penalties, chromosome, costs, every, first, last)

        def sum_up(totals):
            fitness[0] = 1 - totals.sum() / (self.largest_cost * number)
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
            changes = exchange.changes(slice(*part[1:]))
            gene_cost.match_changes(*self._scene, first, second, *changes[:2])
            gene_cost.add_jump_changes(*self._possibility.penalties, first, second, changes)
        pool.each(change, pool.parts(exchange.cells.size, each=SHORT))
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
        costs = np.empty_like(self._costs)
        pool.each(lambda band: gene_cost.gene_costs(
            *self._scene, chromosome, 1, costs, *band[1:]), pool.parts(len(costs)))
        return 1 - costs / np.float32(self.largest_cost)
