# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plane genes on a grid of every other pixel of every other row.

Cell (r, x) of the grid is the pixel (2 r + down, 2 x + right); down and right are 0 or 1 and move
with the picture, so that a cell stays with what it shows. The planes (a, b, c) are those of grid
coordinates: the disparity of cell (r, x), in px of the image, is a x + b r + c.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.costs import UNIT
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Features, match_cost
from fuzzy_stereo_ros.matching.kernels.possibility.features import copy_row, MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS
import numpy as np


class Genes(NamedTuple):
    """The chromosome of planes, as the next frame inherits it."""

    planes: np.ndarray       # float32 (r, c, 3), of cells
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
    tangents: np.ndarray     # float32 (r, c, 3), the planes through it
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
        for tile in range(quiet.shape[1]):
            begin, end = tile * side, min((tile + 1) * side, columns)
            here = row // side, tile
            y, moved = (row - down, right) if choices[here] != 0 else (row, 0)
            from_, to = begin, begin        # of the cells of this tile that come over
            if quiet[here] != 0 and 0 <= y < rows:
                from_, to = max(begin, moved), min(end, columns + moved)
            for column in range(begin, end):
                if not from_ <= column < to:
                    moved_evolved[row, column] = moved_proposals[row, column] = 0
                    moved_planes[row, column] = 0
            for column in range(from_, to):
                x = np.uint64(column - moved)
                slope, fall, offset = planes[y, x, 0], planes[y, x, 1], planes[y, x, 2]
                moved_evolved[row, column] = evolved[y, x]
                moved_proposals[row, column] = proposals[y, x]
                moved_planes[row, column, 0], moved_planes[row, column, 1] = slope, fall
                moved_planes[row, column, 2] = (offset - slope * np.float32(moved)
                                                - fall * np.float32(row - y))


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
        for column in range(cells.disparities.shape[1]):
            x = 2 * column + right
            label, validity = np.int32(found.chromosome[y, x]), found.validity[y, x]
            disparity = np.float32(label)
            if label == np.int32(found.labels[y, x]):
                disparity += np.float32(found.offsets[y, x]) / np.float32(STEPS)
            cells.disparities[row, column] = disparity
            cells.consistent[row, column] = validity != INVALID
            cells.mutated[row, column] = validity != INVALID and abs(
                label - np.int32(found.labels[y, x])) > 1
            doubts[row, column] = clear - (
                min(np.int64(margins[y, x]), clear) if validity == CONSISTENT else 0)


@kernel
def follow_map(cell_map, reach, limit, genes, first, last):
    """
    Reset unevolved genes to the tangent planes of a map; its mutated cells count as evolved.

    The planes through the cells of the map are sloped as the neighbours `reach` cells away are.

    cell_map: the fields of CellMap, whose tangents are written; limit: px by which those
    neighbours may differ; genes: the fields of Genes
    """
    disparities, tangents, _, mutated = cell_map
    planes, evolved, _, _ = genes
    rows, columns = evolved.shape
    for row in range(first, last):
        here, above, below = disparities[row], disparities[row], disparities[row]
        if reach <= row < rows - reach:
            above, below = disparities[row - reach], disparities[row + reach]
        for column in range(columns):
            slope = np.float32(0)
            if reach <= column < columns - reach:
                slope = _slope(here[column - reach], here[column], here[column + reach], reach,
                               limit)
            fall = _slope(above[column], here[column], below[column], reach, limit)
            found = tangents[row, column]
            found[0], found[1] = slope, fall
            found[2] = here[column] - slope * np.float32(column) - fall * np.float32(row)
        for column in range(columns):
            if not evolved[row, column]:
                for part in range(3):
                    planes[row, column, part] = tangents[row, column, part]
            evolved[row, column] |= mutated[row, column]


@inlined
def _slope(before, here, after, reach, limit):
    """Return how much a map rises from cell to cell, 0 where it jumps by `limit` or more."""
    flat = (abs(before - here) < limit) & (abs(after - here) < limit)
    return (after - before) / np.float32(2 * reach) if flat else np.float32(0)


@kernel
def grid_costs(features, largest, target_range, origin, selected, parent, first, last):
    """
    Write what the matches of the selected cells cost, 0 to UNIT.

    features: the fields of Features; largest: cost of the least possible match; target_range:
    first and last column of the target that exist, beyond which half is paid; origin: of the
    Genes; selected: bool (r, c); parent: the fields of a Parent
    """
    features, (planes, costs) = Features(*features), parent
    down, right = np.int64(origin[0]), np.int64(origin[1])
    top, scale = np.float32(features.disparities - 1), np.float32(UNIT) / np.float32(largest)
    for row in range(first, last):
        y = 2 * row + down
        for column in range(selected.shape[1]):
            if not selected[row, column]:
                continue
            disparity = _disparity(planes[row, column], row, column)
            if not (np.float32(-0.5) <= disparity <= top + np.float32(0.5)):
                costs[row, column] = UNIT
                continue
            disparity = min(max(disparity, np.float32(0)), top)
            label, x = np.int64(disparity), 2 * column + right
            beyond = min(label + 1, features.disparities - 1)
            if x - beyond < target_range[0] or x - label > target_range[1]:
                costs[row, column] = UNIT // 2
                continue
            low = np.float32(match_cost(features, y, x, label))
            high = np.float32(match_cost(features, y, x, beyond))
            cost = low + (disparity - np.float32(label)) * (high - low)
            costs[row, column] = np.int32(cost * scale + np.float32(0.5))


