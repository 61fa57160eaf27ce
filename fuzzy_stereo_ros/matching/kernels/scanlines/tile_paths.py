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
    row_size: int            # bytes from a row of costs or sums to the next
    costs: int
    sums: int
    row_words: int           # words from a row of P2 to the next
    jumps: int               # address of words: P2 of column 0 to the left
    path_size: int           # bytes from the path along a row to that along the next
    paths: int               # address of the paths along the rows
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
        at, slope_at = near * rows.row_size, (row + near) * stride + pointed
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
            pixel = at + row * rows.row_size
            jump = splat_word(penalty, rows.jumps, row * rows.row_words + column)
            step(rows.paths + row * rows.path_size, blocks, jump, penalty, rows.costs + pixel,
                 rows.sums + pixel, True)
        at += LANES * blocks


@inlined
def _fill_and_advance(path, row, index, search, scratch, rows, inputs):
    """
    Write the costs of a pixel, move the path from the left on to it, and begin its sums.

    inputs: where the candidates of the first pixel of the tile are, and their gradients; the
    limits of the costs, see raw_costs; a mask of the labels that do not exist, see beyond
    """
    place, cuts, mask = inputs
    width, far = rows.end - rows.begin, search.target_stride
    here = place[0] + 3 * row * far - index, place[1] + row * far - index
    cost = bit_or(mask, cost_of_block(search, scratch, here, cuts, width,
                                      index + 4 * row * width, index + 2 * row * width, 0))
    at = row * rows.row_size + lanes_of(mask) * index
    store(rows.costs, at, cost)
    jump = splat_word(mask, rows.jumps, rows.begin + index + row * rows.row_words)
    path = advance(path, jump, splat_like(mask, rows.small), cost)
    store(rows.sums, at, path)
    return path


@inlined
def costs_and_rightwards_four(penalty, search, scratch, rows, row, low):
    """
    Write the costs of four rows of a tile, from image row `row` on, and run from the left.

    penalty: P1, a vector of all labels of the window, whose paths stay in registers. Returns the
    number of columns.
    """
    begin, far = rows.begin, search.target_stride
    prepare_costs(search, row, 4, begin, rows.end, low, scratch.codes, scratch.priors)
    pointed = search.columns - 1 - begin + low
    inputs = ((row * 3 * far + pointed, row * far + pointed), cuts_of(search, penalty),
              beyond(penalty, low, search.disparities))
    paths = load_four(penalty, rows.paths, 0, rows.path_size)
    for index in range(rows.end - begin):
        paths = without_least((
            _fill_and_advance(paths[0], 0, index, search, scratch, rows, inputs),
            _fill_and_advance(paths[1], 1, index, search, scratch, rows, inputs),
            _fill_and_advance(paths[2], 2, index, search, scratch, rows, inputs),
            _fill_and_advance(paths[3], 3, index, search, scratch, rows, inputs)))
    store_four(rows.paths, 0, rows.path_size, paths)
    return rows.end - rows.begin


@inlined
def rightwards_four(penalty, rows):
    """
    Run the paths from the left through four rows of a tile; they begin the sums.

    penalty: as of costs_and_rightwards_four. Returns the number of columns.
    """
    at, paths = 0, load_four(penalty, rows.paths, 0, rows.path_size)
    for column in range(rows.begin, rows.end):
        paths = advance_four(
            paths, splat_four(penalty, rows.jumps, column, rows.row_words), penalty,
            load_four(penalty, rows.costs, at, rows.row_size))
        store_four(rows.sums, at, rows.row_size, paths)
        paths = without_least(paths)
        at += lanes_of(penalty)
    store_four(rows.paths, 0, rows.path_size, paths)
    return rows.end - rows.begin


@called
def leftwards(rows, blocks, count):
    """Run the paths from the right through `count` rows of a tile and add them to the sums."""
    penalty = splat(np.uint8(rows.small))
    for column in range(rows.end - 1, rows.begin - 1, -1):
        for row in range(count):
            pixel = (column - rows.begin) * LANES * blocks + row * rows.row_size
            jump = splat_word(penalty, rows.jumps, row * rows.row_words + column + 1)
            step(rows.paths + row * rows.path_size, blocks, jump, penalty, rows.costs + pixel,
                 rows.sums + pixel, False)


@inlined
def _left_four(penalty, rows, paths, row, column):
    """Move four paths from the right on to a column of the rows from `row` on; return them."""
    at = row * rows.row_size + lanes_of(penalty) * (column - rows.begin)
    paths = advance_four(
        paths, splat_four(penalty, rows.jumps, row * rows.row_words + column + 1, rows.row_words),
        penalty, load_four(penalty, rows.costs, at, rows.row_size))
    store_four(rows.sums, at, rows.row_size,
               add_four(load_four(penalty, rows.sums, at, rows.row_size), paths))
    return without_least(paths)


@inlined
def leftwards_eight(penalty, rows):
    """
    Run the paths from the right through eight rows of a tile and add them to the sums.

    penalty: as of costs_and_rightwards_four. Returns the number of columns.
    """
    below = 4 * rows.path_size
    upper = load_four(penalty, rows.paths, 0, rows.path_size)
    lower = load_four(penalty, rows.paths, below, rows.path_size)
    for column in range(rows.end - 1, rows.begin - 1, -1):
        upper = _left_four(penalty, rows, upper, 0, column)
        lower = _left_four(penalty, rows, lower, 4, column)
    store_four(rows.paths, 0, rows.path_size, upper)
    store_four(rows.paths, below, rows.path_size, lower)
    return rows.end - rows.begin
