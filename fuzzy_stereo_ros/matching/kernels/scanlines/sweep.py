# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A scanline chromosome of a band of rows, one row of tiles after the other: down, then up.

The upward paths of a row of tiles start some rows below it, the downward paths of a band so many
rows above: bands are cut by the pair, so that threads never change a result.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import load_long
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.scanlines.downward_sweep import (
    fill_box_costs, fill_costs, step_tile, sweep_rows)
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import carry, clear, copy
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_paths import ROWS_AT_ONCE
from fuzzy_stereo_ros.matching.kernels.scanlines.upward_sweep import choose_tile
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    columns_of, Scratch, Search, window_of)
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import choose_of_target
from fuzzy_stereo_ros.matching.kernels.simd import LANES


@inlined
def _carry_tile(search, tile, tile_row, paths, at, new_tile_row, new_paths, new_at, labels):
    """
    Carry the vertical paths of a tile's columns to the window of the tile below or above.

    paths, new_paths: addresses, from index at and new_at on; returns where the new ones end.
    """
    begin, end = columns_of(search, tile)
    low, blocks, _ = window_of(search, tile_row, tile)
    new_low, new_blocks, _ = window_of(search, new_tile_row, tile)
    for _ in range(end - begin):
        carry(paths, at, blocks, low, new_paths, new_at, new_blocks, new_low, labels)
        at += LANES * blocks
        new_at += LANES * new_blocks
    return new_at


@inlined
def _carry_down(search, scratch, tile_row):
    """Carry the downward paths of all tiles to the windows of the row of tiles below."""
    for tile in range(search.tile_columns):
        _carry_tile(search, tile, tile_row - 1, scratch.down,
                    window_of(search, tile_row - 1, tile)[2], tile_row, scratch.carried,
                    window_of(search, tile_row, tile)[2], scratch.labels)
    copy(scratch.carried, scratch.down, load_long(search.row_size, tile_row))


@kernel
def downwards(search, scratch, start, first, row, until, below):
    """
    Fill the sums of the rows row .. until - 1, and the costs of those on to below - 1.

    search, scratch: the fields of a Search and of a Scratch; start: the row that the downward
    paths start at; first: the first one of the band, to which they come without sums.
    """
    search, scratch = Search(*search), Scratch(*scratch)
    if row == first:
        clear(scratch.down, 0, load_long(search.row_size, start // search.tile) // LANES)
        for near in range(start, first):
            fill_costs(search, scratch, near, near == start)
            if near > start and near % search.tile == 0:
                _carry_down(search, scratch, near // search.tile)
            for tile in range(search.tile_columns):
                place = window_of(search, near // search.tile, tile)[2]
                step_tile(search, scratch, scratch.down, place, tile, near, near)
    while row < until:
        tile_row = row // search.tile
        if row > start and row % search.tile == 0:
            _carry_down(search, scratch, tile_row)
        count = min(ROWS_AT_ONCE, min((tile_row + 1) * search.tile, until) - row)
        if search.box > 0:
            for near in range(row, row + count):
                fill_box_costs(search, scratch, near, near == start)
        sweep_rows(search, scratch, row, count)
        row += count
    for near in range(row, below):
        fill_costs(search, scratch, near, False)


@kernel
def upwards(search, scratch, first, last, start):
    """Choose the labels of the rows first .. last - 1, by paths that start at row `start`."""
    search, scratch = Search(*search), Scratch(*scratch)
    for tile in range(search.tile_columns):
        begin, end = columns_of(search, tile)
        blocks = window_of(search, start // search.tile, tile)[1]
        clear(scratch.up, 0, blocks * (end - begin))
        # on to last - 1, into whose window the paths are carried too
        for row in range(start, last - 2, -1):
            tile_row = row // search.tile
            if row < start and (row + 1) % search.tile == 0:
                size = _carry_tile(search, tile, tile_row + 1, scratch.up, 0, tile_row,
                                   scratch.carried, 0, scratch.labels)
                copy(scratch.carried, scratch.up, size)
            if row >= last:
                step_tile(search, scratch, scratch.up, 0, tile, row,
                          min(row + 1, search.rows - 1))
        choose_tile(search, scratch, tile, first, last)
    for row in range(first, last):
        at = row * search.columns
        choose_of_target(search.labels + at * search.label_bytes, search.label_bytes,
                         search.sums + at, search.columns, scratch.offers,
                         search.target + row * search.target_columns, search.target_columns)