@inlined
def _disparity(plane, row, column):
    return plane[0] * np.float32(column) + plane[1] * np.float32(row) + plane[2]


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
def trust_visible(disparities, consistent, origin, begin, nearest, trusted, first, last):
    """
    Trust matches that are consistent and that nothing nearer of their row hides.

    disparities: float32 (r, c), px; consistent: bool (r, c); origin: of the Genes; begin: first
    column of the target that exists; nearest: float32 (N,), memory, a cell for two columns of the
    target; trusted: bool (r, c)
    """
    columns, right = trusted.shape[1], np.int64(origin[1])
    for row in range(first, last):
        nearest[:] = -1
        for column in range(columns):
            disparity = disparities[row, column]
            place = (np.int64(np.rint(2 * column + right - disparity)) - begin) >> 1
            if 0 <= place < nearest.size:
                nearest[place] = max(nearest[place], disparity)
        for column in range(columns):
            disparity = disparities[row, column]
            place = (np.int64(np.rint(2 * column + right - disparity)) - begin) >> 1
            trusted[row, column] = (consistent[row, column] and 0 <= place < nearest.size
                                    and nearest[place] <= disparity + 1)


@kernel
def rank_regions(regions, doubts, proposals, cells, doubt, proposed):
    """
    Sum cells, doubt and proposals per region: int64 (N,).

    regions: the fields of segments.Regions; doubts, proposals: uint8 (r, c), of the cells; cells,
    doubt, proposed: their number and sums by region
    """
    begin, end, row_runs, region = regions
    cells[:] = doubt[:] = proposed[:] = 0
    for row in range(len(row_runs)):
        for run in range(row_runs[row, 0], row_runs[row, 1]):
            mine = region[run]
            if mine < 0:
                continue
            cells[mine] += end[run] - begin[run]
            for column in range(begin[run], end[run]):
                doubt[mine] += doubts[row, column]
                proposed[mine] += proposals[row, column]


@kernel
def choose_regions(order, cells, most, numbers, starts):
    """
    Choose the first regions of an order that hold at most so many cells; return how many.

    numbers: int32 (N,), by region, -1 for the others; starts: int32 (N + 1,), of the chosen
    """
    numbers[:] = -1
    number = starts[0] = 0
    for mine in order:
        if starts[number] + cells[mine] <= most:
            starts[number + 1] = starts[number] + cells[mine]
            numbers[mine] = number
            number += 1
    return number


@kernel
def list_chosen(regions, numbers, region_pixels, ends, labels, selected, proposals):
    """
    List the cells of the chosen regions, and count a proposal for each of these cells.

    regions: the fields of segments.Regions; region_pixels: of fits.RegionPixels, whose pixels are
    written; ends: int32 (n,), memory; labels: int32 (r, c), its number; selected: bool (r, c)
    """
    begin, end, row_runs, region = regions
    starts, pixels = region_pixels
    copy_row(starts, ends)
    selected[:] = False
    for row in range(len(row_runs)):
        for run in range(row_runs[row, 0], row_runs[row, 1]):
            mine = numbers[region[run]] if region[run] >= 0 else -1
            if mine < 0:
                continue
            for column in range(begin[run], end[run]):
                pixels[ends[mine]] = row * selected.shape[1] + column
                ends[mine] += 1
                labels[row, column], selected[row, column] = mine, True
                proposals[row, column] = min(proposals[row, column] + 1, 255)


@kernel
def propose_planes(planes, regions, quiet, highest, selected, proposed, first, last):
    """
    Write rows of a proposal: selected cells have the planes of their regions, others their own.

    planes: float32 (r, c, 3); regions: int32 (r, c), the region of each selected cell, and
    float32 (n, 3), the planes of regions; quiet: uint8 (tile rows, tile columns), 0 where nothing
    is proposed; highest: px; selected: bool (r, c), set to false there; proposed: written,
    float32 (r, c, 3), and float32 (r, c), the disparities of selected cells, px
    """
    (labels, region_planes), (proposal, disparities) = regions, proposed
    for row in range(first, last):
        for column in range(labels.shape[1]):
            selected[row, column] &= quiet[2 * row // TILE, 2 * column // TILE] > 0
            if selected[row, column]:
                mine = labels[row, column]
                for part in range(3):
                    proposal[row, column, part] = region_planes[mine, part]
                disparities[row, column] = min(max(
                    _disparity(proposal[row, column], row, column), np.float32(0)), highest)
            else:
                for part in range(3):
                    proposal[row, column, part] = planes[row, column, part]


@kernel
def propose_map(genes, current, cell_map, apart, selected, proposal):
    """
    Write a proposal: evolved cells more than `apart` px from a map lie in its tangent planes.

    genes: the fields of Genes; current: float32 (r, c), px, their disparities; cell_map: the
    fields of CellMap; selected: bool (r, c); proposal: float32 (r, c, 3); returns how many cells
    these are
    """
    planes, evolved, _, _ = genes
    disparities, tangents, _, _ = cell_map
    number = 0
    for row in range(selected.shape[0]):
        for column in range(selected.shape[1]):
            mine = evolved[row, column] > 0 and abs(
                current[row, column] - disparities[row, column]) > apart
            selected[row, column] = mine
            number += mine
            for part in range(3):
                proposal[row, column, part] = (tangents if mine else planes)[row, column, part]
    return number


@kernel
def mark_taken(cells, taken, kind, evolved):
    """Write whether the genes of the taken cells have evolved: uint8 (r, c)."""
    flat = evolved.reshape(-1)
    for index in range(cells.size):
        if taken[index]:
            flat[cells[index]] = kind
