# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The plane that the evidence of a plain region supports, and whether the region takes it.

The evidence is a curve over the disparities for each cell, see plain_regions.py. A sum over cells
is measured in standard deviations of the evidence of the other disparities, so that no estimate of
noise is needed.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import median
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.plain_regions import BANDS, COUNTED, Votes
import numpy as np

APART = 3            # px from the best disparity; nearer ones count as the same
LOWEST = 6.5         # deviations that the best disparity must have
LEAD = 2.0           # deviations by which it must exceed the map
TILTED = 2.0         # deviations that a slant must gain
SECOND_BEST = 0.6    # share of its deviations that the second best disparity may reach
AGREE = 1            # px by which both halves of the region may differ from it
DECISIVE = 4.0       # mean deviations of the plane in 3 x 3 cells from which windows can match it
LENIENT = -2.5       # deviations by which the map may exceed the plane in cells that accept it
VISIBLE = 0.3        # least share of visible pixels, of the most that any disparity has
TILTS, MOST_TILTED = (2.0, 1.0, 0.5, 0.25), 6.0  # px at the border of a region: at a time, in all
SAMPLES = 8          # wrong disparities that show the evidence of a cell by chance
GAIN = 0.05          # deviations that a step must gain


class RegionCells(NamedTuple):
    """The cells of a region, from `start` to `stop` - 1."""

    places: np.ndarray   # int32 (cell rows, cell columns), numbers of cells, below 0 for none
    start: int
    stop: int


@inlined
def _score(totals, counts, valid, floors, scores, middles, spreads, deviations):
    """Write the deviations of each disparity, -9 where it is not valid; middle and spread."""
    labels = valid.size
    deviations[:] = 0
    for band in range(BANDS):
        number = 0
        for label in range(labels):
            if valid[label]:
                scores[number] = totals[band, label] / np.sqrt(float(max(counts[label], 1)))
                number += 1
        middle = median(scores, number)
        for place in range(number):
            scores[place] = abs(scores[place] - middle)
        spread = max(1.48 * median(scores, number), floors[band]) + 1e-6
        middles[band], spreads[band] = middle, spread
        for label in range(labels):
            deviations[label] += (
                totals[band, label] / np.sqrt(float(max(counts[label], 1))) - middle) / spread
    for label in range(labels):
        if not valid[label]:
            deviations[label] = -9


@inlined
def _best(deviations, nearest):
    """Return the label with the most evidence, from the label `nearest` on."""
    best = min(nearest, deviations.size - 1)
    for label in range(best, deviations.size):
        if deviations[label] > deviations[best]:
            best = label
    return best


@inlined
def _between(deviations, best):
    """Return the best disparity between whole px, by the parabola of the five around it."""
    if best < 2 or best > deviations.size - 3:
        return float(best)
    a, b, c, d, e = deviations[best - 2:best + 3]
    slope, bend = (2 * e + d - b - 2 * a) / 10, (2 * a - b - 2 * c - d + 2 * e) / 14
    return best + min(max(-slope / (2 * min(bend, -1e-9)), -0.75), 0.75)


@inlined
def _interpolated(curves, place, disparity):
    """Return a curve of a cell at a disparity."""
    highest = curves.shape[1] - 1
    disparity = min(max(disparity, 0.0), highest - 0.001)
    label = np.int64(disparity)
    share = disparity - label
    return (1 - share) * curves[place, label] + share * curves[place, label + 1]


@inlined
def _around(values, places, start, row, column):
    """Return the sum over the 3 x 3 cells of a region around one."""
    total = 0.0
    for y in range(max(row - 1, 0), min(row + 2, places.shape[0])):
        for x in range(max(column - 1, 0), min(column + 2, places.shape[1])):
            if places[y, x] >= 0:
                total += values[places[y, x] - start]
    return total


@called(allocates=True)
def spread_around(values, places, start, result):
    """Write the sums over the 3 x 3 cells of a region around each: float64 (cells,)."""
    for row in range(places.shape[0]):
        for column in range(places.shape[1]):
            if places[row, column] >= 0:
                result[places[row, column] - start] = _around(values, places, start, row, column)


@called(allocates=True)
def sum_cells(votes, places, power, totals, seen, floors):
    """
    Sum the cells of a region, all of them and each half, chequered.

    totals: int32 (3, BANDS, labels), seen: int32 (3, labels), 0 at first: the whole and both
    halves; floors: float64 (BANDS,), standard deviation of products of independent pixels
    """
    curves, counts, cells = votes
    labels, pixels = seen.shape[1], 0
    floors[:] = 0
    for row in range(places.shape[0]):
        for column in range(places.shape[1]):
            place = places[row, column]
            if place < 0:
                continue
            numbers, count = seen[1 + (row + column) % 2], counts[place]
            for label in range(labels):
                numbers[label] += np.int32(COUNTED) * count[label]
            pixels += cells[place, 0]
            for band in range(BANDS):
                floors[band] += cells[place, 4 + band]
                target, curve = totals[1 + (row + column) % 2, band], curves[place, band]
                for label in range(labels):
                    target[label] += curve[label]
    for label in range(labels):
        seen[0, label] = seen[1, label] + seen[2, label]
    for band in range(BANDS):
        for label in range(labels):
            totals[0, band, label] = totals[1, band, label] + totals[2, band, label]
        floors[band] = np.sqrt(floors[band] / (2 * pixels) * power[band])


