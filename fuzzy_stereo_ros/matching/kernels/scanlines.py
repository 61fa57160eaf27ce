# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scanline passes: the least cost of a path that ends at a pixel, for each of its labels.

After Hirschmueller, Stereo processing by semi-global matching, 2008. A pass computes
L(p, d) = C(p, d) + min(L(q, d), L(q, d - 1) + P1, L(q, d + 1) + P1, min L(q) + P2) - min L(q)
in saturating uint8, q being the pixel before p. Four passes are summed: right, left, down, up.
"""
from fuzzy_stereo_ros.matching.kernels.simd import (
    label_above, label_below, LANES, load, lowest, minimum, peek, saturating_add, splat, store,
    subtract)
from numba import njit
import numpy as np

ROWS_AT_ONCE = 4     # independent chains, to hide the latency of each


@njit(nogil=True, cache=True)
def step(path, at, blocks, least, jump, small, costs, cost_at):
    """
    Move the paths of a pixel on to the next one and return their new least cost.

    path: uint8, `blocks` of 32 labels from index `at`, read and written; least: their least cost;
    jump, small: P2 and P1; costs: uint8, those of the next pixel from index cost_at.
    """
    full = splat(np.uint8(255))
    floor = splat(least)
    ceiling = saturating_add(floor, splat(jump))
    penalty = splat(small)
    before, here, smallest = full, load(path, at), full
    for block in range(blocks):
        offset = LANES * block
        after = load(path, at + offset + LANES) if block + 1 < blocks else full
        neighbours = minimum(label_below(before, here), label_above(here, after))
        cheapest = minimum(minimum(here, ceiling), saturating_add(neighbours, penalty))
        cost = saturating_add(subtract(cheapest, floor), load(costs, cost_at + offset))
        store(path, at + offset, cost)
        smallest = minimum(smallest, cost)
        before, here = here, after
    return lowest(smallest)


@njit(nogil=True, cache=True)
def keep(path, at, blocks, sums, sum_at):
    """Write the paths of a pixel where its sum begins."""
    for block in range(blocks):
        store(sums, sum_at + LANES * block, load(path, at + LANES * block))


@njit(nogil=True, cache=True)
def gather(path, at, blocks, sums, sum_at):
    """Add the paths of a pixel to its sum."""
    for block in range(blocks):
        offset = LANES * block
        store(sums, sum_at + offset,
              saturating_add(load(sums, sum_at + offset), load(path, at + offset)))


@njit(nogil=True, cache=True)
def copy(paths, target):
    """Copy paths, whole vectors of them."""
    for at in range(0, paths.size - LANES + 1, LANES):
        store(target, at, load(paths, at))


@njit(nogil=True, cache=True)
def clear(path, at, blocks):
    """Start paths anew: cost 0 for each label."""
    for block in range(blocks):
        store(path, at + LANES * block, splat(np.uint8(0)))


@njit(nogil=True, cache=True)
def realign(path, at, blocks, low, out, out_at, new_blocks, new_low, scratch):
    """
    Carry paths from the window of labels of one tile to that of the next, 255 where new.

    scratch: uint8, at least 32 * blocks + 128.
    """
    full = splat(np.uint8(255))
    store(scratch, 0, full)
    for block in range(blocks):
        store(scratch, LANES * (block + 1), load(path, at + LANES * block))
    store(scratch, LANES * (blocks + 1), full)
    for block in range(new_blocks):
        start = min(max(new_low + LANES * block - low, -LANES), LANES * blocks)
        store(out, out_at + LANES * block, load(scratch, LANES + start))


@njit(inline='always')
def advance(path, floor, jump, penalty, costs):
    """Return the paths of one block of labels at the next pixel, and their least cost."""
    full = splat(np.uint8(255))
    neighbours = minimum(label_below(full, path), label_above(path, full))
    cheapest = minimum(minimum(path, saturating_add(floor, splat(jump))),
                       saturating_add(neighbours, penalty))
    path = saturating_add(subtract(cheapest, floor), costs)
    return path, lowest(path)


@njit(inline='always')
def _pass_single(begin, end, rightwards, penalties, row, small, costs, sums, first, row_size,
                 paths, stride, least):
    """Run four rows of a tile of one block in registers: the same as _pass_tile, faster."""
    penalty, columns = splat(small), penalties.shape[1]
    one, two, three = row_size, 2 * row_size, 3 * row_size
    path_0, path_1 = load(paths, 0), load(paths, stride)
    path_2, path_3 = load(paths, 2 * stride), load(paths, 3 * stride)
    floor_0, floor_1, floor_2, floor_3 = least[0], least[1], least[2], least[3]
    jumps_0, jumps_1 = penalties[row], penalties[row + 1]
    jumps_2, jumps_3 = penalties[row + 2], penalties[row + 3]
    for visit in range(end - begin):
        column = begin + visit if rightwards else end - 1 - visit
        border = column if rightwards else min(column + 1, columns - 1)
        at = first + (column - begin) * LANES
        path_0, floor_0 = advance(path_0, splat(floor_0), peek(jumps_0, border), penalty,
                                  load(costs, at))
        path_1, floor_1 = advance(path_1, splat(floor_1), peek(jumps_1, border), penalty,
                                  load(costs, at + one))
        path_2, floor_2 = advance(path_2, splat(floor_2), peek(jumps_2, border), penalty,
                                  load(costs, at + two))
        path_3, floor_3 = advance(path_3, splat(floor_3), peek(jumps_3, border), penalty,
                                  load(costs, at + three))
        if rightwards:
            store(sums, at, path_0)
            store(sums, at + one, path_1)
            store(sums, at + two, path_2)
            store(sums, at + three, path_3)
        else:
            store(sums, at, saturating_add(load(sums, at), path_0))
            store(sums, at + one, saturating_add(load(sums, at + one), path_1))
            store(sums, at + two, saturating_add(load(sums, at + two), path_2))
            store(sums, at + three, saturating_add(load(sums, at + three), path_3))
    store(paths, 0, path_0)
    store(paths, stride, path_1)
    store(paths, 2 * stride, path_2)
    store(paths, 3 * stride, path_3)
    least[0], least[1], least[2], least[3] = floor_0, floor_1, floor_2, floor_3


@njit(inline='always')
def _pass_tile(blocks, begin, end, rightwards, penalties, row, count, small, costs, sums, first,
               row_size, paths, stride, least):
    """Run the rows at once through one tile."""
    columns, jumps = penalties.shape[1], penalties.reshape(-1)
    for visit in range(end - begin):
        column = begin + visit if rightwards else end - 1 - visit
        border = column if rightwards else min(column + 1, columns - 1)
        place = first + (column - begin) * LANES * blocks
        for chain in range(count):
            path_at, pixel_at = chain * stride, place + chain * row_size
            least[chain] = step(paths, path_at, blocks, least[chain],
                                peek(jumps, (row + chain) * columns + border), small, costs,
                                pixel_at)
            if rightwards:
                keep(paths, path_at, blocks, sums, pixel_at)
            else:
                gather(paths, path_at, blocks, sums, pixel_at)


@njit(nogil=True, cache=True)
def across(costs, sums, row_at, row_size, windows, tile_row, rightwards, penalties, row, count,
           small, paths, scratch):
    """
    Run `count` rows at once along the row through their tiles: rightwards begins their sums.

    costs, sums: uint8, rows from index row_at, row_size apart; penalties: uint8 (R, C), P2.
    """
    columns = penalties.shape[1]
    stride = paths.size // ROWS_AT_ONCE
    least = np.zeros(ROWS_AT_ONCE, np.uint8)
    tiles = windows.low.shape[1]
    previous = -1
    for visit in range(tiles):
        tile = visit if rightwards else tiles - 1 - visit
        low, blocks = windows.low[tile_row, tile], windows.blocks[tile_row, tile]
        for chain in range(count):
            if previous < 0:
                clear(paths, chain * stride, blocks)
            else:
                realign(paths, chain * stride, windows.blocks[tile_row, previous],
                        windows.low[tile_row, previous],
                        paths, chain * stride, blocks, low, scratch)
        begin = tile * windows.width
        end = min(begin + windows.width, columns)
        first = row_at + windows.offset[tile_row, tile]
        if blocks == 1 and count == ROWS_AT_ONCE:
            _pass_single(begin, end, rightwards, penalties, row, small, costs, sums, first,
                         row_size, paths, stride, least)
        else:
            _pass_tile(blocks, begin, end, rightwards, penalties, row, count, small, costs, sums,
                       first, row_size, paths, stride, least)
        previous = tile


@njit(nogil=True, cache=True)
def realign_rows(paths, new_paths, windows, tile_row, new_tile_row, columns, scratch):
    """Carry the paths of a whole row of pixels to the windows of another row of tiles."""
    for tile in range(windows.low.shape[1]):
        begin = tile * windows.width
        blocks, new_blocks = windows.blocks[tile_row, tile], windows.blocks[new_tile_row, tile]
        low, new_low = windows.low[tile_row, tile], windows.low[new_tile_row, tile]
        for column in range(begin, min(begin + windows.width, columns)):
            realign(paths, windows.offset[tile_row, tile] + (column - begin) * LANES * blocks,
                    blocks, low, new_paths,
                    windows.offset[new_tile_row, tile] + (column - begin) * LANES * new_blocks,
                    new_blocks, new_low, scratch)
