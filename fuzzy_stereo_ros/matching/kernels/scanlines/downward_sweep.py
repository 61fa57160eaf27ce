# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The sweep downwards: costs of some rows, then the paths that come from left, right and above.

Up to four rows at once: the downward paths go through all of them while their costs are near.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import load_long, repeat_bytes, splat_word
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import box_row, cost_rows, raw_row
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import (
    advance, carry, clear, in_registers, step)
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_paths import (
    costs_and_rightwards_four, left_and_down, left_and_down_four, rightwards, rightwards_four,
    ROWS_AT_ONCE, TileRows)
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import columns_of, row_start, window_of
from fuzzy_stereo_ros.matching.kernels.simd import LANES, load, lowest, splat, store, subtract
import numpy as np


@kernel
def fill_costs(search, scratch, row, is_start):
    """Write the costs of a row, all its tiles; rows come in order, `is_start` for the first."""
    if search.box > 0:
        fill_box_costs(search, scratch, row, is_start)
        return
    at = row_start(search, scratch, row)
    for tile in range(search.tile_columns):
        begin, end = columns_of(search, tile)
        low, blocks, offset = window_of(search, row // search.tile, tile)
        cost_rows(search, row, 1, begin, end, low, blocks, scratch.costs, at + offset, 0,
                  scratch.codes, scratch.priors)


@kernel
def fill_box_costs(search, scratch, row, is_start):
    """Write a row of sums of 3 x 3 pixels / 2**box, without priors, all tiles alike."""
    ring, blocks = scratch.ring, window_of(search, 0, 0)[1]
    size, newest = search.columns * LANES * blocks, min(row + 1, search.rows - 1)
    for near in range(max(row - 1, 0) if is_start else newest, newest + 1):
        raw_row(search, near, blocks, ring, near % 3 * size, scratch.codes)
    box_row(search, ring + max(row - 1, 0) % 3 * size, ring + row % 3 * size,
            ring + newest % 3 * size, blocks, scratch.costs, row_start(search, scratch, row))


@inlined
def _enter_tile(paths, path, count, window, previous, labels):
    """Carry the horizontal paths of some rows into the window of a tile."""
    low, blocks, _ = window
    old_low, old_blocks, _ = previous
    if low != old_low or blocks != old_blocks:
        for near in range(count):
            carry(paths, near * path, old_blocks, old_low, paths, near * path, blocks, low, labels)


@inlined
def _rows_of(search, scratch, row, tile, offset):
    """Return the TileRows of a tile whose costs lie at an offset in those of the rows."""
    begin, end = columns_of(search, tile)
    at = row_start(search, scratch, row) + offset
    return TileRows(
        begin, end, load_long(search.row_size, row // search.tile), scratch.costs + at,
        scratch.sums + at, scratch.down + offset, scratch.words, scratch.across, scratch.below,
        scratch.chain, scratch.chains, search.small)


@inlined
def sweep_rows(search, scratch, row, count):
    """Run the paths from left, right and above through `count` rows; costs of boxes are there."""
    chains, chain, columns, tile_row = (
        scratch.chains, scratch.chain, search.columns, row // search.tile)
    for near in range(count):
        first = (row + near) * columns
        repeat_bytes(search.across, first, first + columns, scratch.across, near * scratch.words)
        repeat_bytes(search.down, first, first + columns, scratch.below, near * scratch.words)
    previous = window_of(search, tile_row, 0)
    clear(chains, 0, 4 * chain // LANES)
    for tile in range(search.tile_columns):
        window = window_of(search, tile_row, tile)
        _enter_tile(chains, chain, count, window, previous, scratch.labels)
        low, blocks, offset = previous = window
        rows = _rows_of(search, scratch, row, tile, offset)
        done = 0
        if count == ROWS_AT_ONCE and search.box > 0:
            done = in_registers(rightwards_four, search.small, blocks, rows)
        elif count == ROWS_AT_ONCE:
            done = in_registers(costs_and_rightwards_four, search.small, blocks, search, scratch,
                                rows, row, low)
        if done == 0:
            if search.box == 0:
                cost_rows(search, row, count, rows.begin, rows.end, low, blocks, rows.costs, 0,
                          rows.size, scratch.codes, scratch.priors)
            rightwards(rows, blocks, count)
    clear(chains, 0, 4 * chain // LANES)
    for tile in range(search.tile_columns - 1, -1, -1):
        window = window_of(search, tile_row, tile)
        _enter_tile(chains, chain, count, window, previous, scratch.labels)
        _, blocks, offset = previous = window
        rows = _rows_of(search, scratch, row, tile, offset)
        done = 0
        if count == ROWS_AT_ONCE and rows.end - rows.begin >= ROWS_AT_ONCE:
            done = in_registers(left_and_down_four, search.small, blocks, rows)
        if done == 0:
            left_and_down(rows, blocks, rows.begin, rows.end, 0, count)


@kernel
def step_tile(search, scratch, paths, place, tile, row, jump_row):
    """
    Move the vertical paths of a tile on to a row whose costs are there.

    paths: those of the tile from index `place`; jump_row: the row whose P2 upwards is crossed.
    """
    penalty, words, costs = splat(np.uint8(search.small)), scratch.across, scratch.costs
    begin, end = columns_of(search, tile)
    _, blocks, offset = window_of(search, row // search.tile, tile)
    at = row_start(search, scratch, row) + offset
    first = jump_row * search.columns
    repeat_bytes(search.down, first + begin, first + end, words, 0)
    for index in range(end - begin):
        jump = splat_word(penalty, words, index)
        if blocks == 1:
            path = advance(load(paths, place), jump, penalty, load(costs, at))
            store(paths, place, subtract(path, splat(lowest(path))))
        else:
            step(paths, place, blocks, jump, penalty, costs, at, scratch.outside, 0, True)
        place += LANES * blocks
        at += LANES * blocks
