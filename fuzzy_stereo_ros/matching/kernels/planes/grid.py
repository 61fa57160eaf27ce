# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plane genes on a grid of every other pixel of every other row, and the map of labels around it.

Cell (r, x) of the grid is the pixel (2 r + down, 2 x + right); down and right are 0 or 1 and move
with the picture, so that a cell stays with what it shows. The planes (a, b, c) are those of grid
coordinates: the disparity of cell (r, x), in px of the image, is a x + b r + c.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Features, match_cost
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import CONSISTENT, REFUSED
from fuzzy_stereo_ros.matching.kernels.scanlines.choice import STEPS
from fuzzy_stereo_ros.matching.kernels.temporal.sameness import TILE
import numpy as np

_ROUNDING = np.float32(0.01)     # px, more than sums of a plane are rounded by


@kernel
def move_genes(planes, evolved, work, choices, settled, down, right, moved_planes, moved_evolved,
               moved_work, first, last):
    """
    Move what is known of cells by a number of cells, but in tiles that stayed.

    planes: float32 (r, c, 3); evolved: uint8 (r, c), 0 where a gene follows the map; work: uint8
    (r, c); choices: int8 (tile rows, tile columns), 0 where a tile of pixels stayed; settled:
    uint8, likewise, 0 where nothing comes over and zeros are written; down, right: cells; rows
    first .. last are written
    """
    rows, columns = evolved.shape
    side = TILE // 2
    for row in range(first, last):
        for tile in range(settled.shape[1]):
            begin, end = tile * side, min((tile + 1) * side, columns)
            here = row // side, tile
            y, moved = (row - down, right) if choices[here] != 0 else (row, 0)
            from_, to = begin, begin        # of the cells of this tile that come over
            if settled[here] != 0 and 0 <= y < rows:
                from_, to = max(begin, moved), min(end, columns + moved)
            for column in range(begin, end):
                if not from_ <= column < to:
                    moved_evolved[row, column] = moved_work[row, column] = 0
                    moved_planes[row, column] = 0
            for column in range(from_, to):
                x = np.uint64(column - moved)
                slope, fall, offset = planes[y, x, 0], planes[y, x, 1], planes[y, x, 2]
                moved_evolved[row, column], moved_work[row, column] = evolved[y, x], work[y, x]
                moved_planes[row, column, 0], moved_planes[row, column, 1] = slope, fall
                moved_planes[row, column, 2] = (offset - slope * np.float32(moved)
                                                - fall * np.float32(row - y))


@kernel
def sample_map(chromosome, labels, offsets, verdict, margins, clear, down, right, disparities,
               consistent, mutated, doubts, first, last):
    """
    Write what a chromosome and the scanlines say of the cells of some rows.

    chromosome: (R, C) labels; labels, offsets, margins: of the scanlines' `Chosen`; verdict: uint8
    (R, C); clear: margin that leaves no doubt; disparities: float32 (r, c), px; consistent: bool
    (r, c); mutated: bool (r, c), consistent matches that the chromosome has otherwise; doubts:
    uint8 (r, c), 0 to clear
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
            consistent[row, column] = verdict[y, x] != REFUSED
            mutated[row, column] = verdict[y, x] != REFUSED and abs(
                label - np.int32(labels[y, x])) > 1
            doubts[row, column] = clear - (
                min(np.int64(margins[y, x]), clear) if verdict[y, x] == CONSISTENT else 0)


@kernel
def follow_map(disparities, reach, limit, mutated, evolved, planes, tangents, first, last):
    """
    Let the genes that have not evolved follow a map; mutated cells of it have evolved.

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


