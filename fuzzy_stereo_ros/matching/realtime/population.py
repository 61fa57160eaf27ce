# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The population of the profile `realtime`: chromosomes of whole labels, the fittest first."""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.refinement import filling
import numpy as np


class Population:
    """
    Chromosomes that differ in how inconsistent cells are filled.

    genes: uint8 or uint16 (P, R, C), labels; fitness: float64 (P,), higher is fitter; best: the
    first, which crossover makes fitter; converged: whether it was crossed with all others
    """

    best = 0

    def __init__(self, size, fitness, bands):
        """
        Allocate at the first pair.

        size: most chromosomes alive, of which two are made; fitness: the `CensusFitness` of the
        pair; bands: of rows, as `cut_bands` returns them
        """
        self._size, self._measure, self._bands = min(size, 2), fitness, bands
        self.genes, self.fitness, self.converged = None, None, True

    def initialise(self, pool, labels, validity):
        """
        Fill inconsistent cells with background genes: by rows, and by columns.

        labels: (R, C); validity: uint8 (R, C), which of them are consistent
        """
        if self.genes is None:
            self.genes = np.zeros((self._size, *labels.shape), labels.dtype)
            self._below = np.zeros(labels.shape[1], labels.dtype)
        by_rows = self.genes[0]
        pool.each(lambda band: filling.fill_rows(
            labels, validity, by_rows, band[1], band[2]), self._bands)
        if self._size > 1:
            pool.each(lambda band: filling.fill_columns(
                labels, validity, by_rows, self.genes[1], self._below, band[1], band[2]),
                cut_bands(labels.shape[1]))
        self.fitness = np.full(self._size, self._measure.measure(pool, by_rows))
        self.converged = False

    def cross(self, pool, crossover, random):
        """Cross the fittest with each of the others; a child that is less fit does not live."""
        for other in range(1, self._size):
            gained, ahead = self._measure.cross(
                pool, crossover, random, self.genes[0], self.genes[other])
            self.fitness[other] = self.fitness[0] + ahead
            self.fitness[0] += gained
        self.converged = True

    def accept(self, pool, crossover, random, mutant):
        """Give the fittest what a crossover chooses of a mutant, (R, C) labels."""
        self.fitness[0] += self._measure.cross(
            pool, crossover, random, self.genes[0], mutant)[0]


def cross(pool, crossover, population, random):
    """Give the fittest chromosome the genes of the others that a crossover chooses."""
    population.cross(pool, crossover, random)
