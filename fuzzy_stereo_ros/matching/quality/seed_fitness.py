# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of seeds: possibility and smoothness of maps in parts of a pixel.

Not in the paper. One measure for all children: the costs over supports that keep to the parent's
surface, and steps of disparity, which are free as long as a slanted surface makes them and cost
less at grey edges.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.crossover import Exchange, Regions
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import copy_taken
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
import numpy as np

_HALF = 1                # genes are measured in 8 bits: costs divided by 2**_HALF
_TOGETHER = 16           # rows that are divided at a time
UNTRUSTED = 0.1          # share of a match that counts where the two views disagree


class Steps(NamedTuple):
    """What steps of disparity cost, and from what difference on genes count as different."""

    slope: float         # cost of a px beyond the free ones, in parts of FULL
    free: float          # px that cost nothing
    jump: float          # the most that a step costs, in parts of FULL
    apart: float         # px by which two genes differ


class SurfaceFitness:
    """Measures genes of maps of one image size and joins maps."""

    def __init__(self, rows, columns, disparities):
        """disparities: how many labels exist."""
        self._disparities = disparities
        self._across, self._down = (np.zeros((rows, columns), np.float32) for _ in range(2))
        self._trust = np.ones((rows, columns), np.float32)

    def trust(self, rejected):
        """Let matches count little where the two views disagree: bool (R, C)."""
        self._trust[:] = np.where(rejected, np.float32(UNTRUSTED), np.float32(1))

    def look(self, across, down):
        """Take the weights of steps to the left and up: float32 (R, C)."""
        self._across[:], self._down[:] = across, down

    def price(self, pool, costs, first, maps, results):
        """
        Write what the genes of maps cost in some rows, in halves of the costs' unit.

        costs: uint16 (rows, C, labels), 0 to FULL, from row `first` of the frame on; maps,
        results: of float32 (R, C)
        """
        def price(begin):
            # Half of FULL is 0 in a byte: a fully impossible match says nothing.
            half = (costs[begin:begin + _TOGETHER] >> _HALF).astype(np.uint8)
            rows = slice(first + begin, first + begin + len(half))
            for surface, result in zip(maps, results):
                surface_cost.gene_costs(half, self._disparities, surface[rows], self._trust[rows],
                                        result[rows], 0, len(half))
        pool.each(price, range(0, len(costs), _TOGETHER))

    def join(self, first, first_costs, second, second_costs, steps):
        """
        Give the first parent the second one's fitter regions, and what they cost.

        first, second: float32 (R, C), px; first_costs, second_costs: float32 (R, C), see price.
        Returns what it saved, in parts of surface_cost.PARTS.
        """
        exchange, apart = Exchange(*first.shape, 4), np.float32(steps.apart)
        exchange.hold(surface_cost.cells_apart(first, second, apart, exchange.all_cells))
        full = FULL >> _HALF
        surface_cost.exchange_changes(
            first, first_costs, second, second_costs, self._across, self._down,
            np.float32(steps.slope * full), np.float32(steps.free), np.float32(steps.jump * full),
            apart, exchange.cells, exchange.alone, exchange.pairs)
        cost = Regions(*first.shape)(exchange)
        copy_taken(exchange.cells, exchange.taken, first, second)
        copy_taken(exchange.cells, exchange.taken, first_costs, second_costs)
        return -cost
