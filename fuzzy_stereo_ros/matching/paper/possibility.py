# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The possibility of a match: Eq. 1 and 2 as printed, and Eq. 2 in the uniform reading.

The uniform reading differs from Eq. 2 as printed in four points:

* Gradients. Besides three grey classes it has five classes for the gradient across and five for
  that down; a match is possible if grey AND both gradients agree. Of the gradient the paper says
  only that Eq. 4 is "to penalize pixels which project onto uniform regions".
* N is centred on the cell and holds its uniform cells: Pi(r + i, c + j, C(r, c)), not the genes
  of the neighbours as in Eq. 3: "comparing the areas around the two pixels", "to have a
  discriminating comparison between the projections", "a neighbouring N of uniform cells". Where
  a map is inherited from the previous frame, N rises as that does there, so that it is compared
  along slanted surfaces: as Eq. 3 does with the genes of the neighbours.
* Gradient classes are compared by `shared_membership`. The paper has no words for this.
* A match counts as possible if it is very possible, Zadeh's "very" being the square. The paper
  has no words for this.

A match outside the target has no evidence for or against it: it counts in N as
`OUTSIDE_POSSIBILITY`, so that the cells around it decide.
"""
import math

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import FRAME
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_classes import (
    average_over_uniform, fill_class_possibility, fill_planes, OUTSIDE_POSSIBILITY, REACH)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

GREY_CENTRES = (0.0, 127.5, 255.0)      # black, average and white
GREY_SIGMA = 54.0       # two neighbouring classes cross at one half; the paper leaves it open
# Falling strongly, falling, flat, rising, rising strongly; in logarithms of grey levels a pixel.
GRADIENT_CENTRES = (-4.0, -2.0, 0.0, 2.0, 4.0)
# Neighbouring classes cross at one half.
GRADIENT_SIGMA = 1.0 / np.sqrt(2.0 * np.log(2.0))
FULL = 255.0            # a possibility of 1 in the whole numbers of the kernels
RISE_REACH = 6          # cells on both sides of one over which a map rises
BENT = 1                # labels by which these rises may differ; more is a step between surfaces
GRADIENT_STEPS = 8      # levels of a gradient a unit of its classes
UNIFORM_SIGMA = 20.0    # grey levels, of the class of the colour at the middle of N
LEAST_UNIFORM = 0.007   # a membership below this is none
NEAR_SIGMA = 0.28       # of the nearness to the middle of N, as a share of its side
SOBEL_SCALE = 0.25      # of a Sobel response, to grey levels of 8 bits over one pixel or so


def membership(level, centre, sigma):
    """Return how much pixels belong to a fuzzy class, 0 to 1: Eq. 1, all in one unit."""
    return np.exp(-(np.asarray(level, np.float64) - centre)**2 / (2.0 * sigma**2))


def memberships(level, centres, sigma):
    """Return the memberships in several classes, the last axis: Eq. 1 of each."""
    return np.stack([membership(level, centre, sigma) for centre in centres], axis=-1)


def matching_possibility(first, second, sigma, centres=GREY_CENTRES):
    """Return Eq. 2, 0 to 1, of two levels: over the classes OR of AND, maximum of minimum."""
    return np.minimum(memberships(first, centres, sigma),
                      memberships(second, centres, sigma)).max(axis=-1)


def shared_membership(first, second, sigma, centres):
    """
    Return the share of their memberships that pixels of two levels have in common, 0 to 1.

    Not in the paper, whose Eq. 2 is at most one half for two equal pixels between two classes:
    the sum over the classes of the smaller memberships over that of the larger ones is 1 there.

    first, second: shapes that broadcast, in the unit of sigma and centres
    """
    first, second = memberships(first, centres, sigma), memberships(second, centres, sigma)
    return np.minimum(first, second).sum(axis=-1) / np.maximum(first, second).sum(axis=-1)


def compressed(gradient):
    """Return the signed logarithm of gradients, which spreads faint ones: not in the paper."""
    return np.copysign(np.log1p(np.abs(gradient)), gradient)


def possibility_table(sigma=GREY_SIGMA):
    """Return Eq. 2 of every pair of grey levels: uint8 (256, 256), 255ths."""
    levels = np.arange(256)
    exact = matching_possibility(levels[:, np.newaxis], levels[np.newaxis, :], sigma)
    return np.rint(FULL * exact).astype(np.uint8)


def gradient_table():
    """Return `shared_membership` of every pair of levels of a gradient: uint8 (256, 256)."""
    levels = np.clip((np.arange(256) - 128.0) / GRADIENT_STEPS, GRADIENT_CENTRES[0],
                     GRADIENT_CENTRES[-1])
    exact = shared_membership(levels[:, np.newaxis], levels[np.newaxis, :], GRADIENT_SIGMA,
                              GRADIENT_CENTRES)
    return np.rint(FULL * exact).astype(np.uint8)


def class_levels(luminance):
    """Return levels of grey and both gradients of unrounded luminance, uint16: uint8 (3, R, C)."""
    grey = np.float32(1 / 256) * luminance
    gradients = [cv2.Sobel(grey, cv2.CV_32F, *order) * np.float32(SOBEL_SCALE)
                 for order in ((1, 0), (0, 1))]
    levels = [grey, *(128 + GRADIENT_STEPS * compressed(gradient) for gradient in gradients)]
    return np.stack([np.clip(np.rint(level), 0, 255).astype(np.uint8) for level in levels])


def uniform_membership(sigma=UNIFORM_SIGMA):
    """Return Eq. 1 about a colour, by squared distance / 4, down to LEAST_UNIFORM: float32."""
    last = int(-2 * sigma**2 * np.log(LEAST_UNIFORM) / 4)
    return np.exp(-4 * np.arange(last + 1) / (2 * sigma**2)).astype(np.float32)


def nearness(neighbourhood):
    """Return the nearness of cells of N to its middle, by distance: float32 (side // 2 + 1,)."""
    distance = np.arange(neighbourhood // 2 + 1) / (NEAR_SIGMA * neighbourhood)
    return np.exp(-distance**2 / 2).astype(np.float32)


def slopes_of(labels, neighbourhood):
    """Return by how much labels, float32 (R, C), rise a cell over N, but for steps: (2, R, C)."""
    return np.stack([_slopes_across(labels, neighbourhood),
                     _slopes_across(labels.T, neighbourhood).T])


def _slopes_across(labels, side):
    """Return the same along rows: float32 (R, C)."""
    rises, known = np.zeros((2, *labels.shape), np.float32)
    before, middle, after = (
        labels[:, :-2 * RISE_REACH], labels[:, RISE_REACH:-RISE_REACH], labels[:, 2 * RISE_REACH:])
    straight = np.abs(before - 2 * middle + after) <= BENT
    rises[:, RISE_REACH:-RISE_REACH] = np.where(straight, after - before, 0)
    known[:, RISE_REACH:-RISE_REACH] = straight
    total, number = (cv2.boxFilter(values, -1, (side, side), normalize=False,
                                   borderType=cv2.BORDER_CONSTANT) for values in (rises, known))
    return total / np.maximum(2 * RISE_REACH * number, 1)


class LiteralPossibility:
    """Eq. 2 as printed, 0 outside the target; planes: uint8 (D, R + 2, W), 255ths, framed."""

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        self._min_disparity, self._columns = config.min_disparity, columns
        self._table = possibility_table()
        self.planes = np.zeros((config.disparities, rows + 2, columns + FRAME), np.uint8)

    def set_pair(self, left, right):
        """Write the possibilities of a pair, uint8 (R, C), of which left is the reference."""
        columns = self._columns
        for shift, plane in enumerate(self.planes[:, 1:-1, 1:columns + 1], self._min_disparity):
            first, last = max(shift, 0), min(columns + shift, columns)
            plane[:] = 0
            if first < last:
                plane[:, first:last] = self._table[
                    left[:, first:last], right[:, first - shift:last - shift]]


class UniformPossibility:
    """Eq. 2 over grey AND gradients over N; planes: uint8 (D, R + 2, W), 255ths, framed."""

    def __init__(self, config, rows, columns):
        """Allocate all that pairs of one size need."""
        shape = rows, columns, max(config.disparities, LANES) + REACH
        self._disparities = config.disparities
        gradient = gradient_table()
        self._tables = np.stack([possibility_table(), gradient, gradient])
        # Zadeh's "very", of each possibility
        self._very = np.rint(FULL * (np.arange(256) / FULL)**2).astype(np.uint8)
        # none beyond LEAST_UNIFORM
        self._weights = np.outer(nearness(config.neighbourhood),
                                 np.append(uniform_membership(), np.float32(0)))
        self._min_disparity = config.min_disparity
        self._cells, self._along_rows = (
            np.full(REACH + math.prod(shape), OUTSIDE_POSSIBILITY, np.uint8)[REACH:].reshape(shape)
            for _ in range(2))
        self._flat = np.zeros((2, rows, columns), np.float32)
        self._steepest = REACH / max(config.neighbourhood // 2, 1)
        self._bands, self._levels = cut_bands(rows), [None, None]
        self.planes = np.zeros((config.disparities, rows + 2, columns + FRAME), np.uint8)

    def set_pair(self, pool, left, right, colours, slopes=None):
        """Write the possibilities; slopes: float32 (2, R, C), of N, labels a cell, or None."""
        across, down = self._flat if slopes is None else np.clip(
            slopes, -self._steepest, self._steepest)

        def describe(side):
            self._levels[side] = class_levels((left, right)[side])

        def match(band):
            fill_class_possibility(self._tables, tuple(self._levels), self._min_disparity,
                                   self._disparities, *band[1:], self._cells)

        def average_along_rows(band):
            average_over_uniform(self._cells, colours, self._weights, across, self._disparities,
                                 False, *band[1:], self._along_rows)

        def average_along_columns(band):
            average_over_uniform(self._along_rows, colours, self._weights, down, self._disparities,
                                 True, *band[1:], self._cells)
            fill_planes(self._cells, self._very, *band[1:], self.planes)

        pool.each(describe, (0, 1))
        for work in (match, average_along_rows, average_along_columns):
            pool.each(work, self._bands)
