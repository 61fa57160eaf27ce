# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Selection: of the genes of its tile each cell gets the one whose sum of four paths is least.

After Hirschmueller, Stereo processing by semi-global matching, 2008. A path computes
L(p, d) = C(p, d) + min(L(q, d), L(q, d - 1) + P1, L(q, d + 1) + P1, min L(q) + P2) - min L(q)
in saturating uint8, q being the pixel before p, among the genes d of a tile. In another tile it
goes on in the genes that both have, and by a jump in others. Vectors hold cells, not labels:
of a row of a tile for vertical paths, from its last column to the left, since the target pixels
that a gene points at lie side by side then; of a column for horizontal paths. In memory the
vectors of the genes of such a line lie one behind the other, and so do the lines of a tile.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_long, load_short, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Features
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_costs import (
    fetch_features, fill_costs, pixels_of)
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import (
    AHEAD, seen_size, SIDE, stride_of, Tiles)
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import (
    choose_of_target, fitted_offsets)
from fuzzy_stereo_ros.matching.kernels.simd import (
    bit_and, bit_or, choose, LANES, less, LINE, load_like, minimum, prefetch, reversed_lanes,
    saturating_add, saturating_subtract, shift_left, splat, splat_like, store, subtract, transpose,
    widen)
import numpy as np

SQUARE = LANES * LANES      # bytes of a gene of a tile


class Penalties(NamedTuple):
    """What changes of disparity cost."""

    small: int               # P1, a change by one
    across: np.ndarray       # uint8 (R, C), P2 to the left neighbour
    down: np.ndarray         # uint8 (R, C), P2 to the upper neighbour


class SearchResult(NamedTuple):
    """What is selected."""

    labels: np.ndarray       # uint8 or uint16 (R, C)
    offsets: np.ndarray      # int8 (R, C), 1/16 px
    sums: np.ndarray         # uint8 (R, C), summed cost of the label
    margins: np.ndarray      # uint8 (R, C), how much worse the best label elsewhere is
    target: np.ndarray       # uint8 (R, extra + C), the target's labels modulo 256


class Found(NamedTuple):
    """What a selection reads and writes; all but numbers are addresses."""

    rows: int
    small: int               # P1
    box: int                 # costs are sums of 3 x 3 pixels / 2**box; 0: of one pixel
    across: int              # P2, see Penalties
    down: int
    label_bytes: int         # 1 or 2, of labels here
    half_labels: int         # the priors, see Prior
    half_weights: int
    previous_labels: int
    previous_weights: int
    costs: int               # see Tiles.places
    sums: int
    labels: int              # see SearchResult
    offsets: int
    least: int
    margins: int


class Scratch(NamedTuple):
    """Addresses of the working memory of a call, see `scratch_sizes`."""

    seen: int                # marks of labels, of tile_genes.py
    paths: int               # to a row or a column of a tile, between two that cost 255
    carried: int             # the same, while they are carried to another tile
    steps: int               # P1 from the gene before, 255 where that is not beside it
    spare: int               # two vectors
    offers: int              # what the target's pixels are offered, and of which label
    jumps: int               # P2 along the rows of a row of tiles, by columns


def scratch_sizes(disparities, most, tile_columns, target_columns):
    """Return the bytes of each part of a Scratch; most: genes of a tile."""
    paths = (most + 2) * LANES
    return (seen_size(disparities), paths, paths, paths, 2 * LANES,
            2 * (LANES + target_columns), tile_columns * SQUARE)


@inlined
def _enter(found, genes, count, scratch):
    """Write the steps between the genes of a tile."""
    kind = splat(np.uint8(0))
    before = np.int64(-2)
    for index in range(count):
        label = np.int64(load_short(genes, index))
        store(scratch.steps, index * LANES, splat_like(
            kind, found.small if label == before + 1 else 255))
        before = label
    store(scratch.steps, count * LANES, splat_like(kind, 255))