@called(allocates=True)
def weigh(curves, counts, start, spreads, weighted, seen):
    """Write the curves of cells, in deviations of the region, and counts: float64 (cells, d)."""
    for place in range(len(seen)):
        for label in range(seen.shape[1]):
            seen[place, label] = COUNTED * counts[start + place, label]
            weighted[place, label] = 0
            for band in range(BANDS):
                weighted[place, label] += curves[start + place, band, label] / spreads[band]


@called(allocates=True)
def centres(cells, start, right, down):
    """Write where the cells of a region lie, -1 to 1; return its centre and half its sides."""
    x = y = pixels = 0.0
    for place in range(right.size):
        number, columns, rows = cells[start + place, :3]
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
def evidence_of_map(cells, places, start, nearest, weighted, seen, found):
    """
    Return the evidence for a map, in deviations from none; write the part of each cell.

    The map is smoothed: each cell has the mean of the labels around it. found: float64 (cells,)
    """
    total = number = 0.0
    for row in range(places.shape[0]):
        for column in range(places.shape[1]):
            if places[row, column] >= 0:
                place = places[row, column] - start
                label = 2 * (_around(cells[start:, 3], places, start, row, column)
                             / _around(cells[start:, 0], places, start, row, column))
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
def by_chance(weighted, valid, places, start, nearest, best):
    """Return the median evidence of 3 x 3 cells at some wrong disparities, in deviations."""
    labels, number = valid.size, len(weighted)
    around, found, samples = np.zeros(number), np.zeros(labels), 0
    for label in range(nearest, labels, max(labels // SAMPLES, 1)):
        if valid[label] and abs(label - best) > APART:
            spread_around(weighted[:, label], places, start, around)
            mean = square = 0.0
            for place in range(number):
                mean += around[place]
            mean /= number
            for place in range(number):
                square += (around[place] - mean)**2
            found[samples] = np.sqrt(square / number)
            samples += 1
    return median(found, samples) + 1e-6


@kernel(allocates=True)
def judge(votes, region, disparities, nearest, power, plane, figures, accepted):
    """
    Write the plane with the most evidence in a region; return whether the region takes it.

    votes: the fields of Votes; region: those of RegionCells; nearest: label from which on there
    is evidence; power: float64 (BANDS,), mean square of the other view; plane: float64 (3,), of
    half-size x and y and full disparity, NaN where none is taken; figures: float64 (5,):
    deviations of the best disparity, of the second best, difference of the halves in px,
    deviations of the map, and mean deviations of the plane in 3 x 3 cells; accepted: uint8
    (cells,), where the plane is taken
    """
    votes, (places, start, stop) = Votes(*votes), region
    curves, counts, cells = votes
    number, labels = stop - start, disparities
    plane[:], figures[:] = np.nan, 0
    totals = np.zeros((3, BANDS, labels), np.int32)
    seen_by, floors = np.zeros((3, labels), np.int32), np.zeros(BANDS)
    sum_cells(votes, places, power, totals, seen_by, floors)
    valid, most = np.zeros(labels, np.bool_), 0
    for label in range(labels):
        most = max(most, seen_by[0, label])
    for label in range(labels):
        valid[label] = seen_by[0, label] > VISIBLE * most
    if not most:
        return False
    scores, deviations, bests = np.zeros(labels), np.zeros(labels), np.zeros(3, np.int64)
    middles, spreads = np.zeros(BANDS), np.zeros(BANDS)
    for part in (2, 1, 0):      # the whole last: its deviations stay
        _score(totals[part], seen_by[part], valid, floors, scores, middles, spreads, deviations)
        bests[part] = _best(deviations, nearest)
    best, second, others = bests[0], -9.0, 0
    for label in range(nearest, labels):
        if valid[label] and abs(label - best) > APART:
            second, others = max(second, deviations[label]), others + 1
    figures[0], figures[1] = deviations[best], second
    figures[2] = max(abs(bests[1] - best), abs(bests[2] - best))
    if (others <= APART or deviations[best] < LOWEST or second > SECOND_BEST * deviations[best]
            or figures[2] > AGREE):
        return False

    weighted, seen = np.zeros((number, labels)), np.zeros((number, labels))
    right, down, of_map, of_plane, around = (np.zeros(number), np.zeros(number), np.zeros(number),
                                             np.zeros(number), np.zeros(number))
    weigh(curves, counts, start, spreads, weighted, seen)
    x, y, wide, high = centres(cells, start, right, down)
    middle = 0.0
    for band in range(BANDS):
        middle += middles[band] / spreads[band]
    evidence, (level, slope, fall) = climb(weighted, seen, right, down,
                                           _between(deviations, best), of_plane)
    figures[0] = evidence - middle
    figures[3] = evidence_of_map(
        cells, places, start, nearest, weighted, seen, of_map) - middle
    if figures[0] < figures[3] + LEAD:
        return False

    spread_around(of_plane, places, start, around)
    usual = by_chance(weighted, valid, places, start, nearest, best)
    total = pixels = 0.0
    for place in range(number):
        total += around[place] * cells[start + place, 0]
        pixels += cells[start + place, 0]
    figures[4] = total / pixels / usual
    if figures[4] >= DECISIVE:
        return False
    limit = max(figures[4] - DECISIVE, LENIENT) * usual
    for place in range(number):
        of_plane[place] -= of_map[place]
    spread_around(of_plane, places, start, around)
    for place in range(number):
        accepted[start + place] = around[place] > limit
    plane[0], plane[1] = slope / wide, fall / high
    plane[2] = level - plane[0] * x - plane[1] * y
    return True
