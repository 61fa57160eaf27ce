# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Costs of some rows, then the paths that come from left and right: rows are independent.

Up to eight rows at once, so that their paths are in step and hide each other's latency. With one,
two or four blocks of labels the paths stay in registers.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import repeat_bytes, splat_word
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.possibility.costs import box_row, raw_row
from fuzzy_stereo_ros.matching.kernels.scanlines.four import (
    add_four, advance_four, load_four, splat_four, store_four, without_least)
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import clear, in_registers, step
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import row_start
from fuzzy_stereo_ros.matching.kernels.simd import LANES, lanes_of, splat
import numpy as np

ROWS_AT_ONCE = 8     # of which paths from the left take four


@called
def _fill_costs(search, scratch, row, is_start):
    """Write a row of sums of 3 x 3 pixels / 2**box."""
    raw, blocks = scratch.raw_rows, search.blocks
    size, newest = search.columns * LANES * blocks, min(row + 1, search.rows - 1)
    for near in range(max(row - 1, 0) if is_start else newest, newest + 1):
        raw_row(search, near, blocks, raw, near % 3 * size, scratch.codes)
    box_row(search, raw + max(row - 1, 0) % 3 * size, raw + row % 3 * size,
            raw + newest % 3 * size, blocks, scratch.costs, row_start(search, scratch, row))


@inlined
def _begin_paths(search, scratch, row, count):
    """Repeat the jump penalties along some rows for vectors; let their paths begin at 0."""
    for near in range(count):
        first = (row + near) * search.columns
        repeat_bytes(search.across, first, first + search.columns, scratch.jumps,
                     near * scratch.row_words)
    clear(scratch.row_paths, 0, count * scratch.path_size // LANES)


@inlined
def _rightwards_four(penalty, search, scratch, start):
    """
    Run the paths from the left through four rows; they begin the sums.

    penalty: P1, a vector of all labels; start: of the first row, see row_start. Returns the number
    of columns.
    """
    at, paths = start, load_four(penalty, scratch.row_paths, 0, scratch.path_size)
    for column in range(search.columns):
        paths = advance_four(
            paths, splat_four(penalty, scratch.jumps, column, scratch.row_words), penalty,
            load_four(penalty, scratch.costs, at, search.row_size))
        store_four(scratch.sums, at, search.row_size, paths)
        paths = without_least(paths)
        at += lanes_of(penalty)
    return search.columns


@inlined
def _left_four(penalty, search, scratch, start, paths, row, column):
    """Move four paths from the right on to a column of the rows from `row` on; return them."""
    at = start + row * search.row_size + lanes_of(penalty) * column
    paths = advance_four(
        paths, splat_four(penalty, scratch.jumps, row * scratch.row_words + column + 1,
                          scratch.row_words),
        penalty, load_four(penalty, scratch.costs, at, search.row_size))
    store_four(scratch.sums, at, search.row_size,
               add_four(load_four(penalty, scratch.sums, at, search.row_size), paths))
    return without_least(paths)


@inlined
def _leftwards_eight(penalty, search, scratch, start):
    """Run the paths from the right through eight rows and add them to the sums, see above."""
    upper = load_four(penalty, scratch.row_paths, 0, scratch.path_size)
    lower = load_four(penalty, scratch.row_paths, 4 * scratch.path_size, scratch.path_size)
    for column in range(search.columns - 1, -1, -1):
        upper = _left_four(penalty, search, scratch, start, upper, 0, column)
        lower = _left_four(penalty, search, scratch, start, lower, 4, column)
    return search.columns


@called
def _run(search, scratch, start, count, leftwards):
    """Run the paths along some rows, of any number of labels; leftwards they add to the sums."""
    penalty, size = splat(np.uint8(search.small)), LANES * search.blocks
    for number in range(search.columns):
        column = search.columns - 1 - number if leftwards else number
        for row in range(count):
            at = start + row * search.row_size + column * size
            jump = splat_word(penalty, scratch.jumps,
                              row * scratch.row_words + column + (1 if leftwards else 0))
            step(scratch.row_paths + row * scratch.path_size, search.blocks, jump, penalty,
                 scratch.costs + at, scratch.sums + at, not leftwards)


@called
def across(search, scratch, first, last):
    """Write the costs of rows first .. last - 1, and the sums of their paths from the sides."""
    row = first
    while row < last:
        count = min(ROWS_AT_ONCE, min((row // search.tile + 1) * search.tile, last) - row)
        for near in range(row, row + count):
            _fill_costs(search, scratch, near, near == first)
        for near in range(row, row + count, 4):
            number, start = min(4, row + count - near), row_start(search, scratch, near)
            _begin_paths(search, scratch, near, number)
            if number < 4 or in_registers(_rightwards_four, search.small, search.blocks, search,
                                          scratch, start) == 0:
                _run(search, scratch, start, number, False)
        start = row_start(search, scratch, row)
        _begin_paths(search, scratch, row, count)
        if count < ROWS_AT_ONCE or in_registers(_leftwards_eight, search.small, search.blocks,
                                                search, scratch, start) == 0:
            _run(search, scratch, start, count, True)
        row += count
