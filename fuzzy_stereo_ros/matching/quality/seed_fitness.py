# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the profile `quality`: possibility and smoothness of maps in parts of a pixel.

Not in the paper. One measure for members of all models: the costs under one model, over supports
that keep to the surface of the first member, and steps of disparity, which are free as long as a
slanted surface makes them and cost less at grey edges.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.crossover import Exchange, Regions
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import copy_taken
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
import numpy as np

_HALF = 1                # costs are kept in 8 bits: divided by 2**_HALF
UNTRUSTED = 0.1          # share of a match that counts where the two views disagree


class Steps(NamedTuple):
    """What steps of disparity cost, and from what difference on genes count as different."""

    slope: float         # cost of a px beyond the free ones, in parts of FULL
    free: float          # px that cost nothing
    jump: float          # the most that a step costs, in parts of FULL
    apart: float         # px by which two genes differ


class SurfaceFitness:
    """
    Measures maps of one image size and joins them.

    volume: uint8 (R, C, labels), the costs of all matches, halved
    """

    def __init__(self, shape, disparities):
        """shape: of the costs, (R, C, labels)."""
        rows, columns = shape[:2]
        self._bands, self._disparities = cut_bands(rows), disparities
        self.volume = np.zeros(shape, np.uint8)
        self._trust, self._mother_costs, self._father_costs, self._across, self._down = (
            np.zeros((rows, columns), np.float32) for _ in range(5))
        self._exchange, self._choose = Exchange(rows, columns, 4), Regions(rows, columns)
        self._rows = np.zeros(rows)

    def look(self, crew, costs, across, down, first=0):
        """
        Take the costs of a frame, or of some of its rows; all their pixels are trusted.

        costs: uint16 (R, C, labels); across, down: float32 (R, C), weights of steps to the left
        and up; first: of these rows in the frame
        """
        rows = slice(first, first + len(costs))
        # Half of FULL is 0 in a byte: a fully impossible match says nothing.
        np.right_shift(costs, _HALF, out=self.volume[rows], casting='unsafe')
        self._across[rows], self._down[rows] = across, down
        self._trust[rows] = 1

    def trust(self, refused):
        """Let matches count little where the two views disagree: bool (R, C)."""
        self._trust[:] = np.where(refused, np.float32(UNTRUSTED), np.float32(1))

    def measure(self, crew, surface, steps):
        """Return the fitness of a map: 1 where all is fully possible and smooth."""
        self._price(crew, surface, self._mother_costs)
        numbers = self._numbers(steps)
        crew.each(lambda band: surface_cost.row_costs(
            surface, self._mother_costs, self._across, self._down, *numbers, self._rows,
            band[1], band[2]), self._bands)
        return 1 - float(self._rows.sum()) / self._most(surface)

    def join(self, crew, mother, father, steps):
        """
        Give the mother the father's fitter regions.

        Returns the fitness that she gained, and the father's fitness above hers before.
        """
        self._price(crew, mother, self._mother_costs)
        self._price(crew, father, self._father_costs)
        exchange, apart = self._exchange, np.float32(steps.apart)
        exchange.hold(surface_cost.cells_apart(mother, father, apart, exchange.all_cells))
        surface_cost.exchange_changes(
            mother, self._mother_costs, father, self._father_costs, self._across, self._down,
            *self._numbers(steps), apart, exchange.cells, exchange.alone, exchange.pairs)
        cost = self._choose(exchange)
        copy_taken(exchange.cells, exchange.taken, mother, father)
        most = self._most(mother) * surface_cost.PARTS
        return -cost / most, -exchange.total() / most

    def possibility_of(self, crew, surface):
        """
        Return how possible the matches of a map are, those that count little among them.

        surface: float32 (R, C), px; possibility: float32 (R, C), 0 to 1. Changes nothing here.
        """
        costs = np.empty_like(self._mother_costs)
        full, trusted = np.float32(FULL >> _HALF), np.ones_like(self._trust)
        crew.each(lambda band: surface_cost.gene_costs(
            self.volume, self._disparities, surface, trusted, costs, band[1], band[2]),
            self._bands)
        return 1 - costs / full

    def _numbers(self, steps):
        full = FULL >> _HALF
        return (np.float32(steps.slope * full), np.float32(steps.free),
                np.float32(steps.jump * full))

    def _price(self, crew, surface, result):
        crew.each(lambda band: surface_cost.gene_costs(
            self.volume, self._disparities, surface, self._trust, result, band[1], band[2]),
            self._bands)

    @staticmethod
    def _most(surface):
        return float(FULL >> _HALF) * surface.size