@kernel(error_model='numpy')
def grid_costs(features, largest, unit, inside, down, right, planes, selected, costs, first, last):
    """
    Write what the matches of the selected cells cost: int32 (r, c), 0 to unit.

    features: the fields of Features; largest: cost of the least possible match; inside: first and
    last column of the target that exist, beyond which half is paid; planes: float32 (r, c, 3);
    selected: bool (r, c)
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
            if x - beyond < inside[0] or x - label > inside[1]:
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
def edge_weights(fine, roots, by_step, across, down, first, last):
    """
    Write how much the planes of neighbours have to agree: float32 (r, c), to the left and up.

    fine: uint16, grey of the half-size image with a margin; roots: int32 (256,), of grey, by
    which noise is alike everywhere; by_step: float32, the weight by the difference of two roots
    """
    for row in range(first, last):
        line, above = fine[row + MARGIN], fine[row + MARGIN - 1]
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
def rank_regions(begin, end, row_starts, region, doubts, work, cells, doubt, worked):
    """
    Sum up what is known of regions: int64 (N,), their cells, doubt, and proposals so far.

    begin, end, row_starts, region: runs of rows and their regions, see weak_regions.py; doubts,
    work: uint8 (r, c)
    """
    cells[:] = doubt[:] = worked[:] = 0
    for row in range(row_starts.size - 1):
        for run in range(row_starts[row], row_starts[row + 1]):
            mine = region[run]
            if mine < 0:
                continue
            cells[mine] += end[run] - begin[run]
            for column in range(begin[run], end[run]):
                doubt[mine] += doubts[row, column]
                worked[mine] += work[row, column]


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
def list_chosen(begin, end, row_starts, region, numbers, starts, ends, pixels, labels, selected,
                work):
    """
    List the cells of the chosen regions, and count that they are worked on.

    starts: int32 (n + 1,); ends: int32 (n,), memory; pixels: int32, those of region i are
    pixels[starts[i]:starts[i + 1]]; labels: int32 (r, c), its number; selected: bool (r, c)
    """
    ends[:] = starts[:-1]
    selected[:] = False
    for row in range(row_starts.size - 1):
        for run in range(row_starts[row], row_starts[row + 1]):
            mine = numbers[region[run]] if region[run] >= 0 else -1
            if mine < 0:
                continue
            for column in range(begin[run], end[run]):
                pixels[ends[mine]] = row * selected.shape[1] + column
                ends[mine] += 1
                labels[row, column], selected[row, column] = mine, True
                work[row, column] = min(work[row, column] + 1, 255)


@kernel
def propose_planes(planes, labels, region_planes, settled, highest, selected, proposal,
                   disparities):
    """
    Write a proposal: the selected cells have the planes of their regions, others their own.

    planes, proposal: float32 (r, c, 3); labels: int32 (r, c); region_planes: float32 (n, 3);
    settled: uint8 (tile rows, tile columns), 0 where nothing is proposed; highest: px;
    disparities: float32 (r, c), px, of the proposal where it is selected
    """
    for row in range(labels.shape[0]):
        for column in range(labels.shape[1]):
            selected[row, column] &= settled[2 * row // TILE, 2 * column // TILE] > 0
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


@inlined
def _like(fine, y, x, row, column, down, right, shape):
    """Return the cell around a pixel, (row, column) before it, that is most like it in grey."""
    grey = np.int32(fine[y + MARGIN, x + MARGIN])
    best_row, best, least = row, column, np.int32(1 << 30)
    for r in range(row, min(row + (y - down) % 2 + 1, shape[0])):
        for c in range(column, min(column + (x - right) % 2 + 1, shape[1])):
            unlike = abs(np.int32(fine[2 * r + down + MARGIN, 2 * c + right + MARGIN]) - grey)
            if unlike < least:
                least, best_row, best = unlike, r, c
    return best_row, best


@inlined
def _spread(planes, evolved, row, apart, lines):
    """Write of the cells of a row: disparity, slope, fall, and how far labels may lie from it."""
    columns = evolved.shape[1]
    middle, slopes, falls, slack = lines[0], lines[1], lines[2], lines[3]
    for column in range(columns):
        slope, fall = planes[row, column, 0], planes[row, column, 1]
        middle[column] = (slope * np.float32(column) + fall * np.float32(row)
                          + planes[row, column, 2])
        slopes[column], falls[column] = slope, fall
        slack[column] = apart - _ROUNDING if evolved[row, column] else np.float32(np.inf)
    lines[:, columns] = lines[:, columns - 1]


@inlined
def _is_far(lines, place, right, down, label):
    """Return whether the plane of a cell is far from a label so many px from the cell."""
    disparity = lines[0, place] + lines[1, place] * right + lines[2, place] * down
    return abs(disparity - label) > lines[3, place]


@kernel
def _doubted(upper, lower, down, side, labels, begin, doubted):
    """
    Write which pixels are far from the plane of a cell around them; return how many.

    upper, lower: of the cells above and below, see _spread; down, side: 1 for the lower and the
    right ones of a cell's four pixels; labels: of the row, every other one from `begin` on;
    doubted: uint8
    """
    # indices without a sign, else this is no loop of vectors
    number, half = 0, np.float32(0.5)
    above, below, before, after = (half * np.float32(down), half * np.float32(-down),
                                   half * np.float32(side), half * np.float32(-side))
    for column in range(doubted.size):
        label = np.float32(labels[np.uint64(2 * column + begin)])
        one, two = np.uint64(column), np.uint64(column + side)
        found = (_is_far(upper, one, before, above, label)
                 | _is_far(upper, two, after, above, label)
                 | _is_far(lower, one, before, below, label)
                 | _is_far(lower, two, after, below, label))
        doubted[one] = found
        number += found
    return number


@kernel
def write_labels(planes, evolved, trusted, fine, down, right, apart, highest, chromosome, labels,
                 offsets, verdict, lines, doubted, first, last):
    """
    Give pixels around evolved cells the labels of their planes.

    A pixel belongs to the cell around it that is most like it in grey. Labels that differ from
    the chromosome's by less than `apart` px stay.

    evolved: uint8, trusted: bool (r, c); fine: uint16, grey of the full image with a margin;
    chromosome, labels: (R, C) labels, offsets: int8 (R, C), verdict: uint8 (R, C), written; lines:
    float32 (2, 4, c + 1), doubted: uint8 (c,), memory; first, last: rows of cells
    """
    (rows, columns), half = evolved.shape, np.float32(0.5)
    _spread(planes, evolved, first, apart, lines[first & 1])
    for row in range(first, last):
        _spread(planes, evolved, min(row + 1, rows - 1), apart, lines[(row + 1) & 1])
        for y in range(2 * row + down, min(2 * row + down + 2, chromosome.shape[0])):
            lower = y - 2 * row - down
            for side in range(2):
                # few pixels differ by so much from any plane around them
                there = doubted[:min(columns, (chromosome.shape[1] - right - side + 1) // 2)]
                if _doubted(lines[row & 1], lines[(row + lower) & 1], lower, side, chromosome[y],
                            right + side, there) == 0:
                    continue
                for column in range(there.size):
                    if not doubted[column]:
                        continue
                    x = 2 * column + right + side
                    r, c = _like(fine, y, x, row, column, down, right, evolved.shape)
                    if not evolved[r, c]:
                        continue
                    disparity = (planes[r, c, 0] * (half * np.float32(x - right))
                                 + planes[r, c, 1] * (half * np.float32(y - down))
                                 + planes[r, c, 2])
                    disparity = min(max(disparity, np.float32(0)), highest)
                    if abs(disparity - np.float32(chromosome[y, x])) < apart:
                        continue
                    label = np.int64(np.rint(disparity))
                    chromosome[y, x] = labels[y, x] = label
                    offsets[y, x] = np.int64(np.rint((disparity - np.float32(label))
                                                     * np.float32(STEPS)))
                    verdict[y, x] = CONSISTENT if trusted[r, c] else REFUSED
