# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A scanline chromosome in two sweeps over a band of rows: downwards, then upwards.

Rows are computed while their costs are still in the cache. Bands are cut by the image's size and
start `overlap` rows early, so that the number of threads never changes a result.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.choice import (
    best_label, equiangular, least_elsewhere, offer_to_target, total_of)
from fuzzy_stereo_ros.matching.kernels.costs import box_row, cost_row, raw_row
from fuzzy_stereo_ros.matching.kernels.scanlines import (
    across, advance, copy, gather, realign_rows, ROWS_AT_ONCE, step)
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, at_most, bit_or, choose, equal_bits, first_set, lane_numbers, LANES, load, lowest,
    minimum, peek, saturating_add, splat, store, subtract)
from numba import njit
import numpy as np


class Windows(NamedTuple):
    """Which labels each tile searches, and where its costs lie in a packed volume."""

    width: int
    height: int
    low: np.ndarray          # int64 (tile rows, tile columns), the first label
    blocks: np.ndarray       # int64 (tile rows, tile columns), 32 labels each
    offset: np.ndarray       # int64 (tile rows, tile columns), bytes from the start of the row
    row_size: np.ndarray     # int64 (tile rows,), bytes of a row of pixels
    base: np.ndarray         # int64 (tile rows,), bytes before the first row


class Volume(NamedTuple):
    """Costs and sums of all tiles, packed."""

    costs: np.ndarray        # uint8
    sums: np.ndarray         # uint8


class Penalties(NamedTuple):
    """What changes of disparity cost."""

    small: int               # P1, a change by one
    across: np.ndarray       # uint8 (R, C), P2 to the left neighbour
    down: np.ndarray         # uint8 (R, C), P2 to the upper neighbour


class Chosen(NamedTuple):
    """What the sweeps choose."""

    labels: np.ndarray       # uint16 (R, C)
    offsets: np.ndarray      # int8 (R, C), 1/16 px
    sums: np.ndarray         # uint8 (R, C), summed cost of the label
    margins: np.ndarray      # uint8 (R, C), how much worse the best label elsewhere is
    target: np.ndarray       # uint8 (R, C), the target's labels modulo 256


class Scratch(NamedTuple):
    """Working memory of one band."""

    paths: np.ndarray        # uint8, vertical paths of a row of pixels
    other_paths: np.ndarray  # uint8, the same while they are carried to other windows
    least: np.ndarray        # uint8 (C,), their least costs
    chains: np.ndarray       # uint8, horizontal paths of the rows at once
    labels: np.ndarray       # uint8, one pixel's labels
    outside: np.ndarray      # uint8, costs of a row outside the band
    ring: np.ndarray         # uint8, raw costs of the three rows of a box sum
    best_sums: np.ndarray    # uint8 (C + D + 64,)
    best_labels: np.ndarray  # uint8 (C + D + 64,)


@njit(nogil=True, cache=True)
def _fill_box_costs(features, places, row, is_start, blocks, costs, at, ring):
    """Write a row of box sums; rows come in order, so that only the raw row below is new."""
    rows, size = features.slopes.shape[0], features.columns * LANES * blocks
    newest = min(row + 1, rows - 1)
    for near in range(max(row - 1, 0) if is_start else newest, newest + 1):
        raw_row(features, near, blocks, ring, near % 3 * size)
    box_row(ring[max(row - 1, 0) % 3 * size:], ring[row % 3 * size:], ring[newest % 3 * size:],
            features, blocks, places, costs, at)


@njit(nogil=True, cache=True)
def _fill_costs(features, half_prior, previous_prior, windows, row, costs, at):
    """Write the costs of a row of all tiles."""
    tile_row = row // windows.height
    for tile in range(windows.low.shape[1]):
        begin = tile * windows.width
        cost_row(features, half_prior, previous_prior, row, begin,
                 min(begin + windows.width, features.columns), windows.low[tile_row, tile],
                 windows.blocks[tile_row, tile], costs, at + windows.offset[tile_row, tile])


