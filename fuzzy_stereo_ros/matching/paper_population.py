# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A generation of the paper's search: chromosomes and what is known of them."""
from fuzzy_stereo_ros.matching import operators
from fuzzy_stereo_ros.matching.fitness import total_fitness
from fuzzy_stereo_ros.matching.seeds import random_chromosome
import numpy as np


class PaperPopulation:
    """
    The chromosomes of one generation; each method writes one of them, `slot`.

    genes: uint16 (P, R, C), index of a disparity from min_disparity upwards
    chosen: uint8 (P, R, C), 255ths, possibility of the match chosen at each cell
    row_fitness: int64 (P, R), 255ths, what each row adds to the fitness
    """

    def __init__(self, config, rows, columns, measure):
        """
        Allocate the generation.

        measure: the `FuzzyFitness` of the pair
        """
        self._config = config
        self._measure = measure
        self.genes = np.zeros((config.population, rows, columns), np.uint16)
        self.chosen = np.zeros((config.population, rows, columns), np.uint8)
        self.row_fitness = np.zeros((config.population, rows), np.int64)

    def be_born(self, slot, key, scratch):
        """Write a random chromosome."""
        random_chromosome(key, self._config.disparities, self.genes[slot])
        self._evaluate(slot, scratch)

    def live_on(self, slot, former, old):
        """Copy a chromosome of the former generation unchanged; it is not evaluated again."""
        for kept, theirs in zip(self._kept(), former._kept()):
            kept[slot] = theirs[old]

    def be_crossed(self, slot, former, parents, line, scratch):
        """Write the child of two chromosomes of the former generation; return its fitness."""
        for kept, theirs in zip(self._kept(), former._kept()):
            operators.cut_crossover(theirs[parents[0]], theirs[parents[1]], line, kept[slot])
        rows, half = self.genes.shape[1], self._config.neighbourhood // 2
        # Only where N reaches across the line is a row not worth what it was in its parent.
        self._measure.evaluate(self.chosen[slot], self.genes[slot], scratch,
                               max(line - half, 0), min(line + half, rows),
                               self.row_fitness[slot])
        return total_fitness(self.row_fitness[slot])

    def be_mutated(self, slot, key, patches, scratch):
        """Change a chromosome by patches."""
        operators.mutate(key, self._config.mutation_rate, patches, self._config.neighbourhood,
                         self._config.disparities, self.chosen[slot], self.genes[slot])
        self._evaluate(slot, scratch)

    def fitness(self):
        """Return the fitness of all: float64 (P,), Eq. 3, higher is fitter."""
        return total_fitness(self.row_fitness)

    def _kept(self):
        return self.genes, self.chosen, self.row_fitness

    def _evaluate(self, slot, scratch):
        """Write possibility and fitness of a chromosome."""
        self._measure.choose(self.genes[slot], self.chosen[slot])
        self._measure.evaluate(self.chosen[slot], self.genes[slot], scratch,
                               0, self.genes.shape[1], self.row_fitness[slot])
