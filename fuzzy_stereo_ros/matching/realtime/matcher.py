# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The search of the profile `realtime`: guesses from the data and the previous frame, joined.

One frame: the half-size chromosome says where to look; the scanline chromosome is the best guess;
its refused cells, the least possible ones, take background genes in two ways, which makes two
members. The first generation crosses them, later ones the fittest with mutants and memetic sweeps
of itself; the fitter regions stay. What the previous frame gives is in the views and in the guess.
"""
from functools import partial

from fuzzy_stereo_ros.matching.bands import Crew
from fuzzy_stereo_ros.matching.evolution import always
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import key_of
from fuzzy_stereo_ros.matching.kernels.refinement import filling
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness
from fuzzy_stereo_ros.matching.realtime.half_size import CoarseGuess
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPossibility, extra_columns, fine_places, FULL_SIZE, View)
from fuzzy_stereo_ros.matching.realtime.refinement import Refinement
from fuzzy_stereo_ros.matching.realtime.scanlines import ScanlineGuess
from fuzzy_stereo_ros.matching.realtime.warm_start import WarmStart
from fuzzy_stereo_ros.matching.stopwatch import Stopwatch
import numpy as np

TILE = 64           # pixels of a side of the tiles that search labels of their own
REACH = 16          # pixels from which a mutated patch takes its gene
CELLS_A_PATCH = 200   # one patch is tried for so many cells


class GuidedSearch:
    """
    The population of one image size, evolved on one pair after the other.

    population: uint8 or uint16 (P, R, C), genes from 0; fitness: float64 (P,), higher is fitter;
    best: index of the fittest; settled: never, the budget ends the search.
    """

    settled = False
    best = 0

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        self._config, self._shape = config, (rows, columns)
        self._crew = Crew(config.threads)
        extra = extra_columns(config.min_disparity, config.disparities)
        self._possibility = CensusPossibility(
            rows, columns, config.disparities, FULL_SIZE, extra)
        # the right image as it is read and averaged
        self._right = View(rows, columns, True, 0) if extra else self._possibility.right
        self._inside = config.min_disparity, config.min_disparity + columns - 1
        self._coarse = CoarseGuess(rows, columns, config.disparities, extra)
        self._guess = ScanlineGuess(self._possibility, TILE)
        self._warm = WarmStart(rows, columns, config.disparities)
        labels_type = self._guess.chosen.labels.dtype
        self._refinement = Refinement(rows, columns, config.disparities, labels_type)
        self._fitness = CensusFitness(
            self._possibility, self._refinement.verdict, self._guess.chosen.target)
        self._members = np.zeros((config.population, rows, columns), labels_type)
        self._below = np.zeros(columns, labels_type)
        self.fitness = np.zeros(config.population)
        self.warm, self.times = False, {}

    @property
    def population(self):
        """The members alive, the fittest first."""
        return self._members[:len(self.fitness)]

    def possibility_of(self, chromosome):
        """Return how possible the matches of a member are: float32 (R, C), 0 to 1."""
        return self._fitness.possibility_of(self._crew, chromosome)

    def start(self, left, right, state, seed_words):
        """
        Make the initial population of a pair.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); state: the previous frame's FrameState
        or None; seed_words: whole numbers that chance is made of.
        """
        self._seed_words, self._state = seed_words, state
        self._watch = Stopwatch()
        self.times = self._watch.times
        self._see(left, right)
        self._watch.took('possibility')
        self._coarse.search(self._crew, self._inside)
        self._coarse.guide(self._possibility.left.grey)
        self._warm.judge(self._crew, state, self._coarse)
        self._watch.took('coarse')
        self._guess_from(self._warm.prior)
        self._watch.took('scanlines')
        self._refinement.refuse(self._crew, self._guess.chosen, self._inside,
                                self._config.speckle_size, self._config.speckle_range)
        self._fitness.look(self._crew, self._inside)
        self._seed()
        self._watch.took('seeds')

    def _see(self, left, right):
        """
        Read the pair, averaged with the previous ones, at both sizes.

        The right image is moved by the smallest disparity: to the right as it is read, to the left
        into a wider view, so that none of it is lost.
        """
        full, half = self._possibility, self._coarse.possibility
        places, shift = fine_places(left, right), self._config.min_disparity

        def read(band):
            full.left.read(left, 0, places, band[1], band[2])
            self._right.read(right, max(shift, 0), places, band[1], band[2])

        def halve(band):
            full.left.halve(half.left, band[1], band[2])
            full.right.halve(half.right, band[1], band[2])
        bands, half_bands = self._guess.bands, self._coarse.bands
        self._crew.each(read, bands)
        if self._config.warm_start:
            self._warm.average(self._crew, self._state, full.left, self._right)
        if shift < 0:
            self._crew.each(lambda band: full.right.spread(
                self._right, -shift, band[1], band[2]), bands)
        self._crew.each(lambda band: full.describe(band[1], band[2]), bands)
        self._crew.each(halve, half_bands)
        self._crew.each(lambda band: half.describe(band[1], band[2]), half_bands)

    def _guess_from(self, previous):
        """Make the scanline chromosome, leaning on the half map and a prior from the past."""
        self._coarse.narrow(self._guess, self._config.disparities)
        self._guess.search(self._crew, self._coarse.prior, previous)

    def _seed(self):
        """Make the first members: refused cells take background genes by rows, by columns."""
        labels, verdict = self._guess.chosen.labels, self._refinement.verdict
        by_rows, by_columns = self._members[0], self._members[1]
        self._crew.each(lambda band: filling.fill_rows(
            labels, verdict, by_rows, band[1], band[2]), self._guess.bands)
        filling.fill_columns(labels, verdict, by_rows, by_columns, self._below)
        self.warm = self._state is not None
        self.fitness = np.full(2, self._fitness.adopt(self._crew, by_rows))

    def generation(self, number, in_time=always):
        """
        Cross the first two, or the fittest with what came of it; return the gains.

        in_time(): whether an operator may start; false ends the generation.
        """
        if number == 1:
            return {'crossover': self._cross(1) if in_time() else 0.0}
        gains = {'mutation': 0.0}
        if in_time():
            self._fitness.aim(self._crew, self._members[0], self._config.mutation_rate)
        for slot in range(1, self._config.population):
            gains['mutation'] += self._breed(
                slot, partial(self._mutate, slot, number), in_time)
        for _ in range(self._config.sweeps):
            gains['sweep'] = gains.get('sweep', 0.0) + self._breed(1, self._sweep, in_time)
        return gains

    def _breed(self, slot, change, in_time):
        """Let a changed copy of the fittest take a place; cross them; return what was gained."""
        if not in_time():
            return 0.0
        self._copy_fittest(slot)
        change(self._members[slot])
        if in_time():
            return self._cross(slot)
        self._copy_fittest(slot)        # only crossing tells what the changed one is worth
        return 0.0

    def _copy_fittest(self, slot):
        self._members[slot][:] = self._members[0]
        if slot == len(self.fitness):
            self.fitness = np.append(self.fitness, 0.0)
        self.fitness[slot] = self.fitness[0]

    def _mutate(self, slot, number, mutant):
        """Throw patches at a copy of the fittest."""
        rows, columns = self._shape
        self._fitness.mutate(
            self._members[0], mutant, self._config.neighbourhood // 2, REACH,
            rows * columns // CELLS_A_PATCH, key_of(*self._seed_words, number, slot))

    def _sweep(self, member):
        """Bring every row of a copy of the fittest to its optimum."""
        self._guess.polish(self._crew, self._fitness.penalties, member)

    def _cross(self, father):
        """Cross the fittest with another member; return the fitness gained."""
        gained, ahead = self._fitness.join(
            self._crew, self._members[0], self._members[father])
        self.fitness[father] = self.fitness[0] + ahead
        self.fitness[0] += gained
        return gained

    def finish(self, stamp, frame, disparity, confidence):
        """
        Refine the best chromosome into disparities and return the state for the next frame.

        disparity, confidence: float32 (R, C), written
        """
        self._watch.took('generations')
        chosen = self._guess.chosen
        self._refinement.smooth(self._crew, self._members[0], self._possibility.left.grey)
        self._refinement.express(self._crew, chosen, self._config, disparity, confidence)
        self._watch.took('refinement')
        if not self._config.warm_start:
            return None
        state = self._warm.hand_on(
            self._refinement.labels, self._refinement.verdict, self._config, stamp, frame)
        self._watch.took('handing_on')
        return state
