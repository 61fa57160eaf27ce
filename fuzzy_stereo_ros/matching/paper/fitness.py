# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The population and its fuzzy fitness: Eq. 3 and 4 as printed, and their uniform reading.

As printed, Eq. 3 and 4 prefer maps that point at strong edges of the target: the ground truth of
Middlebury's pairs has 0.4 to 0.6 of the fitness of the fittest maps. The uniform reading keeps the
sum over all cells and takes from the paper's words

* possibility AND smoothness: "the evaluation function is formulated based on similarity and
  smoothness constraints"; Eq. 3 itself has no term of smoothness. AND is the product here.
* smoothness among uniform cells: a neighbour counts by its membership in the class of the cell's
  colour, for "disparities are smooth in a local neighbourhood", a "neighbouring N of uniform
  cells".

The paper has no words for the degree: equal genes are smooth, genes one apart nearly so (7 / 8),
all others are not. One half instead of 7 / 8 prefers walls that face the camera: on Bowling1 the
fitness then rises from 6 % to 12 % of wrong pixels. Eq. 4 is left out: gradients are in Eq. 2.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.genetic.literal_reading import fill_row_fitness
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import (
    EQUAL, fill_chosen, fill_fitness, fill_neighbour_weights, FRAME, WEIGHTS)
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_classes import (
    fill_largest_elsewhere, most_possible)
from fuzzy_stereo_ros.matching.paper.possibility import (
    FULL, LiteralPossibility, uniform_membership, UniformPossibility)
import numpy as np

SAME_MATCH = 1  # px within which two disparities are the same match


def gradient_norm(grey):
    """Return the norm of the Sobel gradient of uint8 (R, C), a factor of Eq. 4: uint16 (R, C)."""
    across, down = (cv2.Sobel(grey, cv2.CV_64F, *order) for order in ((1, 0), (0, 1)))
    return (np.sqrt(across**2 + down**2) + 0.5).astype(np.uint16)


def gradient_by_index(norm, min_disparity, by_index):
    """Write norm, uint16 (R, C), so that column c finds index k at c - k + D - 1, or 0 outside."""
    columns, width = norm.shape[1], by_index.shape[1]
    shift = width - columns + min_disparity
    first, last = max(shift, 0), min(shift + columns, width)
    by_index[:] = 0
    if first < last:
        by_index[:, first:last] = norm[:, first - shift:last - shift]


def inside(framed):
    """Return a view of the image's cells of framed maps: (..., R + 2, W) to (..., R, C)."""
    return framed[..., 1:-1, 1:framed.shape[-1] - FRAME + 1]


class _Fitness:
    """The possibilities of the matches of a pair: planes, uint8 (D, R + 2, W), 255ths, framed."""

    def __init__(self, possibility, rows):
        """possibility: of the reading; rows: of the image."""
        self._possibility, self._rows, self.planes = possibility, rows, possibility.planes

    def possibility_of(self, chromosome):
        """Return the possibility of a chromosome's matches: uint8 (R, C), 255ths."""
        chosen = np.zeros(self.planes.shape[1:], np.uint8)
        fill_chosen(self.planes, self._framed(chromosome), 0, self._rows, chosen)
        return inside(chosen)

    def largest_elsewhere(self, pool, chromosome):
        """Return the possibility of each cell's best match beyond SAME_MATCH: uint8 (R, C)."""
        framed, largest = self._framed(chromosome), np.zeros(self.planes.shape[1:], np.uint8)
        pool.each(lambda band: fill_largest_elsewhere(self.planes, framed, SAME_MATCH, *band[1:],
                                                      largest), cut_bands(self._rows))
        return inside(largest)

    def most_possible(self, genes):
        """Write the most possible disparity of each cell: uint16 (R + 2, W), framed."""
        most_possible(self.planes, np.zeros(genes.shape[1], np.uint8), genes)

    def _framed(self, chromosome):
        framed = np.zeros(self.planes.shape[1:], np.uint16)
        inside(framed)[:] = chromosome
        return framed


class LiteralFitness(_Fitness):
    """Eq. 3 and 4 of the chromosomes of a pair; details: int64 (R,), of rows; unit: of sums."""

    unit = FULL

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        super().__init__(LiteralPossibility(config, rows, columns), rows)
        self._config = config
        self._target_gradient = np.zeros((rows, columns + config.disparities - 1), np.uint16)

    def details(self, population):
        """Allocate the details of a number of chromosomes."""
        return np.zeros((population, self._rows), np.int64)

    def set_pair(self, pool, luminances, greys, colours, slopes=None):
        """Set the pair to evaluate on; greys: uint8 (R, C), of both images; others: not used."""
        left, right = greys
        self._possibility.set_pair(left, right)
        self._reference_gradient = gradient_norm(left)
        gradient_by_index(gradient_norm(right), self._config.min_disparity, self._target_gradient)

    def evaluate(self, genes, chosen, details, first, last):
        """Write `chosen` and details after genes of some rows changed; return the sum."""
        fill_chosen(self.planes, genes, first, last, chosen)
        genes, chosen = inside(genes), inside(chosen)
        side, gradients = self._config.neighbourhood, (
            self._reference_gradient, self._target_gradient)
        fill_row_fitness(chosen, genes, gradients, side, max(first - side // 2, 0),
                         min(last + side // 2, self._rows), details)
        return details.sum()


class UniformFitness(_Fitness):
    """The uniform reading of Eq. 3 for a pair; details: uint16 (R + 2, W), of cells, framed."""

    unit = FULL * WEIGHTS * EQUAL

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        super().__init__(UniformPossibility(config, rows, columns), rows)
        self._columns, framed = columns, self.planes.shape[1:]
        self.weights, self.colours = (np.zeros((number, *framed), np.uint8) for number in (8, 3))
        self._similar = uniform_membership()

    def details(self, population):
        """Allocate the details of a number of chromosomes."""
        return np.zeros((population, *self.weights.shape[1:]), np.uint16)

    def set_pair(self, pool, luminances, greys, colours, slopes=None):
        """Set a pair: luminances, uint16 (R, C); colours, uint8 (R, C, 3); slopes: of N."""
        inside(self.colours)[:] = np.moveaxis(colours, 2, 0)
        self._possibility.set_pair(pool, *luminances, self.colours, slopes)
        pool.each(lambda band: fill_neighbour_weights(
            self.colours, self._similar, *band[1:], self.weights), cut_bands(self._rows))

    def evaluate(self, genes, chosen, details, first, last):
        """Write `chosen` and details after genes of some rows changed; return the sum."""
        fill_chosen(self.planes, genes, first, last, chosen)
        first, last = max(first - 1, 0), min(last + 1, self._rows)
        total = fill_fitness(genes, chosen, self.weights, self._columns, first, last, details)
        return total if last - first == self._rows else inside(details).sum(dtype=np.int64)


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
