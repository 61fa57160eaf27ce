# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From plane genes on a grid, see grid.py, to the labels of all pixels around its cells.

Few pixels change in a frame: SIMD finds these candidates; a scalar loop handles them.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import next_byte
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.plane import (
    disparity_at, plane_at, write_disparities)
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS
import numpy as np

_ROUNDING = np.float32(0.01)     # px, more than sums of a plane are rounded by


class Lines(NamedTuple):
    """Memory for the candidates of a row of pixels."""

    planes: np.ndarray       # float32 (2, 4, c + 1), of the cells above and below, see _spread
    doubted: np.ndarray      # uint8 (c,), which pixels of every other column are candidates


@inlined
def _like(luminance, y, x, row, column, down, right, shape):
    """Return the cell around a pixel, (row, column) before it, that is most like it in grey."""
    grey = np.int32(luminance[y + MARGIN, x + MARGIN])
    best_row, best, least = row, column, np.int32(1 << 30)
    for r in range(row, min(row + (y - down) % 2 + 1, shape[0])):
        for c in range(column, min(column + (x - right) % 2 + 1, shape[1])):
            unlike = abs(np.int32(luminance[2 * r + down + MARGIN, 2 * c + right + MARGIN]) - grey)
            if unlike < least:
                least, best_row, best = unlike, r, c
    return best_row, best


@called
def _spread(planes, evolved, row, apart, lines):
    """Write disparity, slope, fall and tolerance of labels, px, of each cell of a row."""
    columns, marks, slack, anywhere = evolved.shape[1], evolved[row], lines[3], np.float32(np.inf)
    write_disparities(planes, row, -anywhere, anywhere, lines[0, :columns])
    for part in range(2):
        copy_row(planes[row, part], lines[part + 1, :columns])
    for column in range(columns):
        slack[column] = apart - _ROUNDING if marks[column] else anywhere
    for line in range(4):
        lines[line, columns] = lines[line, columns - 1]


@inlined
def _is_far(lines, place, right, down, label):
    """Return whether the plane of a cell is far from a label so many px from the cell."""
    disparity = lines[0, place] + lines[1, place] * right + lines[2, place] * down
    return abs(disparity - label) > lines[3, place]


@called
def _doubted(upper, lower, down, side, labels, begin, doubted):
    """
    Write which pixels are far from the plane of a cell around them.

    upper, lower: of the cells above and below, see _spread; down, side: 1 for the lower and the
    right ones of a cell's four pixels; labels: of the row, every other one from `begin` on;
    doubted: uint8
    """
    # indices without a sign, else this is no loop of vectors
    half = np.float32(0.5)
    above, below, before, after = (half * np.float32(down), half * np.float32(-down),
                                   half * np.float32(side), half * np.float32(-side))
    for column in range(doubted.size):
        label = np.float32(labels[np.uint64(2 * column + begin)])
        one, two = np.uint64(column), np.uint64(column + side)
        doubted[one] = (_is_far(upper, one, before, above, label)
                        | _is_far(upper, two, after, above, label)
                        | _is_far(lower, one, before, below, label)
                        | _is_far(lower, two, after, below, label))


@kernel
def write_labels(genes, trusted, luminance, apart, highest, frame_map, lines, first, last):
    """
    Give pixels around evolved cells the labels of their planes.

    A pixel belongs to the cell around it that is most like it in grey. Labels that differ from
    the chromosome's by less than `apart` px stay.

    genes: the fields of Genes; trusted: bool (r, c); luminance: uint16, grey of the full image
    with a margin; highest: px; frame_map: the fields of FrameMap, written; lines: those of Lines;
    first, last: rows of cells
    """
    planes, evolved, _, origin = genes
    chromosome, labels, offsets, validity = frame_map
    of_cells, doubted = lines
    down, right = np.int64(origin[0]), np.int64(origin[1])
    (rows, columns), half = evolved.shape, np.float32(0.5)
    _spread(planes, evolved, first, apart, of_cells[first & 1])
    for row in range(first, last):
        below = min(row + 1, rows - 1)
        _spread(planes, evolved, below, apart, of_cells[(row + 1) & 1])
        for y in range(2 * row + down, min(2 * row + down + 2, chromosome.shape[0])):
            lower = y - 2 * row - down
            for side in range(2):
                # few pixels differ by so much from any plane around them
                there = doubted[:min(columns, (chromosome.shape[1] - right - side + 1) // 2)]
                _doubted(of_cells[row & 1], of_cells[(row + lower) & 1], lower, side,
                         chromosome[y], right + side, there)
                column = -1
                while True:
                    column = next_byte(there, column + 1, 0, False)
                    if column == there.size:
                        break
                    x = 2 * column + right + side
                    r, c = _like(luminance, y, x, row, column, down, right, evolved.shape)
                    if not evolved[r, c]:
                        continue
                    disparity = disparity_at(
                        plane_at(planes, r, c), half * np.float32(x - right),
                        half * np.float32(y - down))
                    disparity = min(max(disparity, np.float32(0)), highest)
                    if abs(disparity - np.float32(chromosome[y, x])) < apart:
                        continue
                    label = np.int64(np.rint(disparity))
                    chromosome[y, x] = labels[y, x] = label
                    offsets[y, x] = np.int64(np.rint((disparity - np.float32(label))
                                                     * np.float32(STEPS)))
                    validity[y, x] = CONSISTENT if trusted[r, c] else INVALID