@inlined
def _begin(found, tiles, tile, scratch):
    """Begin the paths of a tile with 0; a path that costs 255 lies before and behind them."""
    kind, count = splat(np.uint8(0)), load_long(tiles.counts, tile)
    for index in range(1, count + 1):
        store(scratch.paths, index * LANES, kind)
    store(scratch.paths, 0, splat_like(kind, 255))
    store(scratch.paths, (count + 1) * LANES, splat_like(kind, 255))
    _enter(found, tiles.genes + 2 * tiles.stride * tile, count, scratch)
    return kind


@called
def _carry(found, tiles, tile, other, least, scratch):
    """
    Carry the paths of a tile to another one: 255 where it lacks a gene; return their least, 0.

    least: the least of the paths, which is taken off
    """
    count, number = load_long(tiles.counts, tile), load_long(tiles.counts, other)
    genes = tiles.genes + 2 * tiles.stride * tile
    others, full = tiles.genes + 2 * tiles.stride * other, splat_like(least, 255)
    at = 0
    for index in range(number):
        label = load_short(others, index)
        while at < count and load_short(genes, at) < label:
            at += 1
        path = full
        if at < count and load_short(genes, at) == label:
            path = saturating_subtract(load_like(least, scratch.paths, (at + 1) * LANES), least)
        store(scratch.carried, index * LANES, path)
    for index in range(number):
        store(scratch.paths, (index + 1) * LANES,
              load_like(least, scratch.carried, index * LANES))
    store(scratch.paths, (number + 1) * LANES, full)
    _enter(found, others, number, scratch)
    return subtract(least, least)


@inlined
def _moved_on(index, scratch, before, here, step, jump, least, cost):
    """
    Move the path of a gene of a tile on.

    before, here: the paths to the gene before and to this one; step: between the two. Returns the
    path, that to the gene behind as it was, and the step to that.
    """
    after = saturating_subtract(load_like(jump, scratch.paths, (index + 2) * LANES), least)
    next_step = load_like(jump, scratch.steps, (index + 1) * LANES)
    beside = minimum(saturating_add(before, step), saturating_add(after, next_step))
    path = saturating_add(minimum(minimum(here, jump), beside), cost)
    store(scratch.paths, (index + 1) * LANES, path)
    return path, after, next_step


@inlined
def _move(count, scratch, jump, least, costs, sums, begins):
    """
    Move the paths of all genes of a tile on, and begin sums or add to them; return the least.

    jump, least: vectors of P2 and of the least of the paths before; costs, sums: of the first gene
    """
    full = splat_like(jump, 255)
    before, here = full, saturating_subtract(load_like(jump, scratch.paths, LANES), least)
    step, smallest = full, full
    for index in range(count):
        path, after, next_step = _moved_on(index, scratch, before, here, step, jump, least,
                                           load_like(jump, costs, index * LANES))
        store(sums, index * LANES, path if begins else saturating_add(
            path, load_like(jump, sums, index * LANES)))
        smallest = minimum(smallest, path)
        before, here, step = here, after, next_step
    return smallest


@called
def _transpose(squares, count, stride):
    """Transpose the squares of so many genes of a tile in their place."""
    for square in range(squares, squares + count * LANES, LANES):
        transpose(square, stride)


@inlined
def _move_across(tiles, tile, width, scratch, jump, least, costs, sums, leftwards):
    """
    Move the paths along the rows through a tile; return the last jump and the least path.

    costs, sums: of the tile, vectors of columns
    """
    count, jumps = load_long(tiles.counts, tile), scratch.jumps + tile % tiles.columns * SQUARE
    stride = stride_of(count)
    for near in range(width):
        column = near if leftwards else width - 1 - near
        here = load_like(jump, jumps, column * LANES)
        least = _move(count, scratch, jump if leftwards else here, least,
                      costs + column * stride, sums + column * stride, not leftwards)
        jump = here
    return jump, least


