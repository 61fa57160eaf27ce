# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which cells of a grid of plane genes, see grid.py, get a proposal, and which planes."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.planes.plane import disparity_at, plane_at
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np


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
def reject_bent(planes, region_pixels, disparities, trusted, near, share, selected):
    """
    Reject regions of which too few trusted pixels lie near their planes.

    planes: float32 (n, 3); region_pixels: the fields of fits.RegionPixels; near: px; share: of the
    trusted pixels; disparities: float32 (R, C), px; trusted: bool (R, C); selected: bool (R, C),
    set to false in regions that are rejected
    """
    starts, pixels = region_pixels
    columns = selected.shape[1]
    for region in range(planes.shape[0]):
        plane, mine = planes[region], pixels[starts[region]:starts[region + 1]]
        known = agreeing = 0
        for pixel in mine:
            row, column = pixel // columns, pixel % columns
            if trusted[row, column]:
                known += 1
                agreeing += abs(
                    disparity_at(plane, column, row) - disparities[row, column]) < near
        if agreeing < share * max(known, 1):
            for pixel in mine:
                selected[pixel // columns, pixel % columns] = False


@kernel
def propose_planes(regions, quiet, highest, selected, proposed, first, last):
    """
    Write rows of a proposal: selected cells have the planes of their regions.

    regions: int32 (r, c), the region of each selected cell, and float32 (n, 3), the planes of
    regions; quiet: uint8 (tile rows, tile columns), 0 where nothing is proposed; highest: px;
    selected: bool (r, c), set to false there; proposed: float32 (r, 3, c), and float32 (r, c),
    the disparities, px, written where selected
    """
    (labels, region_planes), (proposal, disparities) = regions, proposed
    for row in range(first, last):
        for column in range(labels.shape[1]):
            selected[row, column] &= quiet[2 * row // TILE, 2 * column // TILE] > 0
            if selected[row, column]:
                mine = labels[row, column]
                for part in range(3):
                    proposal[row, part, column] = region_planes[mine, part]
                disparities[row, column] = min(max(disparity_at(
                    plane_at(proposal, row, column), column, row), np.float32(0)), highest)


@kernel
def select_stale(evolved, current, disparities, apart, selected, first, last):
    """
    Select evolved cells more than `apart` px from a map.

    evolved: uint8 (r, c); current: float32 (r, c), px, of the genes; disparities: of the map;
    selected: bool (r, c)
    """
    for row in range(first, last):
        mine, found, genes, chosen = current[row], disparities[row], evolved[row], selected[row]
        for column in range(chosen.size):
            chosen[column] = (genes[column] > 0) & (abs(mine[column] - found[column]) > apart)


@kernel
def mark_taken(cells, taken, kind, evolved):
    """Write whether the genes of the taken cells have evolved: uint8 (r, c)."""
    flat = evolved.reshape(-1)
    for index in range(cells.size):
        if taken[index]:
            flat[cells[index]] = kind
