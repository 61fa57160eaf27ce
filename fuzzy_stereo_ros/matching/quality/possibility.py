# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The possibility of a match, from census, colour and gradient of pixels and their supports.

Not in the paper: see kernels/possibility/fuzzy_costs.py.
"""
import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.possibility import fuzzy_costs as kernels
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.possibility import columns_below
import numpy as np

CENSUS_RADIUS, CODES = 2, 2     # px; planes of 16 bits
BLUR = 0.4           # px, standard deviation, of the luminance before the census
ROUNDS = 2           # how often costs are averaged over supports
OFFSET = 2**14       # makes slopes unsigned
COLUMN_PARTS = 8     # parts of the columns, so that running sums stay in the cache
# Differences at which a membership falls to 1 / e: bits of the census, six half grey levels of a
# colour, two half grey levels of slope along the row, and of the gradient along row and column.
WEIGHTS = np.rint(kernels.UNIT / np.array((12, 6 * 43, 2 * 2, 2 * 30))).astype(np.uint16)


class ViewFeatures:
    """Features of an image: census codes, colour, slopes; the right one mirrored and padded."""

    def __init__(self, rows, columns, padding):
        """Allocate; padding: columns behind a mirrored image, 0 for one that is not mirrored."""
        self._mirrored = padding > 0
        self.features = np.zeros((rows, CODES + kernels.PLANES, columns + padding), np.uint16)
        self._codes = np.zeros((rows, CODES, columns), np.uint16)

    def read_colour(self, colour):
        """Fill the planes from uint8 (R, C, 3)."""
        grey = cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY)
        rows, columns = grey.shape
        values = np.empty((rows, kernels.CHANNELS, columns), np.int16)
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
        self._place(np.concatenate([values, low, high, gradient], axis=1) + OFFSET,
                    self.features[:, CODES:])

    def read_census(self, luminance, bands, pool):
        """Fill the codes from luminance, float32 (R, C)."""
        blurred = cv2.GaussianBlur(luminance, (0, 0), BLUR, borderType=cv2.BORDER_REPLICATE)
        padded = cv2.copyMakeBorder(np.rint(blurred * 4), *[CENSUS_RADIUS] * 4,
                                    cv2.BORDER_REPLICATE)
        pool.each(lambda band: kernels.census(
            padded, CENSUS_RADIUS, self._codes, band[1], band[2]), bands)
        self._place(self._codes, self.features[:, :CODES])

    def _place(self, values, target):
        columns = values.shape[-1]
        if self._mirrored:
            target[..., :columns] = values[..., ::-1]
            target[..., columns:] = values[..., :1]
        else:
            target[:] = values


class SupportPossibility:
    """
    The costs of all matches of a pair: uint16 (R, C, labels), padded to LANES, 0 to FULL.

    extra: columns that a right image which is `moved` has before column 0
    """

    def __init__(self, rows, columns, disparities, lowest):
        """Allocate for images of a size and a range of disparities from `lowest` on."""
        labels = padded(disparities)
        self.disparities, self._bands = disparities, cut_bands(rows)
        self._left = ViewFeatures(rows, columns, 0)
        self.extra = columns_below(lowest, disparities - 1)
        self._right = ViewFeatures(rows, columns + self.extra, labels - self.extra)
        self._first_inside = max(lowest, -self.extra)
        self.costs = np.zeros((rows, columns, labels), np.uint16)
        self._arms = np.zeros((rows, columns, 4), np.uint8)
        edges = sorted({columns * part // COLUMN_PARTS for part in range(COLUMN_PARTS + 1)})
        self._parts = list(zip(edges, edges[1:]))

    def fill(self, pool, left, right, surface=None):
        """
        Fill the costs; left, right: (colour, luminance), the right one `moved`.

        Supports keep to the level of a parent's surface, float32 (R, C), px; None for the costs of
        single pixels.
        """
        for features, (colour, luminance) in zip((self._left, self._right), (left, right)):
            features.read_colour(colour)
            features.read_census(luminance, self._bands, pool)
        pool.each(lambda band: kernels.fill_costs(
            self._left.features, self._right.features, WEIGHTS, self.disparities,
            self._first_inside, self.costs, *band[1:]), self._bands)
        if surface is None:
            return
        pool.each(lambda band: kernels.fill_arms(
            left[0], surface, self._arms, band[1], band[2]), self._bands)
        for _ in range(ROUNDS):
            pool.each(lambda band: kernels.mean_over_rows(
                self.costs, self._arms, band[1], band[2]), self._bands)
            pool.each(lambda part: kernels.mean_over_columns(
                self.costs, self._arms, kernels.LONGEST, *part), self._parts)

    def add_prior(self, pool, surface, weights, dead_zone, cut, undo=False):
        """Make labels far from a surface cost more, or undo it: see kernels.add_prior."""
        pool.each(lambda band: kernels.add_prior(
            self.costs, surface, weights, np.float32(dead_zone), np.float32(cut), undo,
            band[1], band[2]), self._bands)


def padded(disparities):
    """Return how many labels costs have: whole vectors of them."""
    return -(-disparities // LANES) * LANES


def moved(image, lowest, disparities):
    """
    Return (colour, luminance) moved to the right by the lowest disparity, its border repeated.

    Moved to the left it begins before column 0, as far as labels reach.
    """
    columns = np.arange(-columns_below(lowest, disparities - 1), image[1].shape[1])
    return tuple(np.take(part, columns - lowest, 1, mode='clip') for part in image)