@kernel
def sum_across(features, found, tiles, scratch, first, last):
    """
    Write the costs of the rows of tiles first .. last - 1, and the sums of the paths along them.

    Both are transposed in their place while paths move along rows: so they stay in the cache.
    """
    features, found, tiles = Features(*features), Found(*found), Tiles(*tiles)
    scratch, kind, columns = Scratch(*scratch), splat(np.uint8(0)), features.columns
    rows = found.rows
    for tile_row in range(first, last):
        top, below = tile_row * SIDE, min((tile_row + 1) * SIDE, rows)
        least = kind
        for column in range(tiles.columns):
            tile, end = tile_row * tiles.columns + column, min((column + 1) * SIDE, columns)
            count, place = load_long(tiles.counts, tile), load_long(tiles.places, tile)
            costs, sums, stride = found.costs + place, found.sums + place, stride_of(count)
            for line in range(sums, sums + SIDE * stride, LINE):
                prefetch(line)
            fill_costs(features, found, tiles.genes + 2 * tiles.stride * tile, count, top, below,
                       end, costs, scratch.spare)
            jumps = scratch.jumps + column * SQUARE
            for row in range(top, below):
                store(jumps, (row - top) * LANES, pixels_of(
                    kind, found.across, 1, row * columns, end, scratch.spare))
            _transpose(jumps, 1, LANES)
            _transpose(costs, count, stride)
            least = (_begin(found, tiles, tile, scratch) if column == 0 else
                     _carry(found, tiles, tile - 1, tile, least, scratch))
            if column + 1 < tiles.columns:
                label = np.int64(load_short(tiles.genes, tiles.stride * (tile + 1)))
                for row in range(top, top + AHEAD):
                    fetch_features(features, found, label, row, min((column + 2) * SIDE, columns))
            _, least = _move_across(tiles, tile, end - column * SIDE, scratch, kind, least,
                                    costs, sums, False)
        jump = kind
        for column in range(tiles.columns - 1, -1, -1):
            tile, end = tile_row * tiles.columns + column, min((column + 1) * SIDE, columns)
            count, place = load_long(tiles.counts, tile), load_long(tiles.places, tile)
            least = (_begin(found, tiles, tile, scratch) if column == tiles.columns - 1 else
                     _carry(found, tiles, tile + 1, tile, least, scratch))
            costs, sums, stride = found.costs + place, found.sums + place, stride_of(count)
            jump, least = _move_across(tiles, tile, end - column * SIDE, scratch, jump, least,
                                       costs, sums, True)
            _transpose(costs, count, stride)
            _transpose(sums, count, stride)


@inlined
def _select(genes, count, scratch, jump, least, costs, sums):
    """
    Move the upward paths of a row of a tile on, and select; return vectors.

    The least of the paths; the genes selected modulo 256, and / 256; their sums, those of the
    labels below and above them, 255 where these are no genes; the least sum of all others.
    """
    full = splat_like(jump, 255)
    zero = subtract(jump, jump)
    before, here = full, saturating_subtract(load_like(jump, scratch.paths, LANES), least)
    step, smallest = full, full
    best = former = last = below = above = elsewhere = full
    took = zero
    first = np.int64(load_short(genes, 0))
    low, high = splat_like(jump, first), splat_like(jump, first >> 8)
    for index in range(count):
        path, after, next_step = _moved_on(index, scratch, before, here, step, jump, least,
                                           load_like(jump, costs, index * LANES))
        smallest = minimum(smallest, path)
        total = saturating_add(path, load_like(jump, sums, index * LANES))
        better, linked = less(total, best), less(step, full)
        after_best = bit_and(took, linked)
        elsewhere = choose(better, choose(linked, former, best),
                           minimum(elsewhere, bit_or(total, after_best)))
        below = choose(better, choose(linked, last, full), below)
        above = choose(better, full, choose(after_best, total, above))
        label = np.int64(load_short(genes, index))
        low = choose(better, splat_like(jump, label), low)
        high = choose(better, splat_like(jump, label >> 8), high)
        former, last, took = best, total, better
        best = minimum(best, total)
        before, here, step = here, after, next_step
    return smallest, low, high, best, below, above, elsewhere


