# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Sub-pixel maps: a median weighted by colour for unknown pixels, and planes fitted around pixels.

Not in the paper, whose maps are whole-pixel.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
import numpy as np

BINS = 4             # of the weighted median, a pixel


class MedianWeights(NamedTuple):
    """The weights of the pixels around one."""

    radius: int
    by_colour: np.ndarray    # float32 (766,), by the sum of differences of the channels
    by_distance: np.ndarray  # float32 (2 * radius + 1,), by rows or columns


class Neighbours(NamedTuple):
    """The pixels around one that a plane is fitted to."""

    radius: int
    by_colour: np.ndarray    # float32 (766,), their weights, as of MedianWeights
    limit: np.float32        # px that they may differ by
    growth: np.float32       # of the limit: by this share of it a pixel of distance


@inlined
def colours_apart(colours, row, column, other_row, other_column):
    """Return the sum over the channels of the differences of two pixels."""
    total = 0
    for channel in range(3):
        total += abs(np.int32(colours[row, column, channel])
                     - np.int32(colours[other_row, other_column, channel]))
    return total


@kernel
def weighted_median(disparities, selected, colours, weights, histogram, result, first, last):
    """
    Give the selected pixels the median around them, weighted by colour and distance.

    disparities, result: float32 (R, C), px; selected: uint8 (R, C); weights: the fields of
    MedianWeights; histogram: float32, BINS a pixel and one more, working memory.
    """
    radius, by_colour, by_distance = weights
    rows, columns = disparities.shape
    for row in range(first, last):
        for column in range(columns):
            result[row, column] = disparities[row, column]
            if selected[row, column] == 0:
                continue
            lowest, highest, total = histogram.size, 0, np.float32(0)
            histogram[:] = 0
            for y in range(max(row - radius, 0), min(row + radius + 1, rows)):
                for x in range(max(column - radius, 0), min(column + radius + 1, columns)):
                    weight = (by_colour[colours_apart(colours, row, column, y, x)]
                              * by_distance[y - row + radius] * by_distance[x - column + radius])
                    place = np.int64(disparities[y, x] * BINS + np.float32(0.5))
                    histogram[place] += weight
                    total += weight
                    lowest, highest = min(lowest, place), max(highest, place)
            share = np.float32(0)
            for place in range(lowest, highest + 1):
                share += histogram[place]
                if 2 * share >= total:
                    result[row, column] = np.float32(place) / BINS
                    break


@inlined
def sums_around(disparities, colours, row, column, neighbours):
    """
    Return the sums of least squares of the plane around a pixel, relative to it: float32.

    Of the weights, of right, down, their squares and product, disparity, and right and down times
    disparity; neighbours: the fields of Neighbours
    """
    radius, by_colour, limit, growth = neighbours
    rows, columns = disparities.shape
    centre = disparities[row, column]
    s = sx = sy = sxx = sxy = syy = sd = sxd = syd = np.float32(0)
    for y in range(max(row - radius, 0), min(row + radius + 1, rows)):
        for x in range(max(column - radius, 0), min(column + radius + 1, columns)):
            difference = disparities[y, x] - centre
            across, along = np.float32(x - column), np.float32(y - row)
            distance = max(abs(across), abs(along))
            if abs(difference) > limit * (np.float32(1) + growth * distance):
                continue
            weight = by_colour[colours_apart(colours, row, column, y, x)]
            s += weight
            sx += weight * across
            sy += weight * along
            sxx += weight * across * across
            sxy += weight * across * along
            syy += weight * along * along
            sd += weight * difference
            sxd += weight * across * difference
            syd += weight * along * difference
    return s, sx, sy, sxx, sxy, syy, sd, sxd, syd


@kernel
def local_planes(disparities, colours, neighbours, result, first, last):
    """
    Replace each disparity by that of the plane fitted to the like neighbours around it.

    disparities, result: float32 (R, C), px; neighbours: the fields of Neighbours
    """
    for row in range(first, last):
        for column in range(disparities.shape[1]):
            centre = disparities[row, column]
            s, sx, sy, sxx, sxy, syy, sd, sxd, syd = sums_around(
                disparities, colours, row, column, neighbours)
            sxx += np.float32(1)
            syy += np.float32(1)
            a, b, c = sxx * syy - sxy * sxy, sx * syy - sxy * sy, sx * sxy - sxx * sy
            determinant = s * a - sx * b + sy * c
            offset = np.float32(0)
            if determinant > np.float32(1e-6):
                offset = (sd * a - sx * (sxd * syy - sxy * syd)
                          + sy * (sxd * sxy - sxx * syd)) / determinant
            result[row, column] = centre + min(max(offset, np.float32(-1)), np.float32(1))
