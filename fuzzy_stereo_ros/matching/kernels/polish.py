# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A memetic sweep: each row takes its exact optimum, given the rows above and below it.

One dynamic program per row, over the windows of labels of its tiles. Rows of one parity do not
see each other, so that bands of rows can be swept side by side.
"""
from fuzzy_stereo_ros.matching.kernels.choice import best_label
from fuzzy_stereo_ros.matching.kernels.gene_cost import jump_cost
from fuzzy_stereo_ros.matching.kernels.scanlines import clear, realign, step
from fuzzy_stereo_ros.matching.kernels.simd import (
    at_most, choose, equal, lane_numbers, LANES, load, saturating_add, splat, store, subtract)
from numba import njit
import numpy as np


@njit(nogil=True, cache=True)
def add_neighbour(costs, blocks, low, neighbour, small, jump):
    """Add to the costs of a pixel's labels what they cost beside a neighbour's label."""
    lanes, far = lane_numbers(), splat(jump)
    for block in range(blocks):
        lane = neighbour - low - LANES * block
        penalty = far
        if -1 <= lane <= LANES:
            near = at_most(subtract(lanes, splat(np.uint8((lane - 1) & 255))), splat(np.uint8(2)))
            penalty = choose(near, splat(small), far)
            if 0 <= lane < LANES:
                penalty = choose(equal(lanes, splat(np.uint8(lane))), splat(np.uint8(0)), penalty)
        store(costs, LANES * block, saturating_add(load(costs, LANES * block), penalty))


@njit(nogil=True, cache=True)
def _kept_cost(paths, place, low, blocks, label):
    """Return what the best path to a label costs; much where the window does not have it."""
    if label < low or label >= low + LANES * blocks:
        return 1024
    return np.int64(paths[place + label - low])


@njit(nogil=True, cache=True)
def _trace_back(windows, tile_row, row, penalties_across, small, paths, winners, chromosome):
    """Follow the best path of a row from its last column to its first."""
    columns = chromosome.shape[1]
    label = np.int64(winners[columns - 1])
    chromosome[row, columns - 1] = label
    for column in range(columns - 2, -1, -1):
        tile = column // windows.width
        low, blocks = windows.low[tile_row, tile], windows.blocks[tile_row, tile]
        place = (windows.offset[tile_row, tile]
                 + (column - tile * windows.width) * LANES * blocks)
        best, cheapest = label, _kept_cost(paths, place, low, blocks, label)
        for rival in (label - 1, label + 1, np.int64(winners[column])):
            cost = _kept_cost(paths, place, low, blocks, rival) + jump_cost(
                rival, label, small, penalties_across[row, column + 1])
            if cost < cheapest:
                best, cheapest = rival, cost
        label = best
        chromosome[row, column] = label


@njit(nogil=True, cache=True)
def polish_rows(costs, windows, penalties, chromosome, parity, first, last, paths, winners, pixel,
                running):
    """
    Sweep the rows of a parity among first .. last of a chromosome, in place.

    costs: uint8, packed by windows; penalties: those of the fitness; paths: uint8, a row of all
    labels; winners: int64 (C,); pixel, running: uint8, one pixel's labels and 128 more.
    """
    rows, columns = chromosome.shape
    small = np.uint8(penalties.small)
    across, down = penalties.across, penalties.down
    for row in range(first + (first + parity) % 2, last, 2):
        tile_row = row // windows.height
        row_at = (windows.base[tile_row]
                  + (row - tile_row * windows.height) * windows.row_size[tile_row])
        least, previous = np.uint8(0), -1
        for column in range(columns):
            tile = column // windows.width
            low, blocks = windows.low[tile_row, tile], windows.blocks[tile_row, tile]
            if previous < 0:
                clear(running, 0, blocks)
            elif tile != previous:
                realign(running, 0, windows.blocks[tile_row, previous],
                        windows.low[tile_row, previous], running, 0, blocks, low, pixel)
            previous = tile
            place = (windows.offset[tile_row, tile]
                     + (column - tile * windows.width) * LANES * blocks)
            for block in range(blocks):
                store(pixel, LANES * block, load(costs, row_at + place + LANES * block))
            if row > 0:
                add_neighbour(pixel, blocks, low, np.int64(chromosome[row - 1, column]), small,
                              down[row, column])
            if row + 1 < rows:
                add_neighbour(pixel, blocks, low, np.int64(chromosome[row + 1, column]), small,
                              down[row + 1, column])
            least = step(running, 0, blocks, least, across[row, column], small, pixel, 0)
            for block in range(blocks):
                store(paths, place + LANES * block, load(running, LANES * block))
            winners[column] = low + best_label(running, blocks)[0]
        _trace_back(windows, tile_row, row, across, small, paths, winners, chromosome)
