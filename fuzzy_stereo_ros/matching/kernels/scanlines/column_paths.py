# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The paths from above and below complete the sums, of which labels are chosen: a column of tiles.

Columns are independent. Paths from below start some rows below a row of tiles, paths from above at
the top of the image.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_short, repeat_bytes, splat_word, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.scanlines.four import (
    add_four, advance_four, first_of_four, load_four, lowest_of_four, mask_four, splat_four,
    store_four, store_packed, unpacked, without_least)
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import (
    advance, clear, in_registers, step)
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import columns_of, row_start
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import (
    best_label, choose_of_target, fit_offsets, least_elsewhere, MIDDLE, NEAR_LABELS)
from fuzzy_stereo_ros.matching.kernels.simd import (
    LANES, lanes_of, load, lowest, prefetch, splat, store, subtract)
import numpy as np

CACHE_LINE = 64      # bytes
OVERLAP = 16         # rows below a row of tiles where its paths from below start


@inlined
def _note(scratch, column, best, totals, at):
    """Write the label of a pixel and the sums beside it; its sums are at totals + at."""
    store_short(scratch.chosen, column, best)
    store_byte(scratch.least_below, column, load_byte(totals, at + best - 1))
    store_byte(scratch.least_above, column, load_byte(totals, at + best + 1))


@inlined
def _choose_four(penalty, search, scratch, width, at, size, out):
    """
    Move the upward paths of a tile's columns on by a row and choose their labels, four at once.

    penalty: P1, a vector of all labels; at: where the costs and sums of column 0
    are, in rows of `size` bytes; out: that of its results. Returns how many columns are done.
    """
    costs, sums, totals, lanes = scratch.costs, scratch.sums, scratch.labels, lanes_of(penalty)
    column = place = 0
    while column + 4 <= width:
        for line in range(0, 4 * lanes, CACHE_LINE):
            prefetch(costs, at - size + line)
            prefetch(sums, at - size + line)
        paths = advance_four(load_four(penalty, scratch.up, place, lanes),
                             splat_four(penalty, scratch.jumps, column, 1), penalty,
                             load_four(penalty, costs, at, lanes))
        store_four(scratch.up, place, lanes, without_least(paths))
        four = add_four(load_four(penalty, sums, at, lanes), paths)
        store_four(totals, LANES, lanes, four)
        cheapest = lowest_of_four(four)
        best = first_of_four(four, unpacked(penalty, cheapest))
        elsewhere = lowest_of_four(mask_four(four, NEAR_LABELS, MIDDLE, best))
        store_packed(search.sums, out + column, cheapest)
        store_packed(search.margins, out + column, subtract(elsewhere, cheapest))
        _note(scratch, column, best[0], totals, LANES)
        _note(scratch, column + 1, best[1], totals, LANES + lanes)
        _note(scratch, column + 2, best[2], totals, LANES + 2 * lanes)
        _note(scratch, column + 3, best[3], totals, LANES + 3 * lanes)
        place += 4 * lanes
        at += 4 * lanes
        column += 4
    return column


@inlined
def _choose_columns(search, scratch, blocks, begin, end, at, out):
    """
    Move the upward paths of one tile's columns begin .. end on by a row and choose their labels.

    at: where the costs and sums of the tile's column 0 are; out: where its results are.
    """
    penalty, sums = splat(np.uint8(search.small)), scratch.sums
    for column in range(begin, end):
        place = LANES * blocks * column
        step(scratch.up + place, blocks, splat_word(penalty, scratch.jumps, column), penalty,
             scratch.costs + at + place, sums + at + place, False)
        best, cheapest = best_label(sums, at + place, blocks)
        store_byte(search.sums + out, column, cheapest)
        store_byte(search.margins + out, column,
                   least_elsewhere(sums, at + place, blocks, best) - cheapest)
        _note(scratch, column, best, sums, at + place)


@inlined
def _hand_over(search, at, width, scratch):
    """Write the labels and offsets of a row of a tile; offsets of the end labels are 0."""
    chosen, below, above = scratch.chosen, scratch.least_below, scratch.least_above
    sums, last = search.sums + at, np.uint16(search.disparities - 1)
    for column in range(width):
        label, least = load_short(chosen, column), load_byte(sums, column)
        at_end = (label == 0) | (label == last)
        store_byte(below, column, least if at_end else load_byte(below, column))
        store_byte(above, column, least if at_end else load_byte(above, column))
    fit_offsets(below, sums, above, width, search.offsets + at)
    if search.label_bytes == 1:
        for column in range(width):
            store_byte(search.labels + at, column, np.uint8(load_short(chosen, column)))
    else:
        for column in range(width):
            store_short(search.labels + 2 * at, column, load_short(chosen, column))


