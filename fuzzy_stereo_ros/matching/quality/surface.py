# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Dense maps with sub-pixel disparities: made of chosen labels, smoothed, measured and crossed.

Not in the paper, whose maps are whole-pixel. The fitness of a map is the possibility of its
matches over supports that keep to the parent's surface, and the steps of disparity, which are free
as far as a slanted surface makes them and cost less at edges of grey.
"""
import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.crossover import Exchange, Regions
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import list_cells
from fuzzy_stereo_ros.matching.kernels.genetic.surface_cost import Steps
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.refinement import consistency, dense_map, filling
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.quality.planes import colour_weights, neighbours
import numpy as np

MEDIAN_RADIUS, MEDIAN_COLOUR, MEDIAN_DISTANCE = 9, 20.0, 9.0     # px, grey levels, px
UNTRUSTED_SHARE = 0.1    # share of a match that counts where the two views disagree
_HALF = 1                # genes are measured in 8 bits: costs divided by 2**_HALF
_TOGETHER = 16           # rows that are divided at a time


class DenseSurface:
    """Makes dense maps of chosen labels, for one image size."""

    def __init__(self, rows, columns, disparities):
        """Allocate for images of a size and a number of disparities."""
        self._bands, self._disparities = cut_bands(rows), disparities
        self.validity = np.zeros((rows, columns), np.uint8)
        self.fitted, self._filled, self._median, self._smooth = (
            np.zeros((rows, columns), np.float32) for _ in range(4))
        self._histograms = [np.zeros(dense_map.BINS * disparities + 1, np.float32)
                            for _ in self._bands]
        distance = np.arange(-MEDIAN_RADIUS, MEDIAN_RADIUS + 1)
        self._median_weights = MEDIAN_RADIUS, colour_weights(MEDIAN_COLOUR), np.exp(
            -distance**2 / (2 * MEDIAN_DISTANCE**2)).astype(np.float32)

    def check(self, pool, labels, target, target_range):
        """
        Write the validity of labels, int16 (R, C): whether the target's pixels chose the same.

        target_range: the first and the last column of the (moved) target that exist
        """
        pool.each(lambda band: consistency.check_consistency(
            labels, target, self._disparities, target_range, self.validity, band[1], band[2]),
            self._bands)

    def fill(self, pool, labels, offsets, colour, result):
        """
        Write a dense map: rejected pixels get the background's disparity, then a median.

        labels: int16, offsets: float32, colour: uint8 (R, C, 3); result: float32 (R, C), px
        """
        np.add(labels, offsets, out=self.fitted)
        np.clip(self.fitted, 0, self._disparities - 1, out=self.fitted)
        rejected = (self.validity == INVALID).astype(np.uint8)
        pool.each(lambda band: filling.fill_rows(
            self.fitted, self.validity, self._filled, band[1], band[2]), self._bands)
        pool.each(lambda band: dense_map.weighted_median(
            self._filled, rejected, colour, self._median_weights, self._histograms[band[0]],
            self._median, band[1], band[2]), self._bands)
        cv2.medianBlur(self._median, 5, dst=result)

    def smooth(self, pool, surface, colour, radius, limit):
        """Return the map of local planes, float32 (R, C), memory that the next call reuses."""
        around = tuple(neighbours(radius, limit))
        pool.each(lambda band: dense_map.local_planes(
            surface, colour, around, self._smooth, *band[1:]), self._bands)
        return np.clip(self._smooth, 0, self._disparities - 1, out=self._smooth)


class SurfaceFitness:
    """Measures and crosses dense maps of one image size."""

    def __init__(self, rows, columns, disparities):
        """Allocate; disparities: how many labels exist."""
        self._disparities = disparities
        self._weights = np.zeros((2, rows, columns), np.float32)
        self._trust = np.ones((rows, columns), np.float32)

    def trust(self, rejected):
        """Let matches count little where they are rejected: bool (R, C)."""
        self._trust[:] = np.where(rejected, np.float32(UNTRUSTED_SHARE), np.float32(1))

    def set_weights(self, weights):
        """Set the weights of steps to the left and up: float32 (2, R, C)."""
        self._weights[:] = weights

    def measure(self, pool, costs, first, maps, results):
        """
        Write the costs of the genes of maps in some rows, in halves of the costs' unit.

        costs: uint16 (rows, C, labels), 0 to FULL, from row `first` of the frame on; maps,
        results: of float32 (R, C)
        """
        def measure_rows(begin):
            # Half of FULL becomes 0 in a byte: a fully impossible match is no evidence.
            half = (costs[begin:begin + _TOGETHER] >> _HALF).astype(np.uint8)
            rows = slice(first + begin, first + begin + len(half))
            for surface, result in zip(maps, results):
                surface_cost.gene_costs(half, self._disparities, surface[rows], self._trust[rows],
                                        result[rows], 0, len(half))
        pool.each(measure_rows, range(0, len(costs), _TOGETHER))

    def cross(self, first, first_costs, second, second_costs, steps):
        """
        Give the first parent the second one's fitter regions, and their costs.

        first, second: float32 (R, C), px; first_costs, second_costs: float32 (R, C), see measure.
        steps: `Steps`, in parts of FULL. Returns what it saved, in parts of surface_cost.PARTS.
        """
        exchange, full = Exchange(*first.shape, 4), FULL >> _HALF
        steps = steps._replace(slope=steps.slope * full, jump=steps.jump * full)
        steps = Steps(*map(np.float32, steps))
        exchange.set_size(list_cells(abs(first - second) > steps.apart, exchange.all_cells))
        surface_cost.exchange_changes(
            first, first_costs, second, second_costs, self._weights, tuple(steps),
            exchange.changes())
        cost = Regions(*first.shape)(exchange)
        exchange.take(first, second)
        exchange.take(first_costs, second_costs)
        return -cost
