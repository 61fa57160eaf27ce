# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The sweep upwards: the paths from below complete the sums, of which labels are chosen."""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_long, load_short, repeat_bytes, splat_word, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.scanlines.four import (
    add_four, advance_four, first_of_four, load_four, lowest_of_four, mask_four, splat_four,
    store_four, store_packed, unpacked, without_least)
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import in_registers, step
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import columns_of, row_start, window_of
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import (
    best_label, fit_offsets, least_elsewhere, MIDDLE, NEAR)
from fuzzy_stereo_ros.matching.kernels.simd import LANES, lanes_of, prefetch, splat, subtract
import numpy as np


CACHE_LINE = 64      # bytes


@inlined
def _note(scratch, column, best, low, totals, at):
    """Write the label of a pixel and the sums beside it; its sums are at totals + at."""
    store_short(scratch.chosen, column, low + best)
    store_byte(scratch.least_below, column, load_byte(totals, at + best - 1))
    store_byte(scratch.least_above, column, load_byte(totals, at + best + 1))


@inlined
def _choose_four(penalty, search, scratch, low, width, at, size, out):
    """Process four columns at once in registers, as _choose_tile; return the number processed."""
    costs, sums, totals, lanes = scratch.costs, scratch.sums, scratch.labels, lanes_of(penalty)
    column = place = 0
    while column + 4 <= width:
        for line in range(0, 4 * lanes, CACHE_LINE):
            prefetch(costs, at - size + line)
            prefetch(sums, at - size + line)
        paths = advance_four(load_four(penalty, scratch.up, place, lanes),
                             splat_four(penalty, scratch.across, column, 1), penalty,
                             load_four(penalty, costs, at, lanes))
        store_four(scratch.up, place, lanes, without_least(paths))
        four = add_four(load_four(penalty, sums, at, lanes), paths)
        store_four(totals, LANES, lanes, four)
        cheapest = lowest_of_four(four)
        best = first_of_four(four, unpacked(penalty, cheapest))
        elsewhere = lowest_of_four(mask_four(four, NEAR, MIDDLE, best))
        store_packed(search.sums, out + column, cheapest)
        store_packed(search.margins, out + column, subtract(elsewhere, cheapest))
        _note(scratch, column, best[0], low, totals, LANES)
        _note(scratch, column + 1, best[1], low, totals, LANES + lanes)
        _note(scratch, column + 2, best[2], low, totals, LANES + 2 * lanes)
        _note(scratch, column + 3, best[3], low, totals, LANES + 3 * lanes)
        place += 4 * lanes
        at += 4 * lanes
        column += 4
    return column


@inlined
def _choose_tile(search, scratch, blocks, low, begin, end, at, out):
    """
    Move the upward paths of one tile's columns begin .. end on by a row and choose their labels.

    at: where the costs and sums of the tile's column 0 are.
    """
    penalty, sums = splat(np.uint8(search.small)), scratch.sums
    for column in range(begin, end):
        place = LANES * blocks * column
        step(scratch.up, place, blocks, splat_word(penalty, scratch.across, column), penalty,
             scratch.costs, at + place, sums, at + place, False)
        best, cheapest = best_label(sums, at + place, blocks)
        store_byte(search.sums + out, column, cheapest)
        store_byte(search.margins + out, column,
                   least_elsewhere(sums, at + place, blocks, best) - cheapest)
        _note(scratch, column, best, low, sums, at + place)


@inlined
def _hand_over(search, at, width, low, high, scratch):
    """Write what was chosen for a row of a tile; at the window's ends there is nothing to fit."""
    chosen, below, above = scratch.chosen, scratch.least_below, scratch.least_above
    sums, first, last = search.sums + at, np.uint16(low), np.uint16(high)
    for column in range(width):
        label, least = load_short(chosen, column), load_byte(sums, column)
        at_end = (label == first) | (label == last)
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
def choose_tile(search, scratch, tile, first, last):
    """Choose the labels of the rows first .. last - 1 of a tile; its paths are those of `last`."""
    tile_row = first // search.tile
    low, blocks, offset = window_of(search, tile_row, tile)
    begin, end = columns_of(search, tile)
    size, start = load_long(search.row_size, tile_row), row_start(search, scratch, first) + offset
    width, high = end - begin, min(low + LANES * blocks, search.disparities) - 1
    for row in range(last - 1, first - 1, -1):
        jumps = min(row + 1, search.rows - 1) * search.columns
        repeat_bytes(search.down, jumps + begin, jumps + end, scratch.across, 0)
        at, out = start + (row - first) * size, row * search.columns + begin
        middle = in_registers(_choose_four, search.small, blocks, search, scratch, low, width, at,
                              size, out)
        _choose_tile(search, scratch, blocks, low, middle, width, at, out)
        _hand_over(search, out, width, low, high, scratch)
