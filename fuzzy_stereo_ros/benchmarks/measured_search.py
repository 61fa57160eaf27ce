# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The guided search as it is, which can be asked what any chromosome is worth to it."""
from fuzzy_stereo_ros.comparing.known_pairs import bad_percent, KITTI
from fuzzy_stereo_ros.matching.realtime.matcher import GuidedSearch
import numpy as np


class MeasuredSearch(GuidedSearch):
    """The guided search; once a pair is matched, it judges other chromosomes of the pair."""

    @property
    def disparities(self):
        """How many labels there are."""
        return self._config.disparities

    def fitness_of(self, chromosome):
        """Return the fitness of a chromosome, measured on every row."""
        return self._fitness.adopt(self._crew, chromosome, every=1)

    def child_of(self, mother, father):
        """Return what partition crossover makes of two chromosomes."""
        child = mother.copy()
        self._fitness.adopt(self._crew, child)
        self._fitness.join(self._crew, child, father)
        return child


def genes_of(disparity, search):
    """Return a map as a chromosome of a search: in whole pixels, those it can have."""
    return np.clip(np.rint(disparity), 0, search.disparities - 1).astype(search.population.dtype)


def asked_about_truth(scene, known, search):
    """
    Return the fitness of the ground truth, and the error that would be left of the fittest.

    The truth is taken in whole pixels, and the fittest's genes where it is unknown. What would be
    left: the fittest is crossed with the truth of its wrong cells. NaN for KITTI, whose truth has
    no regions.
    """
    if scene.family == KITTI:
        return float('nan'), float('nan')
    fittest, there = search.population[0], np.isfinite(known.truth)
    right = genes_of(np.where(there, known.truth, 0), search)
    wrong = there & ~(abs(fittest - known.truth) <= scene.limit)
    child = search.child_of(fittest, np.where(wrong, right, fittest))
    return (search.fitness_of(np.where(there, right, fittest)),
            bad_percent(child.astype(np.float32), known, scene.limit))
