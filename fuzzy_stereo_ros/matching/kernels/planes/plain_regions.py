# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Evidence of plain regions for disparities, and the planes that it supports.

The products of the texture of both views, see plain_texture.py, are summed in cells of 8 rows and
16 columns, for every disparity: a curve for each cell. Sums over cells are measured in standard
deviations as if cells were independent, so that no estimate of noise is needed. What is taken of
them is decided in realtime/plain_regions.py.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import of_rank
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.plain_texture import BANDS, COUNTED
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.units import INVALID, VOTED
import numpy as np

CELL_ROWS, CELL_COLUMNS = 8, 16  # rows (of the picture: every other one) and columns of a cell
HALF = CELL_COLUMNS // 2      # half-size columns of a cell
TILTED = 2.0         # deviations that a slant must gain
TILTS, MOST_TILTED = (2.0, 1.0, 0.5, 0.25), 6.0  # px at the border of a region: at a time, in all
GAIN = 0.05          # deviations that a step must gain


class Votes(NamedTuple):
    """The evidence of the cells of regions."""

    curves: np.ndarray       # int16 (cells, BANDS, labels), sums of products
    counts: np.ndarray       # int16 (cells, labels), candidates that are seen, in COUNTED-th rows
    cells: np.ndarray        # int32 (cells, 5): number of half-size pixels, sums of their columns,
    #                          rows and labels, and how many of these are inconsistent


@kernel
def number_cells(regions, places, starts):
    """
    Count the cells that each region reaches into, and number them; return how many there are.

    Returns the number of pieces too: a piece is what of a run lies in one cell. places: int32
    (regions, cell rows, cell columns), the number of each cell, -1 where the region is not;
    starts: int32 (regions + 1,)
    """
    runs, rows = regions
    begin, end, region = runs[0], runs[1], runs[3]
    places[:] = -1
    number = pieces = 0
    for row in range(len(rows)):
        for run in range(rows[row, 0], rows[row, 1]):
            if region[run] >= 0:
                for cell in range(begin[run] // HALF, (end[run] - 1) // HALF + 1):
                    places[region[run], row // CELL_ROWS, cell] = 0
                    pieces += 1
    for mine in range(places.shape[0]):
        starts[mine] = number
        for row in range(places.shape[1]):
            for column in range(places.shape[2]):
                if places[mine, row, column] == 0:
                    places[mine, row, column] = number
                    number += 1
    starts[places.shape[0]] = number
    return number, pieces


@kernel
def list_pieces(regions, places, pieces, begins):
    """
    List the pieces of regions, row by row.

    pieces: int32 (n, 4), the number of the cell, row, first half-size column and the one after the
    last; begins: int64 (cell rows + 1,), the first one of each row of cells and the one
    behind all
    """
    runs, rows = regions
    begin, end, region = runs[0], runs[1], runs[3]
    number = 0
    for row in range(len(rows)):
        if row % CELL_ROWS == 0:
            begins[row // CELL_ROWS] = number
        for run in range(rows[row, 0], rows[row, 1]):
            if region[run] >= 0:
                for cell in range(begin[run] // HALF, (end[run] - 1) // HALF + 1):
                    pieces[number, 0] = places[region[run], row // CELL_ROWS, cell]
                    pieces[number, 1] = row
                    pieces[number, 2] = max(begin[run], cell * HALF)
                    pieces[number, 3] = min(end[run], (cell + 1) * HALF)
                    number += 1
    begins[places.shape[1]] = number


@kernel
def sum_cells(pieces, labels, validity, cells):
    """Sum what the half-size map, labels and validity (r, c), says in cells; cells: of Votes."""
    for place, row, first, last in pieces:
        cell = cells[place]
        for pixel in range(first, last):
            cell[0] += 1
            cell[1] += pixel
            cell[2] += row
            cell[3] += labels[row, pixel]
            cell[4] += validity[row, pixel] == INVALID


@kernel
def write_planes(pieces, planes, sure, half_labels, half_highest, prior, highest, certainty):
    """
    Write planes into a half-size map, (r, c), and the prior of the full search, and a certainty.

    planes: float64 (cells, 3), of half-size x and y and full disparity, NaN where none is taken;
    sure: uint8 (cells,), written to certainty, uint8 (R, C); prior: labels and weights, (R, C);
    half_highest, highest: the last labels of both
    """
    labels, weights = prior
    for piece in range(len(pieces)):
        row, first, last = (np.int64(pieces[piece, 1]), np.int64(pieces[piece, 2]),
                            np.int64(pieces[piece, 3]))
        certainty[2 * row:2 * row + 2, 2 * first:2 * last] = sure[pieces[piece, 0]]
        slope, fall, offset = planes[pieces[piece, 0]]
        if np.isnan(slope):
            continue
        step = np.int64(slope * 2**15)      # a full pixel, in 1 / 2**16
        for lower in range(2):
            label = np.int64(2**16 * (
                slope * (first - 0.25) + fall * (row + 0.5 * lower - 0.25) + offset + 0.5))
            line, flags = labels[2 * row + lower], weights[2 * row + lower]
            for column in range(2 * first, 2 * last):
                line[column] = min(max(label >> 16, 0), highest)
                flags[column] = VOTED
                label += step
        label = np.int64(2**15 * (slope * first + fall * row + offset + 1))
        for column in range(first, last):
            half_labels[row, column] = min(max(label >> 16, 0), half_highest)
            label += step


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

    totals: int32 (regions, groups, BANDS, labels), seen: int32 (regions, labels), squares: int64
    (regions, groups, BANDS), of the sums of single cells, all 0 at first
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
        for group in range(number):
            copy_row(groups[region, group], sums[group, :labels])
            sums[group, labels] = filled[region, group]
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
        splits, agreed, both = 0, 0.0, 0.0
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
            agreed, both = agreed + agree / 2, both + (agree == 2)
        shares[region, 0], shares[region, 1] = agreed / max(splits, 1), both / max(splits, 1)


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
    return of_rank(found, others.size, max(others.size - 1, 0) // 2) + 1e-6


@kernel(allocates=True)
def compare(weighted, seen, cells, places, nearest, others, plane, lead):
    """
    Tilt the plane of a region to where it has the most evidence, and compare it with the map.

    Returns the evidence for the plane and for the map, in deviations, and how decisive 3 x 3 cells
    are: the mean evidence of the plane there, in those of wrong disparities.
    weighted, seen: float64 (cells, labels), the curves in deviations, and counts; cells: of Votes;
    places: int32 (cell rows, cell columns), numbers of the region's cells, below 0 for none;
    nearest: the label from which on there is evidence; others: int64, wrong disparities; plane:
    float64 (3,), of half-size x and y and full disparity, flat at first; lead: float64 (cells,),
    written, by how much the evidence for the plane in 3 x 3 cells exceeds that of the map, in
    those of wrong disparities
    """
    number = len(weighted)
    right, down, of_map, of_plane = (np.zeros(number), np.zeros(number), np.zeros(number),
                                     np.zeros(number))
    x, y, wide, high = centres(cells, right, down)
    evidence, (level, slope, fall) = climb(weighted, seen, right, down, plane[2], of_plane)
    known = evidence_of_map(cells, places, nearest, weighted, seen, of_map)
    plane[0], plane[1] = slope / wide, fall / high
    plane[2] = level - plane[0] * x - plane[1] * y
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
    return (evidence, known), total / pixels / usual