@njit(inline='always')
def _step_tile(blocks, begin, end, place, penalties, small, costs, at, paths, least, sums,
               gathered):
    """Move the vertical paths of one tile's columns on by a row."""
    for column in range(begin, end):
        least[column] = step(paths, place, blocks, peek(least, column), peek(penalties, column),
                             small, costs, at + place)
        if gathered:
            gather(paths, place, blocks, sums, at + place)
        place += LANES * blocks


@njit(nogil=True, cache=True)
def _step_column_paths(windows, tile_row, columns, penalties, row, small, costs, at, scratch,
                       sums, gathered):
    """Move the vertical paths on by a row; add them to the sums where `gathered`."""
    paths, least, jumps = scratch.paths, scratch.least, penalties[row]
    for tile in range(windows.low.shape[1]):
        begin = tile * windows.width
        end = min(begin + windows.width, columns)
        blocks = windows.blocks[tile_row, tile]
        place = windows.offset[tile_row, tile]
        if blocks == 1:     # most tiles: the loop over blocks vanishes
            _step_tile(1, begin, end, place, jumps, small, costs, at, paths, least, sums, gathered)
        else:
            _step_tile(blocks, begin, end, place, jumps, small, costs, at, paths, least, sums,
                       gathered)


@njit(nogil=True, cache=True)
def downwards(features, box, half_prior, previous_prior, windows, volume, penalties, first, last,
              overlap, scratch):
    """
    Fill costs and sums of the rows first .. last: paths right, left and down.

    box: 0, or costs are sums of 3 x 3 pixels / 2**box, without priors and with one window. The
    downward paths start `overlap` rows above, at the image's border at the most.
    """
    columns, small = features.columns, np.uint8(penalties.small)
    scratch.paths[:] = 0
    scratch.least[:] = 0
    start = max(first - overlap, 0)
    row = start
    while row < last:
        tile_row = row // windows.height
        size = windows.row_size[tile_row]
        if row > start and row % windows.height == 0:
            realign_rows(scratch.paths, scratch.other_paths, windows, tile_row - 1, tile_row,
                         columns, scratch.labels)
            copy(scratch.other_paths, scratch.paths)
        inside = row >= first
        count, costs, at = 1, scratch.outside, 0
        if inside:
            count = min(ROWS_AT_ONCE, min((tile_row + 1) * windows.height, last) - row)
            costs = volume.costs
            at = windows.base[tile_row] + (row - tile_row * windows.height) * size
        for chain in range(row, row + count):
            if box > 0:
                _fill_box_costs(features, box, chain, chain == start, windows.blocks[tile_row, 0],
                                costs, at + (chain - row) * size, scratch.ring)
            else:
                _fill_costs(features, half_prior, previous_prior, windows, chain, costs,
                            at + (chain - row) * size)
        if inside:
            for rightwards in (True, False):
                across(costs, volume.sums, at, size, windows, tile_row, rightwards,
                       penalties.across, row, count, small, scratch.chains, scratch.labels)
        for chain in range(count):
            _step_column_paths(windows, tile_row, columns, penalties.down, row + chain, small,
                               costs, at + chain * size, scratch, volume.sums, inside)
        row += count


@njit(inline='always')
def _note(chosen, row, column, low, best, highest, below, least, above, elsewhere):
    """Write what was chosen for a pixel."""
    labels, offsets, least_sums, margins = chosen
    labels[row, column] = low + best
    offsets[row, column] = equiangular(np.int64(below), np.int64(least), np.int64(above)) \
        if 0 < best < highest else 0
    least_sums[row, column] = least
    margins[row, column] = elsewhere - least


@njit(inline='always')
def _choose_single(low, begin, end, place, highest, columns, row, costs, sums, at, jumps, small,
                   paths, least, totals, best_sums, best_labels, chosen):
    """Do for a tile of one block, in registers, what _choose_tile does for any."""
    numbers = lane_numbers()
    labels = add(numbers, splat(np.uint8(low & 255)))
    penalty, two = splat(small), splat(np.uint8(2))
    for column in range(begin, end):
        path, floor = advance(load(paths, place), splat(peek(least, column)), peek(jumps, column),
                              penalty, load(costs, at + place))
        store(paths, place, path)
        least[column] = floor
        total = saturating_add(load(sums, at + place), path)
        store(totals, LANES, total)
        cheapest = lowest(total)
        best = first_set(equal_bits(total, splat(cheapest)))
        near = at_most(subtract(numbers, splat(np.uint8((best - 1) & 255))), two)
        _note(chosen, row, column, low, best, highest, peek(totals, LANES + best - 1),
              cheapest, peek(totals, LANES + best + 1), lowest(bit_or(total, near)))
        pointed = columns - 1 - column + low
        rival = load(best_sums, pointed)
        store(best_labels, pointed, choose(
            at_most(total, rival), labels, load(best_labels, pointed)))
        store(best_sums, pointed, minimum(total, rival))
        place += LANES


