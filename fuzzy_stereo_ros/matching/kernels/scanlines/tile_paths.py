# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Paths from left, right and above through a tile of some rows, in step with each other.

With windows of one, two or four blocks, four rows go at once and stay in registers: their
horizontal paths hide each other's latency.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import splat_word
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import (
    beyond, cost_of_block, cuts_of, prepare_costs)
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import advance, step
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import without_least
from fuzzy_stereo_ros.matching.kernels.simd import (
    bit_or, LANES, lanes_of, load_like, saturating_add, splat, store)
import numpy as np

ROWS_AT_ONCE = 4


@inlined
def rightwards(blocks, begin, end, at, size, jumps, stride, count, small, costs, sums, paths,
               path):
    """Run the paths from the left through one tile: they begin the sums."""
    penalty = splat(np.uint8(small))
    for column in range(begin, end):
        for row in range(count):
            pixel = at + row * size
            jump = splat_word(penalty, jumps, row * stride + column)
            step(paths, row * path, blocks, jump, penalty, costs, pixel, sums, pixel, True)
        at += LANES * blocks


@inlined
def _rows_of(kind, memory, size):
    """Return what vectors like `kind` lie at the start of four rows, `size` bytes apart."""
    return (load_like(kind, memory, 0), load_like(kind, memory, size),
            load_like(kind, memory, 2 * size), load_like(kind, memory, 3 * size))


@inlined
def _store_rows(memory, at, size, one, two, three, four):
    """Write four vectors to rows `size` bytes apart, from index `at` on."""
    store(memory, at, one)
    store(memory, at + size, two)
    store(memory, at + 2 * size, three)
    store(memory, at + 3 * size, four)


@inlined
def costs_and_rightwards_single(search, row, begin, end, low, at, size, jumps, stride, penalty,
                                costs, sums, paths, path, codes, priors):
    """Fill the costs of four rows of a tile and run from the left, in registers."""
    width, far = end - begin, search.target_stride
    prepare_costs(search, row, ROWS_AT_ONCE, begin, end, low, codes, priors)
    cuts, lanes = cuts_of(search, penalty), lanes_of(penalty)
    mask = beyond(penalty, low, search.disparities)
    pointed = search.columns - 1 - begin + low
    candidate, slope = row * 3 * far + pointed, row * far + pointed
    one, two, three = size, 2 * size, 3 * size
    path_0, path_1, path_2, path_3 = _rows_of(penalty, paths, path)
    for index in range(width):
        column, at_target, at_slope = begin + index, candidate - index, slope - index
        cost = bit_or(mask, cost_of_block(search, at_target, at_slope, cuts, codes, index, width,
                                          priors, index, 0))
        store(costs, at, cost)
        path_0 = advance(path_0, splat_word(penalty, jumps, column), penalty, cost)
        store(sums, at, path_0)
        cost = bit_or(mask, cost_of_block(
            search, at_target + 3 * far, at_slope + far, cuts, codes, index + 4 * width, width,
            priors, index + 2 * width, 0))
        store(costs, at + one, cost)
        path_1 = advance(path_1, splat_word(penalty, jumps, column + stride), penalty, cost)
        store(sums, at + one, path_1)
        cost = bit_or(mask, cost_of_block(
            search, at_target + 6 * far, at_slope + 2 * far, cuts, codes, index + 8 * width,
            width, priors, index + 4 * width, 0))
        store(costs, at + two, cost)
        path_2 = advance(path_2, splat_word(penalty, jumps, column + 2 * stride), penalty, cost)
        store(sums, at + two, path_2)
        cost = bit_or(mask, cost_of_block(
            search, at_target + 9 * far, at_slope + 3 * far, cuts, codes, index + 12 * width,
            width, priors, index + 6 * width, 0))
        store(costs, at + three, cost)
        path_3 = advance(path_3, splat_word(penalty, jumps, column + 3 * stride), penalty, cost)
        store(sums, at + three, path_3)
        path_0, path_1, path_2, path_3 = without_least(path_0, path_1, path_2, path_3)
        at += lanes
    _store_rows(paths, 0, path, path_0, path_1, path_2, path_3)


@inlined
def rightwards_single(begin, end, at, size, jumps, stride, penalty, costs, sums, paths, path):
    """Run four rows of a tile: what rightwards does for any number of blocks, in registers."""
    one, two, three, lanes = size, 2 * size, 3 * size, lanes_of(penalty)
    path_0, path_1, path_2, path_3 = _rows_of(penalty, paths, path)
    for column in range(begin, end):
        path_0 = advance(path_0, splat_word(penalty, jumps, column), penalty,
                         load_like(penalty, costs, at))
        path_1 = advance(path_1, splat_word(penalty, jumps, column + stride), penalty,
                         load_like(penalty, costs, at + one))
        path_2 = advance(path_2, splat_word(penalty, jumps, column + 2 * stride), penalty,
                         load_like(penalty, costs, at + two))
        path_3 = advance(path_3, splat_word(penalty, jumps, column + 3 * stride), penalty,
                         load_like(penalty, costs, at + three))
        _store_rows(sums, at, size, path_0, path_1, path_2, path_3)
        path_0, path_1, path_2, path_3 = without_least(path_0, path_1, path_2, path_3)
        at += lanes
    _store_rows(paths, 0, path, path_0, path_1, path_2, path_3)


