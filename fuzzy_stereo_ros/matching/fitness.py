# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fuzzy fitness of the paper: Eq. 3 and Eq. 4 over Eq. 2, higher is fitter."""
import cv2
from fuzzy_stereo_ros.matching.kernels.grey_fitness import fill_gradient_norm, fill_row_fitness
from fuzzy_stereo_ros.matching.kernels.grey_possibility import (
    fill_chosen_possibility, fill_grey_possibility)
from fuzzy_stereo_ros.matching.possibility import FULL, grey_levels, possibility_table
import numpy as np


def gradient_norm(grey, norm):
    """
    Write the norm of the Sobel gradient, a factor of Eq. 4, rounded to grey levels.

    grey: uint8 (R, C); norm: uint16 (R, C), grey levels, written
    """
    across = cv2.Sobel(grey, cv2.CV_16S, 1, 0)
    down = cv2.Sobel(grey, cv2.CV_16S, 0, 1)
    fill_gradient_norm(across, down, norm)


def gradient_by_index(norm, min_disparity, by_index):
    """
    Write the gradient of the target so that column c finds index k at c - k + D - 1.

    A match outside the target image has gradient 0: it weighs nothing in Eq. 3.

    norm: uint16 (R, C), of the target; by_index: uint16 (R, C + D - 1), written
    """
    columns, width = norm.shape[1], by_index.shape[1]
    shift = width - columns + min_disparity
    first, last = max(shift, 0), min(shift + columns, width)
    by_index[:] = 0
    if first < last:
        by_index[:, first:last] = norm[:, first - shift:last - shift]


def total_fitness(row_fitness):
    """
    Return the fitness of chromosomes from that of their rows: the outer sum of Eq. 3.

    row_fitness: int64 (..., R), 255ths; fitness: float64 (...)
    """
    return row_fitness.sum(axis=-1) / FULL


class FuzzyFitness:
    """
    The fitness of the chromosomes of one pair.

    possibility: uint8 (R, C, D), 255ths, Eq. 2 with the grey classes
    """

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        self._min_disparity = config.min_disparity
        self._neighbourhood = config.neighbourhood
        self._table = possibility_table(config.class_sigma)
        self._reference_gradient = np.zeros((rows, columns), np.uint16)
        self._target_norm = np.zeros((rows, columns), np.uint16)
        self._target_gradient = np.zeros((rows, columns + config.disparities - 1), np.uint16)
        self.possibility = np.zeros((rows, columns, config.disparities), np.uint8)

    def take(self, left, right):
        """
        Take a pair: from now on it is what chromosomes are measured by.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR
        """
        left, right = grey_levels(left, right)
        fill_grey_possibility(
            self._table, left, right, self._min_disparity, self.possibility)
        gradient_norm(left, self._reference_gradient)
        gradient_norm(right, self._target_norm)
        gradient_by_index(self._target_norm, self._min_disparity, self._target_gradient)

    def choose(self, chromosome, chosen):
        """
        Write how possible the matches are that a chromosome chose.

        chromosome: uint16 (R, C), index of a disparity; chosen: uint8 (R, C), 255ths, written
        """
        fill_chosen_possibility(self.possibility, chromosome, chosen)

    def evaluate(self, chosen, chromosome, scratch, first, last, row_fitness):
        """
        Write the fitness of the rows from first to last - 1: Eq. 3.

        chosen: uint8 (R, C), from `choose`; chromosome: uint16 (R, C), index of a disparity
        scratch: from `scratch`; row_fitness: int64 (R,), 255ths, written
        """
        fill_row_fitness(chosen, chromosome, self._reference_gradient, self._target_gradient,
                         self._neighbourhood, *scratch, first, last, row_fitness)

    def scratch(self):
        """Return what one thread needs to evaluate."""
        columns = self._reference_gradient.shape[1]
        return (np.zeros(columns + self._neighbourhood - 1, np.int32),
                np.zeros(columns, np.int32))
