# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Paths from left and right through a tile of some rows, in step with each other.

With windows of one, two or four blocks, four rows go at once and stay in registers.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import splat_word
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.possibility.costs import (
    beyond, cost_of_block, cuts_of, prepare_costs)
from fuzzy_stereo_ros.matching.kernels.scanlines.four import (
    add_four, advance_four, load_four, splat_four, store_four, without_least)
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import advance, step
from fuzzy_stereo_ros.matching.kernels.simd import (
    bit_or, LANES, lanes_of, splat, splat_like, store)
import numpy as np

ROWS_AT_ONCE = 8     # of which paths from the left, whose costs are computed, take four


class TileRows(NamedTuple):
    """Some rows of a tile; costs and sums are addresses of column `begin` of the first row."""

    begin: int               # columns
    end: int
    size: int                # bytes from a row of costs or sums to the next
    costs: int
    sums: int
    words: int               # from a row of P2 to the next
    across: int              # addresses of words: P2 of column 0 to the left
    chain: int               # bytes from a horizontal path to the next
    chains: int              # address of the horizontal paths
    small: int               # P1


@called
def cost_rows(search, scratch, rows, row, count, low, blocks):
    """
    Write the costs of some rows of a tile, labels low .. low + 32 * blocks, 255 where none exist.

    rows: the TileRows from image row `row` on
    """
    width, stride = rows.end - rows.begin, search.target_stride
    prepare_costs(search, row, count, rows.begin, rows.end, low, scratch.codes, scratch.priors)
    cuts = cuts_of(search, splat(np.uint8(0)))
    pointed = search.columns - 1 - rows.begin + low
    exist = low + LANES * blocks <= search.disparities
    for near in range(count):
        at, slope_at = near * rows.size, (row + near) * stride + pointed
        candidate = (row + near) * 3 * stride + pointed
        for index in range(width):
            for block in range(blocks):
                offset = LANES * block
                place = candidate - index + offset, slope_at - index + offset
                cost = cost_of_block(search, scratch, place, cuts, width,
                                     4 * near * width + index, 2 * near * width + index, offset)
                if not exist:
                    cost = bit_or(cost, beyond(cost, low + offset, search.disparities))
                store(rows.costs, at, cost)
                at += LANES


@inlined
def rightwards(rows, blocks, count):
    """Run the paths from the left through `count` rows of a tile: they begin the sums."""
    penalty, at = splat(np.uint8(rows.small)), 0
    for column in range(rows.begin, rows.end):
        for row in range(count):
            pixel = at + row * rows.size
            jump = splat_word(penalty, rows.across, row * rows.words + column)
            step(rows.chains + row * rows.chain, blocks, jump, penalty, rows.costs + pixel,
                 rows.sums + pixel, True)
        at += LANES * blocks


@inlined
def _fill_and_advance(path, row, index, place, search, scratch, rows, cuts, mask):
    """
    Write the costs of a pixel, move the path from the left on to it, and begin its sums.

    place: of the candidates and of their gradients for the first pixel of the tile.
    """
    width, far = rows.end - rows.begin, search.target_stride
    here = place[0] + 3 * row * far - index, place[1] + row * far - index
    cost = bit_or(mask, cost_of_block(search, scratch, here, cuts, width,
                                      index + 4 * row * width, index + 2 * row * width, 0))
    at = row * rows.size + lanes_of(mask) * index
    store(rows.costs, at, cost)
    jump = splat_word(mask, rows.across, rows.begin + index + row * rows.words)
    path = advance(path, jump, splat_like(mask, rows.small), cost)
    store(rows.sums, at, path)
    return path


@inlined
def costs_and_rightwards_four(penalty, search, scratch, rows, row, low):
    """
    Fill the costs of four rows of a tile, from image row `row` on, and run from the left.

    penalty: P1, a vector of all labels of the window. Returns the number of columns.
    """
    begin, far = rows.begin, search.target_stride
    prepare_costs(search, row, 4, begin, rows.end, low, scratch.codes, scratch.priors)
    cuts = cuts_of(search, penalty)
    mask = beyond(penalty, low, search.disparities)
    pointed = search.columns - 1 - begin + low
    place = row * 3 * far + pointed, row * far + pointed
    paths = load_four(penalty, rows.chains, 0, rows.chain)
    for index in range(rows.end - begin):
        paths = without_least((
            _fill_and_advance(paths[0], 0, index, place, search, scratch, rows, cuts, mask),
            _fill_and_advance(paths[1], 1, index, place, search, scratch, rows, cuts, mask),
            _fill_and_advance(paths[2], 2, index, place, search, scratch, rows, cuts, mask),
            _fill_and_advance(paths[3], 3, index, place, search, scratch, rows, cuts, mask)))
    store_four(rows.chains, 0, rows.chain, paths)
    return rows.end - rows.begin


@inlined
def rightwards_four(penalty, rows):
    """Do in registers what rightwards does, for four rows; return the number of columns."""
    at, paths = 0, load_four(penalty, rows.chains, 0, rows.chain)
    for column in range(rows.begin, rows.end):
        paths = advance_four(paths, splat_four(penalty, rows.across, column, rows.words), penalty,
                             load_four(penalty, rows.costs, at, rows.size))
        store_four(rows.sums, at, rows.size, paths)
        paths = without_least(paths)
        at += lanes_of(penalty)
    store_four(rows.chains, 0, rows.chain, paths)
    return rows.end - rows.begin


@called
def leftwards(rows, blocks, count):
    """Run the paths from the right through `count` rows of a tile and add them to the sums."""
    penalty = splat(np.uint8(rows.small))
    for column in range(rows.end - 1, rows.begin - 1, -1):
        for row in range(count):
            pixel = (column - rows.begin) * LANES * blocks + row * rows.size
            jump = splat_word(penalty, rows.across, row * rows.words + column + 1)
            step(rows.chains + row * rows.chain, blocks, jump, penalty, rows.costs + pixel,
                 rows.sums + pixel, False)


@inlined
def _left_four(penalty, rows, paths, row, column):
    """Move four paths from the right on to a column of the rows from `row` on; return them."""
    at = row * rows.size + lanes_of(penalty) * (column - rows.begin)
    paths = advance_four(
        paths, splat_four(penalty, rows.across, row * rows.words + column + 1, rows.words),
        penalty, load_four(penalty, rows.costs, at, rows.size))
    store_four(rows.sums, at, rows.size,
               add_four(load_four(penalty, rows.sums, at, rows.size), paths))
    return without_least(paths)


@inlined
def leftwards_eight(penalty, rows):
    """Do in registers what leftwards does, for eight rows; return the number of columns."""
    below = 4 * rows.chain
    upper = load_four(penalty, rows.chains, 0, rows.chain)
    lower = load_four(penalty, rows.chains, below, rows.chain)
    for column in range(rows.end - 1, rows.begin - 1, -1):
        upper = _left_four(penalty, rows, upper, 0, column)
        lower = _left_four(penalty, rows, lower, 4, column)
    store_four(rows.chains, 0, rows.chain, upper)
    store_four(rows.chains, below, rows.chain, lower)
    return rows.end - rows.begin
