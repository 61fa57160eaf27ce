# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plane genes on a grid of every other pixel of every other row.

Cell (r, x) of the grid is the pixel (2 r + down, 2 x + right); down and right are 0 or 1 and move
with the picture, so that a cell stays with what it shows. The planes (a, b, c) are those of grid
coordinates: the disparity of cell (r, x), in px of the image, is a x + b r + c. Loops over cells
are those of functions that get few arrays, since the compiler tests each pair for overlap before
it uses vectors.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.planes.costs import TRUSTED, UNIT
from fuzzy_stereo_ros.matching.kernels.planes.plane import (
    disparity_at, plane_at, write_disparities)
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Features, match_cost
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS
import numpy as np


class Genes(NamedTuple):
    """The chromosome of planes, as the next frame inherits it."""

    planes: np.ndarray       # float32 (r, 3, c), of cells
    evolved: np.ndarray      # uint8 (r, c), 0 where a gene follows the map
    proposals: np.ndarray    # uint8 (r, c), how often a plane was proposed
    origin: np.ndarray       # uint8 (2,), pixel of the first cell: down, right


class FrameMap(NamedTuple):
    """The map of a frame: what its search has found, and the chromosome evolved from it."""

    chromosome: np.ndarray   # (R, C) labels
    labels: np.ndarray       # of the `SearchResult`, as offsets
    offsets: np.ndarray
    validity: np.ndarray     # uint8 (R, C), which of its labels are consistent


class CellMap(NamedTuple):
    """The same map at the cells."""

    disparities: np.ndarray  # float32 (r, c), px
    tangents: np.ndarray     # float32 (r, 3, c), the planes through it
    consistent: np.ndarray   # bool (r, c)
    mutated: np.ndarray      # bool (r, c), consistent ones whose label the chromosome has changed


