# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Costs of some rows, then the paths that come from left and right: rows are independent.

Up to four rows at once, so that their paths are in step.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import load_long, repeat_bytes
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.possibility.costs import box_row, raw_row
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import carry, clear, in_registers
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_paths import (
    cost_rows, costs_and_rightwards_four, leftwards, leftwards_eight, rightwards, rightwards_four,
    ROWS_AT_ONCE, TileRows)
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    columns_of, row_start, window_of)
from fuzzy_stereo_ros.matching.kernels.simd import LANES


@called
def _fill_box_costs(search, scratch, row, is_start):
    """Write a row of sums of 3 x 3 pixels / 2**box, without priors, all tiles alike."""
    raw, blocks = scratch.raw_rows, window_of(search, 0, 0)[1]
    size, newest = search.columns * LANES * blocks, min(row + 1, search.rows - 1)
    for near in range(max(row - 1, 0) if is_start else newest, newest + 1):
        raw_row(search, near, blocks, raw, near % 3 * size, scratch.codes)
    box_row(search, raw + max(row - 1, 0) % 3 * size, raw + row % 3 * size,
            raw + newest % 3 * size, blocks, scratch.costs, row_start(search, scratch, row))


@inlined
def _enter_tile(paths, size, count, window, previous, labels):
    """Carry the horizontal paths of some rows into the window of a tile."""
    new, old = window[:2], previous[:2]
    if new[0] != old[0] or new[1] != old[1]:
        for near in range(count):
            carry(paths + near * size, old, paths + near * size, new, labels)


@inlined
def _begin_paths(search, scratch, row, count):
    """Repeat the jump penalties along some rows for vectors; let their paths begin at 0."""
    for near in range(count):
        first = (row + near) * search.columns
        repeat_bytes(search.across, first, first + search.columns, scratch.jumps,
                     near * scratch.row_words)
    clear(scratch.row_paths, 0, count * scratch.path_size // LANES)


@inlined
def _rows_of(search, scratch, row, tile, offset):
    """Return the TileRows of a tile whose costs lie at an offset in those of the rows."""
    begin, end = columns_of(search, tile)
    at = row_start(search, scratch, row) + offset
    return TileRows(
        begin, end, load_long(search.row_size, row // search.tile), scratch.costs + at,
        scratch.sums + at, scratch.row_words, scratch.jumps, scratch.path_size, scratch.row_paths,
        search.small)


@inlined
def _run_rightwards(search, scratch, row, count):
    """Write the costs of up to four rows, but of boxes, and begin the sums from the left."""
    paths, size, tile_row = scratch.row_paths, scratch.path_size, row // search.tile
    _begin_paths(search, scratch, row, count)
    previous = window_of(search, tile_row, 0)
    for tile in range(search.tile_columns):
        window = window_of(search, tile_row, tile)
        _enter_tile(paths, size, count, window, previous, scratch.labels)
        low, blocks, offset = previous = window
        rows = _rows_of(search, scratch, row, tile, offset)
        done = 0
        if count == 4 and search.box > 0:
            done = in_registers(rightwards_four, search.small, blocks, rows)
        elif count == 4:
            done = in_registers(costs_and_rightwards_four, search.small, blocks, search, scratch,
                                rows, row, low)
        if done == 0:
            if search.box == 0:
                cost_rows(search, scratch, rows, row, count, low, blocks)
            rightwards(rows, blocks, count)


@inlined
def _run_leftwards(search, scratch, row, count):
    """Add the paths from the right to the sums of up to ROWS_AT_ONCE rows."""
    paths, size, tile_row = scratch.row_paths, scratch.path_size, row // search.tile
    _begin_paths(search, scratch, row, count)
    previous = window_of(search, tile_row, search.tile_columns - 1)
    for tile in range(search.tile_columns - 1, -1, -1):
        window = window_of(search, tile_row, tile)
        _enter_tile(paths, size, count, window, previous, scratch.labels)
        _, blocks, offset = previous = window
        rows = _rows_of(search, scratch, row, tile, offset)
        done = 0
        if count == ROWS_AT_ONCE:
            done = in_registers(leftwards_eight, search.small, blocks, rows)
        if done == 0:
            leftwards(rows, blocks, count)


@called
def across(search, scratch, first, last):
    """Write the costs of rows first .. last - 1, and the sums of their paths from the sides."""
    row = first
    while row < last:
        count = min(ROWS_AT_ONCE, min((row // search.tile + 1) * search.tile, last) - row)
        if search.box > 0:
            for near in range(row, row + count):
                _fill_box_costs(search, scratch, near, near == first)
        for near in range(row, row + count, 4):
            _run_rightwards(search, scratch, near, min(4, row + count - near))
        _run_leftwards(search, scratch, row, count)
        row += count
