# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The search of the paper, assembled: random maps, cut crossover, patch mutation, Eq. 3."""
from itertools import count
from typing import NamedTuple

from fuzzy_stereo_ros.matching import operators
from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.evolution import always
from fuzzy_stereo_ros.matching.fitness import FuzzyFitness
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import fill_uniform, key_of
from fuzzy_stereo_ros.matching.paper_population import PaperPopulation
from fuzzy_stereo_ros.matching.possibility import FULL
from fuzzy_stereo_ros.matching.stopwatch import Stopwatch
import numpy as np


class Kinship(NamedTuple):
    """
    Where the chromosomes of a generation come from, as indices of the former generation.

    elite: int64 (E,), of the first E, which live on unchanged.
    parents: int64 (P, 2) and lines: int64 (P,), of the others: the rows above the line are those
    of the first parent, the rest those of the second, unless mutation struck.
    """

    elite: np.ndarray
    parents: np.ndarray
    lines: np.ndarray


class PaperSearch:
    """
    A population of disparity maps of the left image, evolved as the paper has it.

    The paper's right reference is had by mirroring and exchanging the images above.

    fitness: float64 (P,), Eq. 3, higher is fitter; P is smaller after a generation cut short
    settled: whether `patience` generations went by without a fitter best: the stop condition
    kinship: the Kinship of the living generation, None for the initial population
    times: milliseconds by stage; warm: never, the paper knows no previous frame
    """

    warm = False

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        self._config = config
        self._elites = operators.elite_size(config.population, config.elite)
        self._measure = FuzzyFitness(config, rows, columns)
        self._living, self._coming = (
            PaperPopulation(config, rows, columns, self._measure) for _ in range(2))
        self._crossed_fitness = np.zeros(config.population)
        self._crew = Crew(config.threads)
        self._scratches = [self._measure.scratch() for _ in range(self._crew.threads)]
        self.fitness = np.zeros(config.population)
        self.settled, self.kinship = False, None
        self.times = {}

    @property
    def population(self):
        """The living generation: uint16 (P, R, C), a view that the next but one overwrites."""
        return self._living.genes[:self.fitness.size]

    @property
    def best(self):
        """Index of the fittest chromosome."""
        return int(self.fitness.argmax())

    def best_chromosome(self):
        """Return a copy of the fittest chromosome: uint16 (R, C), index of a disparity."""
        return self.population[self.best].copy()

    def possibility_of(self, chromosome):
        """Return how possible the chosen matches are: float32 (R, C), 0 to 1."""
        chosen = np.zeros(chromosome.shape, np.uint8)
        self._measure.choose(chromosome, chosen)
        return chosen / np.float32(FULL)

    def start(self, left, right, state, seed_words):
        """
        Take a pair and make the random initial population.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR; state: not used
        seed_words: whole numbers that chance is made of
        """
        self._watch = Stopwatch()
        self.times = self._watch.times
        self._seed_words = seed_words
        self._measure.take(left, right)
        self._watch.took('possibility')
        self._share(self._config.population, lambda slot, scratch: self._living.be_born(
            slot, key_of(*seed_words, 0, slot), scratch))
        self.fitness = self._living.fitness()
        self._without_gain = 0
        self.settled, self.kinship = False, None
        self._watch.took('seeds')

    def generation(self, number, in_time=always):
        """
        Let the elite live on, and children of the survivors take the place of all others.

        Return what crossover and mutation gave the new fittest: together the rise of the best.
        in_time(): whether an operator may start; false ends the generation with those it has,
        the fittest first.
        """
        living, coming = self._living, self._coming
        elite = operators.fittest_first(self.fitness)[:self._elites]
        parents, lines, patches = self._chances(number)

        def succeed(slot, scratch):
            if slot < elite.size:
                coming.live_on(slot, living, elite[slot])
                return
            self._crossed_fitness[slot] = coming.be_crossed(
                slot, living, parents[slot], lines[slot], scratch)
            if in_time():
                key = key_of(*self._seed_words, number, slot)
                coming.be_mutated(slot, key, patches[slot], scratch)

        made = self._share(self.fitness.size, succeed, in_time)
        best_before = self.fitness.max()
        if made:
            self._living, self._coming = coming, living
            self.fitness = coming.fitness()[:made]
            self.kinship = Kinship(elite, parents, lines)
        return self._gains(best_before)

    def finish(self, stamp, frame, disparity, confidence):
        """
        Write the fittest chromosome as it is, and return no state for the next frame.

        disparity: float32 (R, C), px, NaN where less sure than the threshold, written
        confidence: float32 (R, C), 0 to 1, Eq. 2 of the chosen matches, written
        """
        self._watch.took('generations')
        best = self.best_chromosome()
        confidence[:] = self.possibility_of(best)
        np.add(best, np.float32(self._config.min_disparity), out=disparity)
        if not self._config.fill:
            disparity[confidence < np.float32(self._config.confidence_threshold)] = np.nan
        self._watch.took('refinement')

    def _chances(self, number):
        """Return the parents, the crossover line and the number of patches of each child."""
        draws = np.zeros((5, self.fitness.size))
        fill_uniform(key_of(*self._seed_words, number), draws.reshape(-1))
        survival = operators.SURVIVAL[self._config.survival](self.fitness)
        mating = operators.survivors(self.fitness, survival, draws[0])
        rows, columns = self.population.shape[1:]
        return (operators.couples(mating, draws[1], draws[2]),
                operators.crossover_lines(rows, draws[3]),
                operators.patch_numbers(rows * columns, self._config.neighbourhood, draws[4]))

    def _gains(self, best_before):
        """Return by operator what the new fittest gained, and count towards settling."""
        best = self.best
        gained = self.fitness[best] > best_before
        self._without_gain = 0 if gained else self._without_gain + 1
        self.settled = 0 < self._config.patience <= self._without_gain
        if not gained:
            return {'crossover': 0.0, 'mutation': 0.0}
        return {'crossover': float(self._crossed_fitness[best] - best_before),
                'mutation': float(self.fitness[best] - self._crossed_fitness[best])}

    def _share(self, size, work, in_time=always):
        """
        Call work(slot, scratch) for the slots of a population in turn, shared among threads.

        Return for how many: those from 0 up to where in_time() became false.
        """
        slots, made = iter(range(size)), count()

        def of_worker(worker):
            while in_time() and (slot := next(slots, None)) is not None:
                work(slot, self._scratches[worker])
                next(made)

        self._crew.each(of_worker, range(self._crew.threads))
        return next(made)
