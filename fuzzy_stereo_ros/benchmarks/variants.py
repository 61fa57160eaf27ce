# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The search of `realtime` with single steps removed, or put back as the paper has them.

They are there to be compared with, and are slower than they need to be.
"""
import cv2
from fuzzy_stereo_ros.benchmarks.measured_search import MeasuredSearch
from fuzzy_stereo_ros.matching import operators
from fuzzy_stereo_ros.matching.fitness import FuzzyFitness, gradient_by_index, gradient_norm
from fuzzy_stereo_ros.matching.fuzzy import CENTRES, membership
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import fill_uniform, key_of
from fuzzy_stereo_ros.matching.possibility import grey_levels
import numpy as np

_BITS = 8           # of a byte plane: steps of a membership


class WholeMembers(MeasuredSearch):
    """Without partition crossover: a member that is fitter as a whole takes the first place."""

    def _cross(self, father):
        return self._succeed(father, [self._members[father]])

    def _succeed(self, father, rivals):
        """Let the fittest rival, the first being the father, lead where it is; return its gain."""
        leads = [self._lead(rival) for rival in rivals]
        self.fitness[father] = self.fitness[0] + leads[0]
        lead, fittest = max(zip(leads, rivals), key=lambda pair: pair[0])
        if lead <= 0:
            return 0.0
        self._members[0] = fittest
        self.fitness[0] += lead
        return lead

    def _lead(self, chromosome):
        """Return how much fitter than the fittest a chromosome is as a whole."""
        fitness = self.fitness_of(chromosome)
        return fitness - self.fitness_of(self._members[0])      # last, as mutation aims by her


class CutCrossover(WholeMembers):
    """The paper's crossover: above a random line one parent, below it the other, both ways."""

    def start(self, left, right, state, seed_words):
        """Make the initial population of a pair."""
        self._crossings = 0
        super().start(left, right, state, seed_words)

    def _cross(self, father):
        mother, other = self._members[0], self._members[father]
        self._crossings += 1
        draw = np.zeros(1)
        fill_uniform(key_of(*self._seed_words, 0, self._crossings), draw)
        (line,) = operators.crossover_lines(len(mother), draw)
        children = np.empty((2, *mother.shape), mother.dtype)
        operators.cut_crossover(mother, other, line, children[0])
        operators.cut_crossover(other, mother, line, children[1])
        return self._succeed(father, [other, *children])


class Unmutated(MeasuredSearch):
    """Without mutation."""

    def _mutate(self, slot, number, mutant):
        """Leave the copy of the fittest as it is."""


class WithoutPrior(MeasuredSearch):
    """The previous frames are averaged; their best does not lead the scanline guess."""

    def _guess_from(self, previous):
        super()._guess_from(self._guess.no_prior)


class PaperFitness(MeasuredSearch):
    """Regions are judged by Eq. 3 and 4; what it means at their borders is left out."""

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        super().__init__(config, rows, columns)
        self._measure = FuzzyFitness(config, rows, columns)
        self._gradients = (np.zeros((rows, columns), np.uint16),
                           np.zeros((rows, columns + config.disparities - 1), np.uint16))

    def start(self, left, right, state, seed_words):
        """Make the initial population of a pair."""
        self._measure.take(left, right)
        target = np.zeros(left.shape[:2], np.uint16)
        for image, norm in zip(grey_levels(left, right), (self._gradients[0], target)):
            gradient_norm(image, norm)
        gradient_by_index(target, self._config.min_disparity, self._gradients[1])
        super().start(left, right, state, seed_words)

    def terms(self, chromosome):
        """Return the terms of the outer sum of Eq. 3: float64 (R, C), 255ths."""
        genes, chosen = chromosome.astype(np.uint16), np.zeros(chromosome.shape, np.uint8)
        self._measure.choose(genes, chosen)
        side = self._config.neighbourhood
        around = cv2.boxFilter(chosen, cv2.CV_64F, (side, side), normalize=False,
                               borderType=cv2.BORDER_CONSTANT)
        reference, target = self._gradients
        place = np.arange(genes.shape[1]) - genes + self._config.disparities - 1
        return around * reference * np.take_along_axis(target, place.astype(np.intp), 1)

    def _cross(self, father):
        mother, other = self._members[0], self._members[father]
        rise = self.terms(other) - self.terms(mother)
        _, regions = cv2.connectedComponents((mother != other).astype(np.uint8), connectivity=4)
        rises = np.bincount(regions.ravel(), rise.ravel())
        rises[0] = 0
        taken = rises[regions] > 0
        mother[taken] = other[taken]
        gained = float(rises[rises > 0].sum())
        self.fitness[father] = self.fitness[0] + float(rise.sum())
        self.fitness[0] += gained
        return gained


class GreyClasses(MeasuredSearch):
    """
    The possibility of three grey classes in the place of census and gradient.

    A pixel's code has as many bits of a class as eighths of membership, Eq. 1. As the memberships
    sum to about one, the Hamming distance of two codes is 16 (1 - possibility), that of Eq. 2 with
    the bounded sum, not the maximum, as fuzzy OR.
    """

    def _see(self, left, right):
        super()._see(left, right)
        for possibility in (self._possibility, self._coarse.possibility):
            for view in (possibility.left, possibility.right):
                self._classify(view)

    def _classify(self, view):
        """Write the codes of an image, the last one repeated behind its row."""
        within = np.minimum(np.arange(view.census.shape[2]), view.columns - 1)
        for plane, centre in enumerate(CENTRES):
            degree = membership(np.arange(256), centre, self._config.class_sigma)
            codes = ((1 << np.rint(_BITS * degree).astype(np.int64)) - 1).astype(np.uint8)
            view.census[:, plane] = codes[view.grey][:, within]
        view.slopes[:] = 128