@kernel
def left_and_down(blocks, begin, end, at, size, across, down, stride, first, last, small,
                  costs, sums, paths, path, down_paths, place):
    """
    Run the paths from the right and from above through some rows of columns begin .. end.

    at, place: where the costs and the downward paths of column `begin` are.
    """
    penalty = splat(np.uint8(small))
    for column in range(end - 1, begin - 1, -1):
        ahead = (column - begin) * LANES * blocks
        for row in range(first, last):
            pixel, jump = at + ahead + row * size, row * stride + column
            step(paths, row * path, blocks, splat_word(penalty, across, jump + 1), penalty, costs,
                 pixel, sums, pixel, False)
            step(down_paths, place + ahead, blocks, splat_word(penalty, down, jump), penalty,
                 costs, pixel, sums, pixel, False)


@inlined
def _add_to(sums, at, one, other):
    store(sums, at, saturating_add(load_like(one, sums, at), saturating_add(one, other)))


@inlined
def left_and_down_single(begin, end, at, size, across, down, stride, small, penalty, costs,
                         sums, paths, path, down_paths, place):
    """
    Run four rows of a tile: what left_and_down does for any number of blocks, in registers.

    Each row is a column behind the one above it, so that its downward path is in a register and
    all eight paths of a turn are independent of each other.
    """
    lanes = lanes_of(penalty)
    blocks = lanes // LANES
    for row in range(3):
        ahead = lanes * (end - 3 + row - begin)
        left_and_down(blocks, end - 3 + row, end, at + ahead, size, across, down, stride, row,
                      row + 1, small, costs, sums, paths, path, down_paths, place + ahead)
    one, two, three = size + lanes, 2 * (size + lanes), 3 * (size + lanes)
    jump_1, jump_2, jump_3 = stride + 1, 2 * (stride + 1), 3 * (stride + 1)
    path_0, path_1, path_2, path_3 = _rows_of(penalty, paths, path)
    cost_at, down_at = at + lanes * (end - 4 - begin), place + lanes * (end - 4 - begin)
    down_0, down_1, down_2 = (
        load_like(penalty, down_paths, down_at + lanes),
        load_like(penalty, down_paths, down_at + 2 * lanes),
        load_like(penalty, down_paths, down_at + 3 * lanes))
    for column in range(end - 4, begin - 1, -1):
        cost_0 = load_like(penalty, costs, cost_at)
        cost_1 = load_like(penalty, costs, cost_at + one)
        cost_2 = load_like(penalty, costs, cost_at + two)
        cost_3 = load_like(penalty, costs, cost_at + three)
        down_3 = advance(down_2, splat_word(penalty, down, column + jump_3), penalty, cost_3)
        down_2 = advance(down_1, splat_word(penalty, down, column + jump_2), penalty, cost_2)
        down_1 = advance(down_0, splat_word(penalty, down, column + jump_1), penalty, cost_1)
        down_0 = advance(load_like(penalty, down_paths, down_at),
                         splat_word(penalty, down, column), penalty, cost_0)
        jump = column + 1
        path_0 = advance(path_0, splat_word(penalty, across, jump), penalty, cost_0)
        path_1 = advance(path_1, splat_word(penalty, across, jump + jump_1), penalty, cost_1)
        path_2 = advance(path_2, splat_word(penalty, across, jump + jump_2), penalty, cost_2)
        path_3 = advance(path_3, splat_word(penalty, across, jump + jump_3), penalty, cost_3)
        _add_to(sums, cost_at, path_0, down_0)
        _add_to(sums, cost_at + one, path_1, down_1)
        _add_to(sums, cost_at + two, path_2, down_2)
        _add_to(sums, cost_at + three, path_3, down_3)
        path_0, path_1, path_2, path_3 = without_least(path_0, path_1, path_2, path_3)
        down_0, down_1, down_2, down_3 = without_least(down_0, down_1, down_2, down_3)
        store(down_paths, down_at + 3 * lanes, down_3)
        cost_at -= lanes
        down_at -= lanes
    store(down_paths, place, down_0)
    store(down_paths, place + lanes, down_1)
    store(down_paths, place + 2 * lanes, down_2)
    _store_rows(paths, 0, path, path_0, path_1, path_2, path_3)
    for row in range(1, 4):
        left_and_down(blocks, begin, begin + row, at, size, across, down, stride, row, row + 1,
                      small, costs, sums, paths, path, down_paths, place)
