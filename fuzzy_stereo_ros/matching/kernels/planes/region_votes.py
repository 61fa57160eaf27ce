# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The evidence of the cells of plain regions, summed, and the planes that it supports.

The evidence is a curve over the disparities for each cell, see plain_regions.py. A sum over cells
is measured in its standard deviations if cells were independent, so that no estimate of noise is
needed. What is taken of it is decided in realtime/plain_regions.py.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import median
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.plain_regions import BANDS, COUNTED
import numpy as np

TILTED = 2.0         # deviations that a slant must gain
TILTS, MOST_TILTED = (2.0, 1.0, 0.5, 0.25), 6.0  # px at the border of a region: at a time, in all
GAIN = 0.05          # deviations that a step must gain


@inlined
def _interpolated(curves, place, disparity):
    """Return a curve of a cell at a disparity."""
    highest = curves.shape[1] - 1
    disparity = min(max(disparity, 0.0), highest - 0.001)
    label = np.int64(disparity)
    share = disparity - label
    return (1 - share) * curves[place, label] + share * curves[place, label + 1]


@inlined
def _around(values, places, row, column):
    """Return the sum over the 3 x 3 cells of a region around one."""
    total = 0.0
    for y in range(max(row - 1, 0), min(row + 2, places.shape[0])):
        for x in range(max(column - 1, 0), min(column + 2, places.shape[1])):
            if places[y, x] >= 0:
                total += values[places[y, x]]
    return total


@called(allocates=True)
def spread_around(values, places, result):
    """Write the sums over the 3 x 3 cells of a region around each: float64 (cells,)."""
    for row in range(places.shape[0]):
        for column in range(places.shape[1]):
            if places[row, column] >= 0:
                result[places[row, column]] = _around(values, places, row, column)


@kernel
def sum_groups(votes, places, totals, seen, squares):
    """
    Sum the cells of each region by columns of cells, in as many groups as `totals` has, in turn.

    votes: the fields of Votes; places: of number_cells; totals: int32 (regions, groups, BANDS,
    labels), seen: int32 (regions, labels), squares: int64 (regions, groups, BANDS), of the sums of
    single cells, all 0 at first
    """
    curves, counts, _ = votes
    groups, labels = totals.shape[1], totals.shape[3]
    for region in range(len(totals)):
        for row in range(places.shape[1]):
            for column in range(places.shape[2]):
                place = places[region, row, column]
                if place < 0:
                    continue
                mine, count = column % groups, counts[place]
                for label in range(labels):
                    seen[region, label] += np.int32(COUNTED) * count[label]
                for band in range(BANDS):
                    target, curve, square = totals[region, mine, band], curves[place, band], 0
                    for label in range(labels):
                        target[label] += curve[label]
                        square += np.int64(np.int32(curve[label]) * np.int32(curve[label]))
                    squares[region, mine, band] += square


@kernel(allocates=True)
def elect_by_halves(groups, filled, allowed, best, near, shares):
    """
    Let the halves of regions elect labels; write how many elect that of the region.

    The groups of a region are split into halves in as many ways as a Hadamard matrix has other
    rows. Splits with an empty half do not count. groups: float64 (regions, groups, labels), the
    evidence; filled: bool (regions, groups); allowed: bool (regions, labels); best: int64
    (regions,); near: labels by which a choice may differ; shares: float64 (regions, 2), written:
    of halves that agree, and of splits both of whose halves do
    """
    number, labels = groups.shape[1:]
    sums = np.empty((number, labels + 1))
    for region in range(len(groups)):
        sums[:, :labels], sums[:, labels] = groups[region], filled[region]
        apart = 1
        while apart < number:
            for group in range(number):
                if not group & apart:
                    first, second = sums[group], sums[group + apart]
                    for label in range(labels + 1):
                        total, difference = (first[label] + second[label],
                                             first[label] - second[label])
                        first[label], second[label] = total, difference
            apart *= 2
        splits, shares[region] = 0, 0
        for split in range(1, number):
            if abs(sums[split, labels]) == sums[0, labels]:
                continue
            agree = 0
            for sign in (1.0, -1.0):
                most, choice = -np.inf, -np.inf
                for label in range(labels):
                    half = sums[0, label] + sign * sums[split, label]
                    if allowed[region, label] and half > most:
                        most, choice = half, label
                agree += abs(choice - best[region]) <= near
            splits += 1
            shares[region, 0] += agree / 2
            shares[region, 1] += agree == 2
        shares[region] /= max(splits, 1)


@called(allocates=True)
def centres(cells, right, down):
    """Write where the cells of a region lie, -1 to 1; return its centre and half its sides."""
    x = y = pixels = 0.0
    for place in range(right.size):
        number, columns, rows = cells[place, :3]
        x, y, pixels = x + columns, y + rows, pixels + number
        right[place], down[place] = columns / number, rows / number
    x, y = x / pixels, y / pixels
    left, top, last, bottom = right[0], down[0], right[0], down[0]
    for place in range(right.size):
        left, last = min(left, right[place]), max(last, right[place])
        top, bottom = min(top, down[place]), max(bottom, down[place])
    wide, high = max((last - left) / 2, 1.0), max((bottom - top) / 2, 1.0)
    for place in range(right.size):
        right[place], down[place] = (right[place] - x) / wide, (down[place] - y) / high
    return x, y, wide, high


