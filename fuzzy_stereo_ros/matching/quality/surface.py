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
from fuzzy_stereo_ros.matching.kernels.planes import fits
from fuzzy_stereo_ros.matching.kernels.refinement import consistency, filling
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.quality.planes import LIMIT, neighbours, PLANE_RADIUS
import numpy as np

# Of medians, by the difference of colours summed over channels, and by rows or columns from -9 on.
MEDIAN_WEIGHTS = tuple(np.exp(-power).astype(np.float32) for power in (
    np.arange(766) / 20.0, np.arange(-9, 10)**2 / (2 * 9.0**2)))
_HALF = 1                # genes are measured in 8 bits: costs divided by 2**_HALF
_TOGETHER = 16           # rows that are divided at a time


def consistency_of(pool, labels, target, disparities, target_range):
    """Return the validity of labels, int16 (R, C), by the target; target_range: its columns."""
    validity = np.empty(labels.shape, np.uint8)
    pool.each(lambda band: consistency.check_consistency(
        labels, target, disparities, target_range, validity, *band[1:]), cut_bands(len(labels)))
    return validity


def dense(pool, fitted, validity, colour):
    """Return a map, float32 (R, C), whose rejected pixels get the background's, then medians."""
    filled, median = np.empty_like(fitted), np.empty_like(fitted)
    rejected, bands = validity == INVALID, cut_bands(len(fitted))
    pool.each(lambda band: filling.fill_rows(fitted, validity, filled, *band[1:]), bands)
    pool.each(lambda band: fits.weighted_median(
        filled, rejected, colour, *MEDIAN_WEIGHTS, median, *band[1:]), bands)
    return cv2.medianBlur(median, 5)


def smooth(pool, surface, colour, labels, radius=PLANE_RADIUS, limit=LIMIT):
    """Return a map as the planes around its pixels say: float32 (R, C), px, up to labels - 1."""
    result, around = np.empty_like(surface), neighbours(radius, limit)
    pool.each(lambda band: fits.smooth(
        surface, colour, around, result, *band[1:]), cut_bands(len(surface)))
    return np.clip(result, 0, labels - 1, out=result)


def measure(pool, costs, first, disparities, trust, maps, results):
    """
    Write the costs of the genes of maps in some rows, in halves of the costs' unit.

    costs: uint16 (rows, C, labels), 0 to FULL, from row `first` of the frame on; disparities: how
    many labels exist; trust, maps, results: float32 (R, C)
    """
    def measure_rows(begin):
        # Half of FULL becomes 0 in a byte: a fully impossible match is no evidence.
        half = (costs[begin:begin + _TOGETHER] >> _HALF).astype(np.uint8)
        rows = slice(first + begin, first + begin + len(half))
        for surface, result in zip(maps, results):
            surface_cost.gene_costs(half, disparities, surface[rows], trust[rows], result[rows],
                                    0, len(half))
    pool.each(measure_rows, range(0, len(costs), _TOGETHER))


def cross(first, first_costs, second, second_costs, weights):
    """
    Give the first parent the second one's fitter regions, and their costs.

    first, second: float32 (R, C), px; first_costs, second_costs: float32 (R, C), see measure;
    weights: float32 (2, R, C), of steps to the left and up. Returns what it saved, in parts of
    surface_cost.COST_PARTS.
    """
    exchange = Exchange(*first.shape, 4)
    exchange.set_cells(abs(first - second) > surface_cost.APART)
    surface_cost.exchange_changes(
        first, first_costs, second, second_costs, weights, exchange.changes())
    cost = Regions(*first.shape)(exchange)
    exchange.take(first, second)
    exchange.take(first_costs, second_costs)
    return -cost
