# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the profile `quality`: the cost of genes that are planes, in one view of a pair.

Not in the paper. The cost of a map is the sum of the matches along its planes, which count little
where the two views disagree, and of the differences of neighbours' planes, which count less at
edges and where texture is strong. All costs are whole numbers.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.planes import costs as kernels
from fuzzy_stereo_ros.matching.kernels.planes.fits import disparities_of
import numpy as np

SUPPORT_RADIUS, SUPPORT_STRIDE = 2, 2  # of supports: 5 x 5 pixels, every other one
SUPPORT_COLOUR, SUPPORT_DISTANCE = 20.0, 8.0     # grey levels summed over channels; px
LEAST_PURE = 0.1                 # share of a pixel of a support, whatever lies around it
EDGE, LEAST_EDGE = 10.0, 0.005   # difference of colours at which smoothness falls to 1 / e; floor
STRONG_TEXTURE = 0.3             # share of smoothness that counts where texture is strong
UNTRUSTED = 5                    # trust in a match, of TRUSTED, where the views disagree


class PlaneFitness:
    """Measures plane maps, float32 (R, 3, C), of a view; trusted: bool (R, C), where in full."""

    def __init__(self, rows, columns, disparities):
        """Allocate."""
        self._bands, self.disparities_searched = cut_bands(rows), disparities
        shape = rows, columns
        side = 2 * SUPPORT_RADIUS + 1
        self._supports = kernels.Supports(
            SUPPORT_STRIDE, np.zeros((*shape, side, side), np.uint8), np.zeros(shape, np.uint16))
        self._smoothness = np.zeros((2, *shape), np.float32)
        self.trusted = np.ones(shape, np.bool_)
        self._sums = np.zeros(rows, np.int64)
        self._by_colour = (255 * np.exp(-np.arange(766) / SUPPORT_COLOUR)).astype(np.float32)
        distance = np.arange(-SUPPORT_RADIUS, SUPPORT_RADIUS + 1) * SUPPORT_STRIDE
        self._by_distance = np.exp(
            -distance**2 / (2 * SUPPORT_DISTANCE**2)).astype(np.float32)
        self.largest = kernels.UNIT * rows * columns

    def set_view(self, pool, volume, origin, colour, roots, weak):
        """
        Set a view of a pair.

        volume: uint8 (R, C, labels), costs of the left image's matches; origin: None for the left
        view; for the mirrored right one, the column in which the match of its column 0 with
        label 0 is; colour: uint8 (R, C, 3); roots: float32 (R, C, 3), of the colours;
        weak: float32 (R, C), how weak the texture is, 0 to 1
        """
        self._volume = kernels.Volume(volume, *((0, 0) if origin is None else (origin, 1)))
        self._fill_supports(pool, colour)
        share = kernels.UNIT * (STRONG_TEXTURE + (1 - STRONG_TEXTURE) * weak)
        across, down = self._smoothness
        across[:, 1:] = share[:, 1:] * _smooth_over(roots[:, 1:] - roots[:, :-1])
        down[1:] = share[1:] * _smooth_over(roots[1:] - roots[:-1])

    def _fill_supports(self, pool, colour):
        """
        Write the weights of the pixels of supports: less where the census spans other colours.

        Beside an edge the census of a background pixel includes the foreground and is evidence for
        its disparity. Pixels of the support that are farther from the edge are better evidence.
        """
        def fill(stride, by_distance, share):
            supports = tuple(self._supports._replace(stride=stride))
            pool.each(lambda band: kernels.fill_supports(
                colour, self._by_colour, by_distance, share, supports, *band[1:]), self._bands)
        even, all_of_it = np.ones_like(self._by_distance), np.ones(colour.shape[:2], np.float32)
        fill(1, even, all_of_it)        # the pixels that a census compares
        pure = self._supports.masses / np.float32(255 * even.size**2)
        fill(SUPPORT_STRIDE, self._by_distance, np.maximum(pure, np.float32(LEAST_PURE)))

    def match_costs(self, pool, planes, selected=None):
        """Return match costs along planes, without trust: int16 (R, C), 0 unless selected."""
        costs = np.zeros(self.trusted.shape, np.int16)
        selected = np.ones(costs.shape, np.bool_) if selected is None else selected
        pool.each(lambda band: kernels.plane_costs(
            tuple(self._volume), self.disparities_searched, tuple(self._supports), selected,
            (planes, costs), *band[1:]), self._bands)
        return costs

    def trusted_costs(self, costs):
        """Return match costs times the trust in them: int16 (R, C)."""
        little = costs * np.int16(UNTRUSTED) // np.int16(kernels.TRUSTED)
        return np.where(self.trusted, costs, little)

    def total(self, pool, planes, costs):
        """Return the cost of a map with smoothness; costs: int16 (R, C), trusted ones."""
        pool.each(lambda band: kernels.smoothness(
            planes, self._smoothness, self._sums, band[1], band[2]), self._bands)
        return int(costs.sum(dtype=np.int64)) + int(self._sums.sum())

    def fill(self, exchange, first, second, selected):
        """Write to an Exchange what the second `Parent`'s planes change in selected cells."""
        exchange.set_cells(selected)
        kernels.fill_exchange(first, second, self._smoothness, exchange.changes())

    def disparities(self, pool, planes):
        """Return the disparities of planes: float32 (R, C), px from 0."""
        result = np.empty(self.trusted.shape, np.float32)
        highest = np.float32(self.disparities_searched - 1)
        pool.each(lambda band: disparities_of(
            planes, highest, result, band[1], band[2]), self._bands)
        return result


def _smooth_over(difference):
    """Return the weight of smoothness over a difference of colours, at most 1."""
    apart = np.abs(difference).sum(axis=2)
    return np.maximum(np.exp(apart / np.float32(-EDGE)), np.float32(LEAST_EDGE))