@called(allocates=True)
def evidence_of_map(cells, places, nearest, weighted, seen, found):
    """
    Return the evidence for a map, in deviations from none; write the part of each cell.

    The map is smoothed: each cell has the mean of the labels around it. found: float64 (cells,)
    """
    total = number = 0.0
    for row in range(places.shape[0]):
        for column in range(places.shape[1]):
            if places[row, column] >= 0:
                place = places[row, column]
                label = 2 * (_around(cells[:, 3], places, row, column)
                             / _around(cells[:, 0], places, row, column))
                number += _interpolated(seen, place, label)
                found[place] = 0
                if label >= nearest - 0.5:
                    found[place] = _interpolated(weighted, place, label)
                total += found[place]
    return total / np.sqrt(max(number, 1.0))


@called(allocates=True)
def evidence_of_plane(weighted, seen, right, down, plane, found):
    """Return the evidence for a plane, in deviations from none; write the part of each cell."""
    total = number = 0.0
    for place in range(right.size):
        disparity = plane[0] + plane[1] * right[place] + plane[2] * down[place]
        found[place] = _interpolated(weighted, place, disparity)
        total += found[place]
        number += _interpolated(seen, place, disparity)
    return total / np.sqrt(max(number, 1.0))


@inlined
def _changed(plane, part, step):
    """Return a plane, one of whose numbers is changed by a step."""
    return (plane[0] + (step if part == 0 else 0.0), plane[1] + (step if part == 1 else 0.0),
            plane[2] + (step if part == 2 else 0.0))


@called(allocates=True)
def climb(weighted, seen, right, down, disparity, found):
    """
    Tilt a flat plane to where it has the most evidence, if it gains much.

    Returns its deviations from no evidence, and the plane: the disparity at the centre, and by how
    much it changes to the border, right and down. The part of each cell is written.
    """
    flat = best = disparity, 0.0, 0.0
    evidence = level = evidence_of_plane(weighted, seen, right, down, flat, found)
    for step in TILTS:
        better = True
        while better:
            better = False
            for way in range(6):
                plane = _changed(best, way // 2, step if way % 2 else -step)
                if max(abs(plane[1]), abs(plane[2])) <= MOST_TILTED:
                    new = evidence_of_plane(weighted, seen, right, down, plane, found)
                    if new > evidence + GAIN:
                        best, evidence, better = plane, new, True
    best = best if evidence >= level + TILTED else flat
    return evidence_of_plane(weighted, seen, right, down, best, found), best


@called(allocates=True)
def by_chance(weighted, places, others):
    """Return the median evidence of 3 x 3 cells at some wrong disparities, in deviations."""
    number = len(weighted)
    around, found = np.zeros(number), np.zeros(max(others.size, 1))
    for sample in range(others.size):
        spread_around(weighted[:, others[sample]], places, around)
        mean = square = 0.0
        for place in range(number):
            mean += around[place]
        mean /= number
        for place in range(number):
            square += (around[place] - mean)**2
        found[sample] = np.sqrt(square / number)
    return median(found, others.size) + 1e-6


@kernel(allocates=True)
def compare(weighted, seen, cells, places, nearest, disparity, others, lead):
    """
    Tilt the plane of a region to where it has the most evidence, and compare it with the map.

    Returns the evidence for the plane and for the map, in deviations; how decisive 3 x 3 cells
    are: the mean evidence of the plane there, in those of wrong disparities; and the plane, of
    half-size x and y and full disparity.
    weighted, seen: float64 (cells, labels), the curves in deviations, and counts; cells: of Votes;
    places: int32 (cell rows, cell columns), numbers of the region's cells, below 0 for none;
    nearest: the label from which on there is evidence; disparity: with the most of it; others:
    int64, wrong disparities; lead: float64 (cells,), written, by how much the evidence for the
    plane in 3 x 3 cells exceeds that of the map, in those of wrong disparities
    """
    number = len(weighted)
    right, down, of_map, of_plane = (np.zeros(number), np.zeros(number), np.zeros(number),
                                     np.zeros(number))
    x, y, wide, high = centres(cells, right, down)
    evidence, (level, slope, fall) = climb(weighted, seen, right, down, disparity, of_plane)
    known = evidence_of_map(cells, places, nearest, weighted, seen, of_map)
    slope, fall = slope / wide, fall / high
    usual = by_chance(weighted, places, others)
    spread_around(of_plane, places, lead)
    total = pixels = 0.0
    for place in range(number):
        total += lead[place] * cells[place, 0]
        pixels += cells[place, 0]
        of_plane[place] -= of_map[place]
    spread_around(of_plane, places, lead)
    for place in range(number):
        lead[place] /= usual
    return evidence, known, total / pixels / usual, (slope, fall, level - slope * x - fall * y)