@kernel
def move_genes(genes, choices, quiet, shift, moved_genes, first, last):
    """
    Shift the genes of moved tiles by a number of cells; copy those of unmoved tiles.

    genes, moved_genes: the fields of Genes; choices: int8 (tile rows, tile columns), 0 where a
    tile of pixels stayed; quiet: uint8, likewise, 0 for tiles whose genes are set to 0; shift:
    cells down and right; the rows first to last - 1 are written
    """
    planes, evolved, proposals, _ = genes
    moved_planes, moved_evolved, moved_proposals, _ = moved_genes
    down, right = shift
    rows, columns = evolved.shape
    side = TILE // 2
    for row in range(first, last):
        moved_planes[row], moved_evolved[row], moved_proposals[row] = 0, 0, 0
        chosen, shown, tile = choices[row // side], quiet[row // side], 0
        while tile < shown.size:
            run = tile      # of tiles alike
            while (tile < shown.size and chosen[tile] == chosen[run]
                   and shown[tile] == shown[run]):
                tile += 1
            y, moved = (row - down, right) if chosen[run] != 0 else (row, 0)
            begin, end = max(run * side, moved), min(tile * side, columns, columns + moved)
            if shown[run] == 0 or y < 0 or y >= rows or begin >= end:
                continue
            copy_row(evolved[y, begin - moved:], moved_evolved[row, begin:end])
            copy_row(proposals[y, begin - moved:], moved_proposals[row, begin:end])
            for part in range(2):
                copy_row(planes[y, part, begin - moved:], moved_planes[row, part, begin:end])
            _move_offsets(planes[y, 2, begin - moved:], moved_planes[row, :, begin:end],
                          np.float32(row - y), np.float32(moved))


@called
def _move_offsets(offsets, planes, down, right):
    """Write the offsets of planes that have moved, float32 (3, n), from those before."""
    slopes, falls, moved = planes[0], planes[1], planes[2]
    for column in range(moved.size):
        moved[column] = offsets[column] - slopes[column] * right - falls[column] * down


@kernel
def sample_map(frame_map, margins, clear, origin, cell_map, doubts, first, last):
    """
    Sample the map of a frame at the cells of some rows; its tangents are not written.

    frame_map: the fields of FrameMap; margins: of the `SearchResult`; clear: margin that leaves
    no doubt; origin: of the Genes; cell_map: the fields of CellMap; doubts: uint8 (r, c), 0 where
    the margin is clear
    """
    found, cells = FrameMap(*frame_map), CellMap(*cell_map)
    down, right = np.int64(origin[0]), np.int64(origin[1])
    for row in range(first, last):
        y = 2 * row + down
        _sample(found.chromosome[y], found.labels[y], found.offsets[y], right,
                cells.disparities[row])
        _compare(found.chromosome[y], found.labels[y], found.validity[y], right,
                 cells.consistent[row], cells.mutated[row])
        _doubt(margins[y], found.validity[y], right, clear, doubts[row])


@called
def _sample(chromosome, labels, offsets, begin, disparities):
    """Write the disparities of every other pixel of a row, from `begin` on."""
    for column in range(disparities.size):
        x = np.uint64(2 * column + begin)
        offset = np.int32(offsets[x]) if chromosome[x] == labels[x] else np.int32(0)
        steps = np.int32(chromosome[x]) * np.int32(STEPS) + offset
        disparities[column] = np.float32(steps) * np.float32(1 / STEPS)


@called
def _compare(chromosome, labels, validity, begin, consistent, mutated):
    """Write which of those pixels are consistent, and which of these have another label."""
    for column in range(consistent.size):
        x = np.uint64(2 * column + begin)
        valid = validity[x] != INVALID
        consistent[column] = valid
        mutated[column] = valid & (abs(np.int32(chromosome[x]) - np.int32(labels[x])) > 1)


@called
def _doubt(margins, validity, begin, clear, doubts):
    """Write how far the margin of each of those pixels is from a clear one."""
    for column in range(doubts.size):
        x = np.uint64(2 * column + begin)
        margin = min(np.int32(margins[x]), np.int32(clear))
        doubts[column] = np.int32(clear) - (
            margin if validity[x] == CONSISTENT else np.int32(0))


@kernel
def follow_map(cell_map, reach, limit, genes, highest, current, first, last):
    """
    Reset unevolved genes to the tangent planes of a map; its mutated cells count as evolved.

    The planes through the cells of the map are sloped as the neighbours `reach` cells away are.

    cell_map: the fields of CellMap, whose tangents are written; limit: px by which those
    neighbours may differ; genes: the fields of Genes; highest: px; current: float32 (r, c), the
    disparities of all genes, px, written
    """
    disparities, tangents, _, mutated = cell_map
    planes, evolved, _, _ = genes
    rows, columns = evolved.shape
    for row in range(first, last):
        here, above, below = disparities[row], disparities[row], disparities[row]
        if reach <= row < rows - reach:
            above, below = disparities[row - reach], disparities[row + reach]
        slopes, falls = tangents[row, 0], tangents[row, 1]
        slopes[:] = 0
        _rise(here, here[reach:], here[2 * reach:], reach, limit,
              slopes[reach:max(columns - reach, reach)])
        _rise(above, here, below, reach, limit, falls)
        _touch(here, np.float32(row), tangents[row])
        for part in range(3):
            _follow(tangents[row, part], evolved[row], planes[row, part])
        _mark(mutated[row], evolved[row])
        write_disparities(planes, row, np.float32(0), highest, current[row])


@called
def _rise(before, here, after, reach, limit, slopes):
    """Write how much a map rises from cell to cell, 0 where it jumps by `limit` or more."""
    for column in range(slopes.size):
        flat = ((abs(before[column] - here[column]) < limit)
                & (abs(after[column] - here[column]) < limit))
        slope = (after[column] - before[column]) / np.float32(2 * reach)
        slopes[column] = slope if flat else np.float32(0)


@called
def _touch(disparities, row, planes):
    """Write the offsets of planes, float32 (3, c), by which they have the disparities of a row."""
    slopes, falls, offsets = planes[0], planes[1], planes[2]
    for column in range(offsets.size):
        offsets[column] = (disparities[column] - slopes[column] * np.float32(column)
                           - falls[column] * row)


@called
def _follow(tangents, evolved, planes):
    """Write a part of the planes of a row where these have not evolved."""
    for column in range(planes.size):
        tangent, plane = tangents[column], planes[column]
        planes[column] = plane if evolved[column] else tangent


@called
def _mark(mutated, evolved):
    """Let mutated cells of a row count as evolved."""
    for column in range(evolved.size):
        evolved[column] |= np.uint8(mutated[column])


@kernel
def grid_costs(features, largest, target_range, origin, trust, selected, parent, first, last):
    """
    Write what the matches of the selected cells cost, 0 to UNIT, times the trust in them.

    features: the fields of Features; largest: cost of the least possible match; target_range:
    first and last column of the target that exist, beyond which half is paid; origin: of the
    Genes; trust: bool (r, c), what counts in full, and the trust in others, of TRUSTED; selected:
    bool (r, c); parent: planes, float32 (r, 3, c), and costs, int32 (r, c), written
    """
    features, (trusted, little), (planes, costs) = Features(*features), trust, parent
    down, right = np.int64(origin[0]), np.int64(origin[1])
    top, scale = np.float32(features.disparities - 1), np.float32(UNIT) / np.float32(largest)
    for row in range(first, last):
        y = 2 * row + down
        for column in range(selected.shape[1]):
            if not selected[row, column]:
                continue
            disparity, cost = disparity_at(plane_at(planes, row, column), column, row), UNIT
            if np.float32(-0.5) <= disparity <= top + np.float32(0.5):
                disparity = min(max(disparity, np.float32(0)), top)
                label, x = np.int64(disparity), 2 * column + right
                beyond = min(label + 1, features.disparities - 1)
                cost = UNIT // 2
                if x - beyond >= target_range[0] and x - label <= target_range[1]:
                    low = np.float32(match_cost(features, y, x, label))
                    high = np.float32(match_cost(features, y, x, beyond))
                    between = low + (disparity - np.float32(label)) * (high - low)
                    cost = np.int64(between * scale + np.float32(0.5))
            costs[row, column] = cost if trusted[row, column] else cost * little // TRUSTED


@kernel
def edge_weights(luminance, roots, by_step, across, down, first, last):
    """
    Write how much the planes of neighbours have to agree: float32 (r, c), to the left and up.

    luminance: uint16, grey of the half-size image with a margin; roots: int32 (256,), of grey, by
    which noise is alike everywhere; by_step: float32, the weight by the difference of two roots
    """
    for row in range(first, last):
        line, above = luminance[row + MARGIN], luminance[row + MARGIN - 1]
        for column in range(across.shape[1]):
            here = roots[line[column + MARGIN] >> 8]
            across[row, column] = by_step[abs(here - roots[line[column + MARGIN - 1] >> 8])]
            down[row, column] = by_step[abs(here - roots[above[column + MARGIN] >> 8])]


@kernel
def trust_visible(disparities, consistent, origin, begin, memory, trusted, first, last):
    """
    Trust matches that are consistent and that nothing nearer of their row hides.

    disparities: float32 (r, c), px; consistent: bool (r, c); origin: of the Genes; begin: first
    column of the target that exists; memory: float32 (n + 1,), for each two columns of the target
    the nearest that is seen there, and one for all beyond; int32 (c,), by cell, where it is seen;
    trusted: bool (r, c)
    """
    nearest, places = memory
    for row in range(first, last):
        line = disparities[row]
        _point(line, np.int32(origin[1]), np.int32(begin), np.int32(nearest.size - 1), places)
        nearest[:] = -1
        for column in range(line.size):
            place = np.uint64(places[column])
            nearest[place] = max(nearest[place], line[column])
        nearest[nearest.size - 1] = np.inf
        for column in range(line.size):
            trusted[row, column] = consistent[row, column] & (
                nearest[np.uint64(places[column])] <= line[column] + np.float32(1))


@called
def _point(disparities, right, begin, beyond, places):
    """Write the places in the target that the cells of a row point at, `beyond` for none."""
    for column in range(places.size):
        pointed = np.int32(np.rint(
            np.float32(2 * np.int32(column) + right) - disparities[column])) - begin
        place = pointed >> np.int32(1)
        places[column] = place if (place >= 0) & (place < beyond) else beyond
