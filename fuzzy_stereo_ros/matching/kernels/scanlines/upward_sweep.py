# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The sweep upwards: the paths from below complete the sums, of which labels are chosen."""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_long, load_short, repeat_bytes, splat_word, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import advance, in_registers, step
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import columns_of, row_start, window_of
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import (
    best_label, fit_offsets, least_elsewhere, lowest_of_four, MIDDLE, NEAR, store_four, unpacked,
    without_least)
from fuzzy_stereo_ros.matching.kernels.simd import (
    bit_or, first_equal, LANES, lanes_of, load_like, prefetch, saturating_add, splat, store,
    subtract)
import numpy as np


CACHE_LINE = 64      # bytes


@inlined
def _note(column, best, low, at, totals, labels, below, above):
    """Write the label of a pixel and the sums beside it; its sums are at totals + at."""
    store_short(labels, column, low + best)
    store_byte(below, column, load_byte(totals, at + best - 1))
    store_byte(above, column, load_byte(totals, at + best + 1))


@inlined
def _choose_single(search, scratch, low, width, at, size, out, penalty):
    """Process four columns at once in registers, as _choose_tile; return the number processed."""
    costs, sums, paths, totals = scratch.costs, scratch.sums, scratch.up, scratch.labels
    jumps, labels, below, above = (scratch.across, scratch.chosen, scratch.least_below,
                                   scratch.least_above)
    least_sums, margins = search.sums + out, search.margins + out
    one = lanes_of(penalty)
    two, three = 2 * one, 3 * one
    column = place = 0
    while column + 4 <= width:
        for line in range(0, 4 * one, CACHE_LINE):
            prefetch(costs, at - size + line)
            prefetch(sums, at - size + line)
        path_0 = advance(load_like(penalty, paths, place),
                         splat_word(penalty, jumps, column), penalty,
                         load_like(penalty, costs, at))
        path_1 = advance(load_like(penalty, paths, place + one),
                         splat_word(penalty, jumps, column + 1), penalty,
                         load_like(penalty, costs, at + one))
        path_2 = advance(load_like(penalty, paths, place + two),
                         splat_word(penalty, jumps, column + 2), penalty,
                         load_like(penalty, costs, at + two))
        path_3 = advance(load_like(penalty, paths, place + three),
                         splat_word(penalty, jumps, column + 3), penalty,
                         load_like(penalty, costs, at + three))
        left_0, left_1, left_2, left_3 = without_least(path_0, path_1, path_2, path_3)
        store(paths, place, left_0)
        store(paths, place + one, left_1)
        store(paths, place + two, left_2)
        store(paths, place + three, left_3)
        total_0 = saturating_add(load_like(penalty, sums, at), path_0)
        total_1 = saturating_add(load_like(penalty, sums, at + one), path_1)
        total_2 = saturating_add(load_like(penalty, sums, at + two), path_2)
        total_3 = saturating_add(load_like(penalty, sums, at + three), path_3)
        store(totals, LANES, total_0)
        store(totals, LANES + one, total_1)
        store(totals, LANES + two, total_2)
        store(totals, LANES + three, total_3)
        cheapest = lowest_of_four(total_0, total_1, total_2, total_3)
        floor_0, floor_1, floor_2, floor_3 = unpacked(penalty, cheapest)
        best_0 = first_equal(total_0, floor_0)
        best_1 = first_equal(total_1, floor_1)
        best_2 = first_equal(total_2, floor_2)
        best_3 = first_equal(total_3, floor_3)
        elsewhere = lowest_of_four(
            bit_or(total_0, load_like(penalty, NEAR, MIDDLE - best_0)),
            bit_or(total_1, load_like(penalty, NEAR, MIDDLE - best_1)),
            bit_or(total_2, load_like(penalty, NEAR, MIDDLE - best_2)),
            bit_or(total_3, load_like(penalty, NEAR, MIDDLE - best_3)))
        store_four(least_sums, column, cheapest)
        store_four(margins, column, subtract(elsewhere, cheapest))
        _note(column, best_0, low, LANES, totals, labels, below, above)
        _note(column + 1, best_1, low, LANES + one, totals, labels, below, above)
        _note(column + 2, best_2, low, LANES + two, totals, labels, below, above)
        _note(column + 3, best_3, low, LANES + three, totals, labels, below, above)
        place += 4 * one
        at += 4 * one
        column += 4
    return column


@inlined
def _choose_tile(blocks, low, begin, end, at, costs, sums, jumps, small, paths, place, totals,
                 labels, least_sums, margins, below, above):
    """Move the upward paths of one tile's columns on by a row and choose their labels."""
    penalty = splat(np.uint8(small))
    for column in range(begin, end):
        step(paths, place, blocks, splat_word(penalty, jumps, column), penalty, costs, at, sums,
             at, False)
        best, cheapest = best_label(sums, at, blocks)
        store_byte(least_sums, column, cheapest)
        store_byte(margins, column, least_elsewhere(sums, at, blocks, best) - cheapest)
        _note(column, best, low, at, sums, labels, below, above)
        place += LANES * blocks
        at += LANES * blocks


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
    costs, sums, paths, totals = scratch.costs, scratch.sums, scratch.up, scratch.labels
    words, chosen, below, above = (scratch.across, scratch.chosen, scratch.least_below,
                                   scratch.least_above)
    tile_row = first // search.tile
    penalty, of_two, of_four = in_registers(search.small)
    low, blocks, offset = window_of(search, tile_row, tile)
    begin, end = columns_of(search, tile)
    size, start = load_long(search.row_size, tile_row), row_start(search, scratch, first) + offset
    width, high = end - begin, min(low + LANES * blocks, search.disparities) - 1
    for row in range(last - 1, first - 1, -1):
        jumps = min(row + 1, search.rows - 1) * search.columns
        repeat_bytes(search.down, jumps + begin, jumps + end, words, 0)
        at, middle, out = start + (row - first) * size, 0, row * search.columns + begin
        if blocks == 1:
            middle = _choose_single(search, scratch, low, width, at, size, out, penalty)
        elif blocks == 2:
            middle = _choose_single(search, scratch, low, width, at, size, out, of_two)
        elif blocks == 4:
            middle = _choose_single(search, scratch, low, width, at, size, out, of_four)
        ahead = LANES * blocks * middle
        _choose_tile(blocks, low, middle, width, at + ahead, costs, sums, words, search.small,
                     paths, ahead, totals, chosen, search.sums + out, search.margins + out, below,
                     above)
        _hand_over(search, out, width, low, high, scratch)
