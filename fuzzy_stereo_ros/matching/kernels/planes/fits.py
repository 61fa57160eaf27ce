# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Planes fitted around pixels and to regions.

A plane (a, b, c) has the disparity a x + b y + c at (x, y). Maps of planes are float32 (r, 3, c):
a row has all its a, then all its b, then all its c, so that loops over cells work with vectors.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import below, mixed
import numpy as np

# Of a region: random planes tried; px by which pixels agree
PLANES_TRIED, AGREEMENT = 60, np.float32(0.7)
BINS = 4             # of the weighted median, a pixel
_SAMPLES = 150       # pixels of a region, about, on which a plane is tried
LEAST_POINTS = 6     # points that a plane is fitted to
_FLATTEST = 4        # px^2, twice the area of three pixels that give a plane
_STEEPEST = 2.0      # px a px


@inlined
def plane_at(planes, row, column):
    """Return the plane of a cell of a map."""
    return planes[row, 0, column], planes[row, 1, column], planes[row, 2, column]


@inlined
def disparity_at(plane, x, y):
    """Return the disparity of a plane at a place."""
    return plane[0] * np.float32(x) + plane[1] * np.float32(y) + plane[2]


@kernel
def disparities_of(planes, highest, disparities, first, last):
    """Write the disparities of a map of planes, within 0 to highest: float32 (r, c), px."""
    for row in range(first, last):
        for column in range(disparities.shape[1]):
            disparity = disparity_at(plane_at(planes, row, column), column, row)
            disparities[row, column] = min(max(disparity, np.float32(0)), highest)


@inlined
def solve(sums, damping):
    """
    Return slopes and offset of least squares, 0 where they are not determined.

    sums: see sums_around; damping: added to those of the squares
    """
    number, x, y, xx, xy, yy, d, xd, yd = sums
    xx, yy = xx + damping, yy + damping
    number, x, y, xx, xy, yy = (np.float64(number), np.float64(x), np.float64(y), np.float64(xx),
                                np.float64(xy), np.float64(yy))
    d, xd, yd = np.float64(d), np.float64(xd), np.float64(yd)
    one, two, three = yy * number - y * y, xy * number - y * x, xy * y - yy * x
    determinant = xx * one - xy * two + x * three
    if not determinant > 1e-6:
        return 0.0, 0.0, 0.0
    slope = (xd * one - xy * (yd * number - y * d) + x * (yd * y - yy * d)) / determinant
    fall = (xx * (yd * number - y * d) - xd * two + x * (xy * d - yd * x)) / determinant
    offset = (xx * (yy * d - yd * y) - xy * (xy * d - yd * x) + xd * three) / determinant
    return slope, fall, offset


@inlined
def random_plane(points, first, number, key, count):
    """
    Return (is it one, slope, fall, offset) of the plane through three of `number` points.

    points: float32 (3, N), x, y and disparity, of which those from `first` on count; random
    numbers `count` to `count + 2` of a key choose the three
    """
    one = first + below(mixed(key, count), np.uint64(number))
    two = first + below(mixed(key, count + np.uint64(1)), np.uint64(number))
    three = first + below(mixed(key, count + np.uint64(2)), np.uint64(number))
    x, y, d = points[0, one], points[1, one], points[2, one]
    x2, y2, d2 = points[0, two] - x, points[1, two] - y, points[2, two] - d
    x3, y3, d3 = points[0, three] - x, points[1, three] - y, points[2, three] - d
    area = x2 * y3 - x3 * y2
    if abs(area) < _FLATTEST:
        return False, np.float32(0), np.float32(0), np.float32(0)
    a, b = (d2 * y3 - d3 * y2) / area, (x2 * d3 - x3 * d2) / area
    return abs(a) <= _STEEPEST and abs(b) <= _STEEPEST, a, b, d - a * x - b * y


@inlined
def agreeing(points, first, last, stride, plane, limit):
    """Return how many of the points, every stride-th, lie within a limit of a plane."""
    number = 0
    for place in range(first, last, stride):
        number += abs(disparity_at(plane, points[0, place], points[1, place])
                      - points[2, place]) < limit
    return number


@inlined
def best_of_random(points, first, last, stride, random, count, plane):
    """
    Return how many points agree with the best of a plane and random ones, and the best one.

    Fischler and Bolles, Random sample consensus, 1981.

    points, first, last, stride: of agreeing; random: how many are tried at most, the share of the
    points whose agreement ends that, and the key; count: number of the first random number of it;
    plane: slope, fall and offset, NaN for none
    """
    (rounds, enough, key), (slope, fall, offset) = random, plane
    most = agreeing(points, first, last, stride, plane, AGREEMENT)
    for attempt in range(rounds):
        is_plane, a, b, c = random_plane(
            points, first, last - first, key, count + np.uint64(3 * attempt))
        number = agreeing(points, first, last, stride, (a, b, c), AGREEMENT) if is_plane else 0
        if number > most:
            most, slope, fall, offset = number, a, b, c
            if most >= enough * (last - first):
                break
    return most, (slope, fall, offset)


