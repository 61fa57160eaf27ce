# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The possibility of a match, from census, colour and gradient of pixels and their supports.

Not in the paper: see kernels/possibility/fuzzy_costs.py. A model is a set of scales.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.possibility import cross_support, fuzzy_costs
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

CENSUS_RADIUS, CENSUS_BITS = 2, 24
OFFSET = 2**14       # makes slopes unsigned
COLUMN_PARTS = 8     # parts of the columns, so that running sums stay in the cache
ALIKE, MUCH_ALIKE = 14, 8      # grey levels that end an arm: near its centre, and farther


class Model(NamedTuple):
    """The scales of one possibility model: differences at which a membership falls to 1 / e."""

    census: float            # bits
    colour: float            # grey levels
    slope: float             # grey levels per px, along the row
    gradient: float          # grey levels per px, along row and column together
    blurs: tuple             # standard deviations of blurs of the luminance, a census each
    longest: int             # arms of the supports, px
    near: int                # px beyond which arms are stricter
    rounds: int              # how often costs are averaged over supports


class Picture:
    """Features of an image: census codes, colour, slopes; the right one mirrored and padded."""

    def __init__(self, rows, columns, padding, code_planes):
        """Allocate; padding: columns behind a mirrored image, 0 for one that is not mirrored."""
        self._mirrored = padding > 0
        self.codes = np.zeros((rows, code_planes, columns + padding), np.uint16)
        self.planes = np.zeros((rows, fuzzy_costs.PLANES, columns + padding), np.uint16)
        self._codes = np.zeros((rows, code_planes, columns), np.uint16)

    def read_colour(self, colour):
        """Fill the planes from uint8 (R, C, 3)."""
        grey = cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY)
        rows, columns = grey.shape
        values = np.empty((rows, fuzzy_costs.CHANNELS, columns), np.int16)
        values[:, :3] = colour.transpose(0, 2, 1)
        values[:, :3] *= 2
        values[:, 3] = cv2.Sobel(grey, cv2.CV_16S, 1, 0, ksize=1)
        low, high = values.copy(), values.copy()
        between = (values[:, :, :-1] + values[:, :, 1:]) >> 1
        np.minimum(low[:, :, 1:], between, out=low[:, :, 1:])
        np.minimum(low[:, :, :-1], between, out=low[:, :, :-1])
        np.maximum(high[:, :, 1:], between, out=high[:, :, 1:])
        np.maximum(high[:, :, :-1], between, out=high[:, :, :-1])
        gradient = np.stack([cv2.Sobel(grey, cv2.CV_16S, 1, 0), cv2.Sobel(grey, cv2.CV_16S, 0, 1)],
                            axis=1) >> 2
        self._place(np.concatenate([values, low, high, gradient], axis=1) + OFFSET, self.planes)

    def read_census(self, luminance, blurs, bands, pool):
        """Fill the codes from luminance, float32 (R, C)."""
        radius = CENSUS_RADIUS
        for scale, blur in enumerate(blurs):
            blurred = cv2.GaussianBlur(luminance, (0, 0), blur, borderType=cv2.BORDER_REPLICATE)
            padded = cv2.copyMakeBorder(np.rint(blurred * 4), *[radius] * 4, cv2.BORDER_REPLICATE)
            pool.each(lambda band, padded=padded, bit=CENSUS_BITS * scale: fuzzy_costs.census(
                padded, radius, bit, self._codes, band[1], band[2]), bands)
        self._place(self._codes, self.codes)

    def _place(self, values, target):
        columns = values.shape[-1]
        if self._mirrored:
            target[..., :columns] = values[..., ::-1]
            target[..., columns:] = values[..., :1]
        else:
            target[:] = values


class SupportPossibility:
    """
    The costs of all matches of a pair.

    costs: uint16 (R, C, labels), 0 to FULL, labels padded to a multiple of LANES
    """

    def __init__(self, rows, columns, disparities, model):
        """Allocate for images of a size and for a model, or one of less rounds."""
        labels = padded(disparities)
        planes, longest = _code_planes(model), model.longest
        self.disparities, self._bands = disparities, cut_bands(rows)
        self._left = Picture(rows, columns, 0, planes)
        self._right = Picture(rows, columns, labels, planes)
        self.costs = np.zeros((rows, columns, labels), np.uint16)
        self._arms = np.zeros((rows, columns, 4), np.uint8)
        self._row_sums = [np.zeros((columns + 1) * labels, np.uint16) for _ in self._bands]
        edges = sorted({columns * part // COLUMN_PARTS for part in range(COLUMN_PARTS + 1)})
        self._parts = [
            (low, high, np.zeros((2 * longest + 2, (high - low) * labels), np.uint16))
            for low, high in zip(edges, edges[1:])]

    def set_pair(self, left, right, first_inside):
        """
        Set a pair, each image as (colour, luminance).

        first_inside: first column of the right image, moved, that exists
        """
        self._colour, self._first_inside = left[0], first_inside
        self._luminance = left[1], right[1]
        self._left.read_colour(left[0])
        self._right.read_colour(right[0])

    def fill(self, pool, model, surface=None, level=0.0):
        """
        Fill the costs under a model.

        surface: float32 (R, C), px, of a parent; level: px of it that supports may span; neither
        counts for a model of no rounds
        """
        for picture, luminance in zip((self._left, self._right), self._luminance):
            picture.read_census(luminance, model.blurs, self._bands, pool)
        unit = fuzzy_costs.UNIT
        weights = np.rint([unit / model.census, unit / (6 * model.colour),
                           unit / (2 * model.slope), unit / (2 * model.gradient)])
        pool.each(lambda band: fuzzy_costs.fill_costs(
            (self._left.codes, self._left.planes), (self._right.codes, self._right.planes),
            _code_planes(model), weights.astype(np.uint16), self.disparities, self._first_inside,
            self.costs, band[1], band[2]), self._bands)
        if model.rounds:
            rules = tuple(cross_support.ArmRules(
                model.longest, model.near, ALIKE, MUCH_ALIKE, np.float32(level)))
            pool.each(lambda band: cross_support.fill_arms(
                self._colour, surface, rules, self._arms, band[1], band[2]), self._bands)
        for _ in range(model.rounds):
            pool.each(lambda band: cross_support.mean_over_rows(
                self.costs, self._arms, self._row_sums[band[0]], band[1], band[2]), self._bands)
            pool.each(lambda part: cross_support.mean_over_columns(
                self.costs, self._arms, model.longest, part[2][:2 * model.longest + 2],
                part[0], part[1]), self._parts)

    def add_prior(self, pool, surface, weights, dead_zone, cut, undo=False):
        """Make labels far from a surface cost more, or undo it: see fuzzy_costs.add_prior."""
        pool.each(lambda band: fuzzy_costs.add_prior(
            self.costs, surface, weights, np.float32(dead_zone), np.float32(cut), undo,
            band[1], band[2]), self._bands)


def padded(disparities):
    """Return how many labels costs have: whole vectors of them."""
    return -(-disparities // LANES) * LANES


def _code_planes(model):
    """Return how many planes of 16 bits the censuses of a model take."""
    return -(-CENSUS_BITS * len(model.blurs) // 16)


def moved(image, shift):
    """
    Return an image moved to the right by `shift` columns, its border repeated.

    image: (colour, luminance), uint8 (R, C, 3) and float32 (R, C), B + 2 G + R, finer than 8 bits
    """
    columns = np.arange(image[1].shape[1])
    return tuple(np.take(part, columns - shift, 1, mode='clip') for part in image)