@njit(inline='always')
def _choose_tile(blocks, low, begin, end, place, highest, columns, row, costs, sums, at, jumps,
                 small, paths, least, totals, best_sums, best_labels, chosen):
    """Move the upward paths of one tile's columns on by a row and choose their labels."""
    for column in range(begin, end):
        least[column] = step(paths, place, blocks, peek(least, column), peek(jumps, column), small,
                             costs, at + place)
        total_of(sums, at + place, paths, place, blocks, totals)
        best, cheapest = best_label(totals, blocks)
        _note(chosen, row, column, low, best, highest, totals[max(best - 1, 0)], cheapest,
              totals[best + 1], least_elsewhere(totals, blocks, best))
        offer_to_target(totals, blocks, low, columns - 1 - column + low, best_sums, best_labels)
        place += LANES * blocks


@njit(nogil=True, cache=True)
def _choose_row(windows, tile_row, row, disparities, volume, jumps, small, at, scratch, chosen):
    """Add the upward paths to the sums of a row and choose its labels for both views."""
    target = chosen.target
    columns = target.shape[1]
    costs, sums, paths, least = volume.costs, volume.sums, scratch.paths, scratch.least
    totals, best_sums, best_labels = scratch.labels, scratch.best_sums, scratch.best_labels
    choices = chosen.labels, chosen.offsets, chosen.sums, chosen.margins
    best_sums[:] = 255
    best_labels[:] = 0      # of target pixels that no window points at
    for tile in range(windows.low.shape[1]):
        begin = tile * windows.width
        end = min(begin + windows.width, columns)
        low, blocks = windows.low[tile_row, tile], windows.blocks[tile_row, tile]
        place = windows.offset[tile_row, tile]
        highest = min(low + LANES * blocks, disparities) - low - 1
        if blocks == 1:
            _choose_single(low, begin, end, place, highest, columns, row, costs, sums, at, jumps,
                           small, paths, least, totals, best_sums, best_labels, choices)
        else:
            _choose_tile(blocks, low, begin, end, place, highest, columns, row, costs, sums, at,
                         jumps, small, paths, least, totals, best_sums, best_labels, choices)
    for column in range(columns):
        target[row, column] = best_labels[columns - 1 - column]


@njit(nogil=True, cache=True)
def upwards(features, windows, volume, penalties, first, last, overlap, scratch, chosen):
    """
    Add the upward paths to the sums of the rows first .. last and choose their labels.

    The costs of the `overlap` rows below must be there: run `downwards` on all bands before.
    """
    columns, small = features.columns, np.uint8(penalties.small)
    rows = penalties.down.shape[0]
    scratch.paths[:] = 0
    scratch.least[:] = 0
    start = min(last + overlap, rows) - 1
    for row in range(start, first - 1, -1):
        tile_row = row // windows.height
        if row < start and (row + 1) % windows.height == 0:
            realign_rows(scratch.paths, scratch.other_paths, windows, tile_row + 1, tile_row,
                         columns, scratch.labels)
            copy(scratch.other_paths, scratch.paths)
        size = windows.row_size[tile_row]
        at = windows.base[tile_row] + (row - tile_row * windows.height) * size
        below = min(row + 1, rows - 1)
        if row < last:
            _choose_row(windows, tile_row, row, features.disparities, volume,
                        penalties.down[below], small, at, scratch, chosen)
        else:
            _step_column_paths(windows, tile_row, columns, penalties.down, below, small,
                               volume.costs, at, scratch, volume.sums, False)