@inlined
def least_squares(points, first, last, plane, limit, origin):
    """
    Return the number of points within a limit of a plane, and their plane of least squares.

    origin: a point among them, from which they are measured
    """
    x0, y0, d0 = origin
    s = sx = sy = sxx = sxy = syy = sd = sxd = syd = 0.0
    for place in range(first, last):
        x, y, d = points[0, place], points[1, place], points[2, place]
        if abs(disparity_at(plane, x, y) - d) < limit:
            right, down, more = np.float64(x) - x0, np.float64(y) - y0, np.float64(d) - d0
            s += 1
            sx += right
            sy += down
            sxx += right * right
            sxy += right * down
            syy += down * down
            sd += more
            sxd += right * more
            syd += down * more
    a, b, c = solve((s, sx, sy, sxx, sxy, syy, sd, sxd, syd), 1)
    return s, a, b, c + d0 - a * x0 - b * y0


@inlined
def colours_apart(colours, row, column, other_row, other_column):
    """Return the sum over the channels of the differences of two pixels."""
    total = 0
    for channel in range(3):
        total += abs(np.int32(colours[row, column, channel])
                     - np.int32(colours[other_row, other_column, channel]))
    return total


@kernel(allocates=True)
def weighted_median(disparities, selected, colours, by_colour, by_distance, result, first, last):
    """
    Give the selected pixels the median around them, weighted by colour and distance.

    by_colour: float32 (766,), weights by the sum of differences of the channels; by_distance:
    float32, by rows or columns from the first one around a pixel on; result: as disparities
    """
    (rows, columns), radius = disparities.shape, by_distance.size // 2
    histogram = np.zeros(BINS * np.int64(disparities.max() + 2), np.float32)
    for row in range(first, last):
        for column in range(columns):
            result[row, column] = disparities[row, column]
            if not selected[row, column]:
                continue
            place, total = histogram.size, np.float32(0)
            histogram[:] = 0
            for y in range(max(row - radius, 0), min(row + radius + 1, rows)):
                for x in range(max(column - radius, 0), min(column + radius + 1, columns)):
                    weight = (by_colour[colours_apart(colours, row, column, y, x)]
                              * by_distance[y - row + radius] * by_distance[x - column + radius])
                    value = np.int64(disparities[y, x] * BINS + np.float32(0.5))
                    histogram[value] += weight
                    total += weight
                    place = min(place, value)
            share = histogram[place]
            while 2 * share < total:
                place += 1
                share += histogram[place]
            result[row, column] = np.float32(place) / BINS


@inlined
def sums_around(disparities, colours, row, column, neighbours):
    """
    Return the sums of least squares of the plane around a pixel, relative to it: float32.

    Of the weights, of right, down, their squares and product, disparity, and right and down times
    disparity. neighbours: the pixels that a plane is fitted to: their radius; by_colour, see
    weighted_median; px that they may differ by, float32, and by which share of that more a pixel
    of distance
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
def local_planes(disparities, colours, neighbours, planes, first, last):
    """Write the plane fitted to the similar neighbours of each pixel, with damped slopes."""
    for row in range(first, last):
        for column in range(disparities.shape[1]):
            centre = disparities[row, column]
            sums = sums_around(disparities, colours, row, column, neighbours)
            slope, fall, offset = solve(sums, np.float32(0.5) * sums[0])
            planes[row, 0, column], planes[row, 1, column] = slope, fall
            planes[row, 2, column] = centre + offset - slope * column - fall * row


@kernel
def smooth(disparities, colours, neighbours, result, first, last):
    """Write the disparity of the plane fitted to the similar neighbours of each pixel."""
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


@called
def _points_of(flat, known, begin, end, pixels, columns, points):
    """Write x, y and disparity of a region's trusted pixels, or of all if few are trusted."""
    for few in range(2):
        number = 0
        for place in range(begin, end):
            pixel = pixels[place]
            if known[pixel] or few:
                points[0, number] = pixel % columns
                points[1, number] = pixel // columns
                points[2, number] = flat[pixel]
                number += 1
        if number >= LEAST_POINTS:
            break
    return number


@kernel(allocates=True)
def region_planes(disparities, trusted, regions, key, planes, first, last):
    """
    Fit a plane to each region: the best of random ones, then least squares of its inliers.

    Of regions with few trusted pixels all count. regions: starts and pixels of `Regions` of
    quality/planes.py; planes: float32 (regions, 3); first, last: regions
    """
    starts, pixels = regions
    random = PLANES_TRIED, 1.0, key
    columns = disparities.shape[1]
    flat, known = disparities.reshape(-1), trusted.reshape(-1)
    largest = 0
    for region in range(first, last):
        largest = max(largest, starts[region + 1] - starts[region])
    points = np.empty((3, largest), np.float32)
    for region in range(first, last):
        number = _points_of(flat, known, starts[region], starts[region + 1], pixels, columns,
                            points)
        x, y, d = (points[0, :number].mean(), points[1, :number].mean(),
                   points[2, :number].mean())
        plane = np.float32(0), np.float32(0), np.float32(d)
        if number >= LEAST_POINTS:
            _, plane = best_of_random(points, 0, number, max(1, number // _SAMPLES), random,
                                      np.uint64(3 * (region * PLANES_TRIED + 1)), plane)
        inliers, a, b, c = least_squares(points, 0, number, plane, np.float32(1.5) * AGREEMENT,
                                         (x, y, d))
        planes[region, 0], planes[region, 1], planes[region, 2] = plane
        if inliers >= LEAST_POINTS:
            planes[region, 0], planes[region, 1], planes[region, 2] = a, b, c
