# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A memetic sweep: each row takes its exact optimum, given the rows above and below it.

One dynamic program per row, over the windows of labels of its tiles. Rows of one parity do not
see each other, so that bands of rows can be swept side by side.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import peek
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.genetic.gene_cost import jump_cost
from fuzzy_stereo_ros.matching.kernels.scanlines.choice import best_label
from fuzzy_stereo_ros.matching.kernels.scanlines.downward_sweep import fill_costs
from fuzzy_stereo_ros.matching.kernels.scanlines.steps import carry, clear, step
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import (
    row_start, Scratch, Search, window_of)
from fuzzy_stereo_ros.matching.kernels.simd import (
    at_most, choose, equal, lane_numbers, LANES, load, saturating_add, splat, store, subtract)
import numpy as np


@kernel
def add_neighbour(costs, blocks, low, neighbour, small, jump):
    """
    Add to the costs of a pixel's labels what they cost beside a neighbour's label.

    costs: the address of uint8, `blocks` of 32 labels from `low` on; small, jump: uint8, P1, P2.
    """
    far = splat(jump)
    lanes = lane_numbers(far)
    for block in range(blocks):
        lane = neighbour - low - LANES * block
        penalty = far
        if -1 <= lane <= LANES:
            near = at_most(subtract(lanes, splat(np.uint8((lane - 1) & 255))), splat(np.uint8(2)))
            penalty = choose(near, splat(small), far)
            if 0 <= lane < LANES:
                penalty = choose(equal(lanes, splat(np.uint8(lane))), splat(np.uint8(0)), penalty)
        store(costs, LANES * block, saturating_add(load(costs, LANES * block), penalty))


@kernel
def _kept_cost(paths, place, low, blocks, label):
    """
    Return what the best path to a label costs; much where the window does not have it.

    paths: the address of a row's path costs, uint8, those of the pixel from index `place` on.
    """
    if label < low or label >= low + LANES * blocks:
        return 1024
    return np.int64(peek(paths, place + label - low))


@kernel
def _trace_back(search, row, penalties_across, small, paths, winners, chromosome):
    """Follow the best path of a row from its last column to its first."""
    columns = chromosome.shape[1]
    label = np.int64(winners[columns - 1])
    chromosome[row, columns - 1] = label
    for column in range(columns - 2, -1, -1):
        tile = column // search.tile
        low, blocks, place = window_of(search, row // search.tile, tile)
        place += (column - tile * search.tile) * LANES * blocks
        best, cheapest = label, _kept_cost(paths, place, low, blocks, label)
        for rival in (label - 1, label + 1, np.int64(winners[column])):
            cost = _kept_cost(paths, place, low, blocks, rival) + jump_cost(
                rival, label, small, penalties_across[row, column + 1])
            if cost < cheapest:
                best, cheapest = rival, cost
        label = best
        chromosome[row, column] = label


@kernel
def polish_rows(search, scratch, small, across, down, chromosome, parity, first, last, winners):
    """
    Sweep the rows of a parity among first .. last of a chromosome, in place.

    search, scratch: the fields of the last Search and of a Scratch; small, across, down: the
    Penalties of the fitness; winners: int64 (C,), working memory.
    """
    search, scratch = Search(*search), Scratch(*scratch)
    (rows, columns), small = chromosome.shape, np.uint8(small)
    running, pixel, paths, penalty = scratch.chains, scratch.labels, scratch.down, splat(small)
    for row in range(first + (first + parity) % 2, last, 2):
        fill_costs(search, scratch, row, True)
        tile_row, row_at, previous = row // search.tile, row_start(search, scratch, row), -1
        low, blocks, start = window_of(search, tile_row, 0)
        clear(running, 0, blocks)
        for column in range(columns):
            tile = column // search.tile
            if tile != previous:
                old_low, old_blocks = low, blocks
                low, blocks, start = window_of(search, tile_row, tile)
                carry(running, 0, old_blocks, old_low, running, 0, blocks, low, pixel)
            previous = tile
            place = start + (column - tile * search.tile) * LANES * blocks
            for block in range(blocks):
                store(pixel, LANES * block, load(scratch.costs, row_at + place + LANES * block))
            if row > 0:
                add_neighbour(pixel, blocks, low, np.int64(chromosome[row - 1, column]), small,
                              down[row, column])
            if row + 1 < rows:
                add_neighbour(pixel, blocks, low, np.int64(chromosome[row + 1, column]), small,
                              down[row + 1, column])
            step(running, 0, blocks, splat(across[row, column]), penalty, pixel, 0, paths, place,
                 True)
            winners[column] = low + best_label(running, 0, blocks)[0]
        _trace_back(search, row, across, small, paths, winners, chromosome)
