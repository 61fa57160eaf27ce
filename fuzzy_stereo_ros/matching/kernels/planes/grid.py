# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plane genes on a grid of every other pixel of every other row.

Cell (r, x) of the grid is the pixel (2 r + down, 2 x + right); down and right are 0 or 1 and move
with the picture, so that a cell stays with what it shows. The planes (a, b, c) are those of grid
coordinates: the disparity of cell (r, x), in px of the image, is a x + b r + c.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Features, match_cost
from fuzzy_stereo_ros.matching.kernels.possibility.features import copy_row, MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS
import numpy as np


@kernel
def move_genes(planes, evolved, proposals, choices, quiet, down, right, moved_planes,
               moved_evolved, moved_proposals, first, last):
    """
    Shift the genes of moved tiles by a number of cells; copy those of unmoved tiles.

    planes: float32 (r, c, 3); evolved: uint8 (r, c), 0 where a gene follows the map; proposals:
    uint8 (r, c), how many planes were proposed; choices: int8 (tile rows, tile columns), 0 where
    a tile of pixels stayed; quiet: uint8, likewise, 0 for tiles whose genes are set to 0; down,
    right: cells; the rows first to last - 1 are written
    """
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
def sample_map(chromosome, labels, offsets, validity, margins, clear, down, right, disparities,
               consistent, mutated, doubts, first, last):
    """
    Sample a chromosome and the result of the search at the cells of some rows.

    chromosome: (R, C) labels; labels, offsets, margins: of the `SearchResult`; validity: uint8
    (R, C); clear: margin that leaves no doubt; disparities: float32 (r, c), px; consistent: bool
    (r, c); mutated: bool (r, c), consistent matches whose label the chromosome has changed;
    doubts: uint8 (r, c), 0 to clear
    """
    for row in range(first, last):
        y = 2 * row + down
        for column in range(disparities.shape[1]):
            x = 2 * column + right
            label = np.int32(chromosome[y, x])
            disparity = np.float32(label)
            if label == np.int32(labels[y, x]):
                disparity += np.float32(offsets[y, x]) / np.float32(STEPS)
            disparities[row, column] = disparity
            consistent[row, column] = validity[y, x] != INVALID
            mutated[row, column] = validity[y, x] != INVALID and abs(
                label - np.int32(labels[y, x])) > 1
            doubts[row, column] = clear - (
                min(np.int64(margins[y, x]), clear) if validity[y, x] == CONSISTENT else 0)


@kernel
def follow_map(disparities, reach, limit, mutated, evolved, planes, tangents, first, last):
    """
    Reset unevolved genes to the tangent planes of a map; its mutated cells count as evolved.

    The planes through the cells of the map are sloped as the neighbours `reach` cells away are.

    disparities: float32 (r, c), px; limit: px by which those neighbours may differ; mutated: bool,
    evolved: uint8 (r, c); planes, tangents: float32 (r, c, 3), the genes, and those of the map
    """
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
def grid_costs(features, largest, unit, target_range, down, right, planes, selected, costs, first,
               last):
    """
    Write what the matches of the selected cells cost: int32 (r, c), 0 to unit.

    features: the fields of Features; largest: cost of the least possible match; target_range:
    first and last column of the target that exist, beyond which half is paid; planes: float32
    (r, c, 3); selected: bool (r, c)
    """
    features = Features(*features)
    top, scale = np.float32(features.disparities - 1), np.float32(unit) / np.float32(largest)
    for row in range(first, last):
        y = 2 * row + down
        for column in range(selected.shape[1]):
            if not selected[row, column]:
                continue
            disparity = _disparity(planes[row, column], row, column)
            if not (np.float32(-0.5) <= disparity <= top + np.float32(0.5)):
                costs[row, column] = unit
                continue
            disparity = min(max(disparity, np.float32(0)), top)
            label, x = np.int64(disparity), 2 * column + right
            beyond = min(label + 1, features.disparities - 1)
            if x - beyond < target_range[0] or x - label > target_range[1]:
                costs[row, column] = unit // 2
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
def trust_visible(planes, consistent, right, begin, highest, full, little, nearest, disparities,
                  trusted, trust, first, last):
    """
    Trust matches that are consistent and that nothing nearer of their row hides.

    planes: float32 (r, c, 3); consistent: bool (r, c); begin: first column of the target that
    exists; highest: px; full, little: trust; nearest: float32 (N,), memory, a cell for two
    columns of the target; disparities: float32 (r, c), px; trusted: bool, trust: int32 (r, c)
    """
    columns = trust.shape[1]
    for row in range(first, last):
        nearest[:] = -1
        for column in range(columns):
            disparity = min(max(_disparity(planes[row, column], row, column), np.float32(0)),
                            highest)
            disparities[row, column] = disparity
            place = (np.int64(np.rint(2 * column + right - disparity)) - begin) >> 1
            if 0 <= place < nearest.size:
                nearest[place] = max(nearest[place], disparity)
        for column in range(columns):
            disparity = disparities[row, column]
            place = (np.int64(np.rint(2 * column + right - disparity)) - begin) >> 1
            known = (consistent[row, column] and 0 <= place < nearest.size
                     and nearest[place] <= disparity + 1)
            trusted[row, column] = known
            trust[row, column] = full if known else little


@kernel
def rank_regions(begin, end, row_runs, region, doubts, proposals, cells, doubt, proposed):
    """
    Sum cells, doubt and proposals per region: int64 (N,).

    begin, end, row_runs, region: runs of rows and their regions, see segments.py; doubts,
    proposals: uint8 (r, c), of the cells; cells, doubt, proposed: their number and sums by region
    """
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
def list_chosen(begin, end, row_runs, region, numbers, starts, ends, pixels, labels, selected,
                proposals):
    """
    List the cells of the chosen regions, and count a proposal for each of these cells.

    starts: int32 (n + 1,); ends: int32 (n,), memory; pixels: int32, those of region i are
    pixels[starts[i]:starts[i + 1]]; labels: int32 (r, c), its number; selected: bool (r, c)
    """
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
def propose_planes(planes, labels, region_planes, quiet, highest, selected, proposal,
                   disparities):
    """
    Write a proposal: the selected cells have the planes of their regions, others their own.

    planes, proposal: float32 (r, c, 3); labels: int32 (r, c); region_planes: float32 (n, 3);
    quiet: uint8 (tile rows, tile columns), 0 where nothing is proposed; highest: px;
    disparities: float32 (r, c), px, of the proposal where it is selected
    """
    for row in range(labels.shape[0]):
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
def propose_map(planes, tangents, evolved, current, disparities, apart, selected, proposal):
    """
    Write a proposal: evolved cells more than `apart` px from a map lie in its tangent planes.

    planes, tangents, proposal: float32 (r, c, 3); evolved: uint8 (r, c); current, disparities:
    float32 (r, c), px, of the genes and of the map; selected: bool (r, c); returns how many cells
    these are
    """
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