@inlined
def _down_four(penalty, scratch, width, at, size, paths):
    """
    Run the paths from above through a tile's columns of a row, four at once; add them to the sums.

    penalty, at, size: as of _choose_four; paths: address. Returns how many columns are done.
    """
    costs, sums, lanes = scratch.costs, scratch.sums, lanes_of(penalty)
    column = place = 0
    while column + 4 <= width:
        for line in range(0, 4 * lanes, CACHE_LINE):
            prefetch(costs, at + size + line)
            prefetch(sums, at + size + line)
        four = advance_four(load_four(penalty, paths, place, lanes),
                            splat_four(penalty, scratch.jumps, column, 1), penalty,
                            load_four(penalty, costs, at, lanes))
        store_four(sums, at, lanes, add_four(load_four(penalty, sums, at, lanes), four))
        store_four(paths, place, lanes, without_least(four))
        place += 4 * lanes
        at += 4 * lanes
        column += 4
    return column


@inlined
def _add_downwards(search, scratch, tile, first, last, paths):
    """Run the paths from above through rows first .. last - 1 of a tile, and add them to sums."""
    begin, end = columns_of(search, tile)
    size, blocks, penalty = search.row_size, search.blocks, splat(np.uint8(search.small))
    for row in range(first, last):
        jumps = row * search.columns
        at = row_start(search, scratch, row) + begin * LANES * blocks
        repeat_bytes(search.down, jumps + begin, jumps + end, scratch.jumps, 0)
        middle = in_registers(_down_four, search.small, blocks, scratch, end - begin, at, size,
                              paths)
        for column in range(middle, end - begin):
            place = LANES * blocks * column
            step(paths + place, blocks, splat_word(penalty, scratch.jumps, column), penalty,
                 scratch.costs + at + place, scratch.sums + at + place, False)


@inlined
def _step_upwards(search, scratch, tile, row):
    """Move the paths from below of a tile on to a row whose costs are there, without sums."""
    penalty, words, costs = splat(np.uint8(search.small)), scratch.jumps, scratch.costs
    begin, end = columns_of(search, tile)
    blocks, place = search.blocks, 0
    at = row_start(search, scratch, row) + begin * LANES * blocks
    first = min(row + 1, search.rows - 1) * search.columns
    repeat_bytes(search.down, first + begin, first + end, words, 0)
    for index in range(end - begin):
        jump = splat_word(penalty, words, index)
        if blocks == 1:
            path = advance(load(scratch.up, place), jump, penalty, load(costs, at))
            store(scratch.up, place, subtract(path, splat(lowest(path))))
        else:
            step(scratch.up + place, blocks, jump, penalty, costs + at, scratch.unused_sums, True)
        place += LANES * blocks
        at += LANES * blocks


@inlined
def _choose_rows(search, scratch, tile, first, last):
    """Choose the labels of the rows first .. last - 1 of a tile; its paths are those of `last`."""
    begin, end = columns_of(search, tile)
    blocks, size, width = search.blocks, search.row_size, end - begin
    start = row_start(search, scratch, first) + begin * LANES * blocks
    for row in range(last - 1, first - 1, -1):
        jumps = min(row + 1, search.rows - 1) * search.columns
        repeat_bytes(search.down, jumps + begin, jumps + end, scratch.jumps, 0)
        at, out = start + (row - first) * size, row * search.columns + begin
        middle = in_registers(_choose_four, search.small, blocks, search, scratch, width, at, size,
                              out)
        _choose_columns(search, scratch, blocks, middle, width, at, out)
        _hand_over(search, out, width, scratch)


@inlined
def _complete(search, scratch, tile, tile_row):
    """Complete the sums of a tile, below the one that is done, and choose its labels."""
    begin, end = columns_of(search, tile)
    first, last = tile_row * search.tile, min((tile_row + 1) * search.tile, search.rows)
    down = scratch.down + begin * scratch.path_size
    if tile_row == 0:
        clear(down, 0, search.blocks * (end - begin))
    _add_downwards(search, scratch, tile, first, last, down)
    start = min((tile_row + 1) * search.tile + OVERLAP, search.rows) - 1
    clear(scratch.up, 0, search.blocks * (end - begin))
    for row in range(start, last - 1, -1):
        _step_upwards(search, scratch, tile, row)
    _choose_rows(search, scratch, tile, first, last)


@called
def down_and_up(search, scratch, tile, first, last):
    """
    Complete the sums of a column of tiles in the rows of tiles first .. last - 1; choose labels.

    The tiles above are done, and costs are there for the rows on to OVERLAP below them.
    """
    for tile_row in range(first, last):
        _complete(search, scratch, tile, tile_row)


@called
def choose_of_targets(search, scratch, first, last):
    """Choose the labels of the target's rows first .. last - 1, once those of the pixels are."""
    for row in range(first, last):
        at = row * search.columns
        choose_of_target(search.labels + at * search.label_bytes, search.label_bytes,
                         search.sums + at, search.columns, scratch.offers,
                         search.target + row * search.target_columns, search.target_columns)
