# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The population of the profile `paper`: disparity maps and their fitness."""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import FRAME
from fuzzy_stereo_ros.matching.paper.fitness import inside
import numpy as np


class Lineage(NamedTuple):
    """Children, int64 (n,), and their parents, int64 (n, 2), of a generation; others survive."""

    children: np.ndarray
    parents: np.ndarray


class Population:
    """
    Chromosomes, disparity maps of the left image, of one image size.

    For the paper's right reference `StereoMatcher` mirrors and exchanges the images.

    framed: uint16 (P, R + 2, W), genes, indices of disparities, see kernels.genetic
    chosen: uint8 (P, R + 2, W), 255ths, possibility of the match chosen at each cell
    details: (P, ...), the details that the fitness keeps of each
    totals: int64 (P,), fitness in whole numbers
    lineage: the `Lineage` of this generation, None for the initial population
    generation: how many generations have begun; converged: never, only the budget ends evolution
    """

    converged = False

    def __init__(self, config, rows, columns, fitness):
        """Allocate; fitness: a `LiteralFitness` or a `UniformFitness`."""
        size = config.population
        self.framed = np.zeros((size, rows + 2, columns + FRAME), np.uint16)
        self.chosen = np.zeros(self.framed.shape, np.uint8)
        self.details = fitness.details(size)
        self.totals = np.zeros(size, np.int64)
        self._measure = fitness
        self.reset()

    @property
    def genes(self):
        """The chromosomes: uint16 (P, R, C), a view."""
        return inside(self.framed)

    def chromosome(self, slot):
        """Return genes, their possibilities and fitness, framed: as kernels take them."""
        return self.framed[slot], self.chosen[slot], self.details[slot]

    @property
    def fitness(self):
        """The fitness of all: float64 (P,), higher is fitter."""
        return self.totals / self._measure.unit

    @property
    def best(self):
        """Index of the fittest."""
        return int(self.totals.argmax())

    def reset(self):
        """Begin again with an initial population."""
        self.generation, self.lineage = 0, None

    def copy(self, slot, old):
        """Copy the old chromosome into a slot."""
        for memory in (self.framed, self.chosen, self.details, self.totals):
            memory[slot] = memory[old]

    def evaluate(self, slot, first, last):
        """Evaluate a chromosome after the genes of the rows from first to last - 1 changed."""
        self.totals[slot] = self._measure.evaluate(
            self.framed[slot], self.chosen[slot], self.details[slot], first, last)