@inlined
def _write(memory, at, end, width, values, spare):
    """Write the first lanes, as many as a tile is wide, to a row: the first to column end - 1."""
    line = reversed_lanes(values, values)
    if width == LANES:
        store(memory, at + end - LANES, line)
    else:
        store(spare, 0, line)
        for lane in range(LANES - width, LANES):
            store_byte(memory, at + end - LANES + lane, load_byte(spare, lane))


@inlined
def _write_labels(found, at, end, width, low, high, spare):
    """Write the selected labels of a row of a tile, see `_write`."""
    if found.label_bytes == 1:
        _write(found.labels, at, end, width, low, spare)
        return
    low, high = reversed_lanes(low, low), reversed_lanes(high, high)
    if width == LANES:
        store(found.labels, 2 * (at + end - LANES), bit_or(widen(low), shift_left(widen(high), 8)))
    else:
        store(spare, 0, low)
        store(spare, LANES, high)
        for lane in range(LANES - width, LANES):
            store_short(found.labels, at + end - LANES + lane, np.uint16(
                np.int64(load_byte(spare, lane)) + 256 * np.int64(load_byte(spare, LANES + lane))))


@kernel
def select_down(features, found, tiles, scratch, first, last):
    """Add the vertical paths of the columns of tiles first .. last - 1 to the sums, and select."""
    features, found, tiles = Features(*features), Found(*found), Tiles(*tiles)
    scratch, kind, columns = Scratch(*scratch), splat(np.uint8(0)), features.columns
    for column in range(first, last):
        begin, end, least = column * SIDE, min((column + 1) * SIDE, columns), kind
        for tile_row in range(tiles.rows):
            tile = tile_row * tiles.columns + column
            least = (_begin(found, tiles, tile, scratch) if tile_row == 0 else
                     _carry(found, tiles, tile - tiles.columns, tile, least, scratch))
            count, place = load_long(tiles.counts, tile), load_long(tiles.places, tile)
            for row in range(tile_row * SIDE, min((tile_row + 1) * SIDE, found.rows)):
                at = place + row % SIDE * stride_of(count)
                prefetch(found.down + (row + AHEAD) * columns + begin)
                jump = pixels_of(kind, found.down, 1, row * columns, end, scratch.spare)
                least = _move(count, scratch, jump, least, found.costs + at, found.sums + at,
                              False)
        jump = kind
        for tile_row in range(tiles.rows - 1, -1, -1):
            tile = tile_row * tiles.columns + column
            least = (_begin(found, tiles, tile, scratch) if tile_row == tiles.rows - 1 else
                     _carry(found, tiles, tile + tiles.columns, tile, least, scratch))
            count, place = load_long(tiles.counts, tile), load_long(tiles.places, tile)
            genes = tiles.genes + 2 * tiles.stride * tile
            for row in range(min((tile_row + 1) * SIDE, found.rows) - 1, tile_row * SIDE - 1, -1):
                at = place + row % SIDE * stride_of(count)
                ahead = (row - AHEAD) * columns + begin
                prefetch(found.labels + ahead * found.label_bytes)
                for values in (found.down, found.offsets, found.least, found.margins):
                    prefetch(values + ahead)
                least, low, high, best, below, above, elsewhere = _select(
                    genes, count, scratch, jump, least, found.costs + at, found.sums + at)
                out, width, spare = row * columns, end - begin, scratch.spare
                _write_labels(found, out, end, width, low, high, spare)
                _write(found.least, out, end, width, best, spare)
                _write(found.margins, out, end, width, saturating_subtract(elsewhere, best), spare)
                _write(found.offsets, out, end, width, fitted_offsets(below, best, above), spare)
                jump = pixels_of(kind, found.down, 1, out, end, spare)


@kernel
def select_of_target(found, scratch, columns, target, target_columns, first, last):
    """
    Select the labels of the target's rows first .. last - 1, once those of the pixels are.

    columns, target_columns: of a row of the pixels, of the target; target: address, see
    SearchResult
    """
    found, scratch = Found(*found), Scratch(*scratch)
    for row in range(first, last):
        at = row * columns
        choose_of_target((found.labels + at * found.label_bytes, found.label_bytes,
                          found.least + at), columns, scratch, target + row * target_columns,
                         target_columns)
