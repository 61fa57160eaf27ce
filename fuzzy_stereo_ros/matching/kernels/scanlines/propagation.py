# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Full-size genes from a half-size parent: inherited, mutated by one, and selected.

Not in the paper, whose cells mutate one by one. In a small tile the half-size map has few labels:
these genes, doubled and changed by one, are the candidates of all of the tile's cells, so that a
cell may inherit from its neighbours. Their costs are summed over neighbours of similar grey, down
the columns, then along the rows; a candidate that differs from the parent of the cell itself costs
more, up to CUT labels. The cheapest is selected. Vectors hold the pixels of a row, not
labels, from the right to the left: the pixels that one candidate points at lie side by side.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_short, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import cuts_of, raw_costs
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import (
    choose_of_target, fit_offsets)
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, at_most, bit_and, bit_or, choose, doubled, equal, LANES, less,
    load_like, minimum, multiply, reversed_lanes, saturating_add, shift_right, splat, splat_like,
    store, subtract)
import numpy as np

WIDE = 2 * LANES    # pixels of a vector
SUM_RADIUS = 3      # px, of the square of neighbours over which costs are summed
NEIGHBOURS_ALIKE = 12  # grey levels by which these may differ
SUM_PLACES = 2      # sums over columns are divided by 2**SUM_PLACES, to stay bytes
CUT = 4             # labels from the parent of a cell beyond which the cost does not grow
OWN, WEAK = 4, 20   # cost of each of these labels, and where texture is weak
TILE_ROWS = 16      # of a tile
TILE_COLUMNS = WIDE - 2 * (SUM_RADIUS + 1)  # of a tile: the sums of the others lack neighbours
GROW = 4            # px, even, around a tile whose genes it inherits
MOST_CANDIDATES = 255   # of a tile; the largest disparities are dropped
ROWS_AROUND = TILE_ROWS + 2 * SUM_RADIUS  # rows whose costs are needed
TAPS = 2 * SUM_RADIUS + 1
PAD = 8             # bytes around a vector, whose values have no effect
PADDED = WIDE + 2 * PAD


class Pair(NamedTuple):
    """A pair and its result; fields other than sizes and constants of the model are addresses."""

    rows: int
    columns: int             # from here on see Features
    disparities: int
    near_weight: int
    census_cut: int
    slope_cut: int
    census: int
    slopes: int
    target_census: int
    target_slopes: int
    census_stride: int
    slope_stride: int
    target_stride: int
    grey: int                # uint8 (R, grey_stride), of the reference
    grey_stride: int
    parents: int             # labels of the half-size chromosome at full size, see half_prior
    weights: int             # uint8 (R, C), above 0 where texture is weak
    label_bytes: int         # of parents and labels: 1 or 2
    last_parent: int         # a parent cannot be nearer
    target_columns: int
    labels: int              # from here on see SearchResult
    offsets: int
    sums: int
    margins: int
    target: int


class Tile(NamedTuple):
    """The addresses of the working memory of one band: bytes, but for `numbers`."""

    codes: int          # ROWS_AROUND rows of four planes: census and gradient, as vectors
    greys: int          # ROWS_AROUND rows, PADDED each
    down: int           # TILE_ROWS rows of TAPS vectors: which pixels of the column are alike
    across: int         # the same along the row
    costs: int          # ROWS_AROUND vectors, those of one candidate
    sums: int           # TILE_ROWS rows a candidate, PADDED each: sums over columns
    parents: int        # TILE_ROWS rows of two vectors: parents modulo 256, cost of a label away
    numbers: int        # uint16: the candidates
    inner: int          # 255 where both neighbours of a candidate are candidates
    seen: int           # a byte a label, and one before and behind them
    lines: int          # five vectors: the result of a row
    offers: int         # uint16: labels offered to the target's pixels


def sizes(labels, target_columns):
    """Return how many bytes each part of a Tile has."""
    alike = TILE_ROWS * TAPS * WIDE
    return Tile(ROWS_AROUND * 4 * WIDE, ROWS_AROUND * PADDED, alike, alike, ROWS_AROUND * WIDE,
                MOST_CANDIDATES * TILE_ROWS * PADDED, 2 * TILE_ROWS * WIDE,
                2 * (MOST_CANDIDATES + 1), MOST_CANDIDATES + 1, labels + 2, 5 * WIDE,
                2 * target_columns)


@inlined
def _copy_reversed(kind, source, at, start, columns, target, place):
    """Write a vector of pixels start .. of a row, the last one first; borders are repeated."""
    if start >= 0:
        pixels = load_like(kind, source, at + start)
        store(target, place, reversed_lanes(pixels, pixels))
    else:
        for lane in range(WIDE):
            column = min(max(start + WIDE - 1 - lane, 0), columns - 1)
            store_byte(target, place + lane, load_byte(source, at + column))


@inlined
def _inherit(pair, tile, top, below, left, right):
    """
    Write the candidates of a tile, ascending; return how many.

    The last label that a parent can have may stand for nearer ones: all are candidates.
    """
    least, largest = pair.disparities - 1, 0
    for row in range(max(top - GROW, 0), min(below + GROW, pair.rows), 2):
        at = row * pair.columns
        for column in range(max(left - GROW, 0), min(right + GROW, pair.columns), 2):
            label = np.int64(load_byte(pair.parents, at + column)) \
                if pair.label_bytes == 1 else np.int64(load_short(pair.parents, at + column))
            least, largest = min(least, label), max(largest, label)
            store_byte(tile.seen, label + 1, np.uint8(1))
    last = pair.disparities if largest >= pair.last_parent else min(largest + 2, pair.disparities)
    count = 0
    for label in range(max(least - 1, 0), last):
        near = (load_byte(tile.seen, label) | load_byte(tile.seen, label + 1)
                | load_byte(tile.seen, label + 2))
        if (near != 0 or label > largest) and count < MOST_CANDIDATES:
            store_short(tile.numbers, count, label)
            count += 1
    for label in range(least, largest + 1):
        store_byte(tile.seen, label + 1, np.uint8(0))
    for index in range(count):
        label = load_short(tile.numbers, index)
        inner = (0 < index < count - 1 and load_short(tile.numbers, index - 1) + 1 == label
                 and load_short(tile.numbers, index + 1) - 1 == label)
        store_byte(tile.inner, index, np.uint8(255) if inner else np.uint8(0))
    return count


@inlined
def _gather(pair, tile, kind, start, top, below):
    """Gather the inputs of a tile's costs and sums that do not depend on the candidate."""
    rows, columns = pair.rows, pair.columns
    for near in range(ROWS_AROUND):
        row = top - SUM_RADIUS + near
        if row < 0 or row >= rows:
            continue
        for plane in range(3):
            _copy_reversed(kind, pair.census, (3 * row + plane) * pair.census_stride, start,
                           columns, tile.codes, (4 * near + plane) * WIDE)
        _copy_reversed(kind, pair.slopes, row * pair.slope_stride, start, columns, tile.codes,
                       (4 * near + 3) * WIDE)
        _copy_reversed(kind, pair.grey, row * pair.grey_stride, start, columns, tile.greys,
                       near * PADDED + PAD)
    inside = splat_like(kind, 255)
    if start < 0:
        for lane in range(WIDE):
            store_byte(tile.lines, lane,
                       np.uint8(255) if start + WIDE - 1 - lane >= 0 else np.uint8(0))
        inside = load_like(kind, tile.lines, 0)
    reach = splat_like(kind, NEIGHBOURS_ALIKE)
    nothing = splat_like(kind, 0)
    for near in range(below - top):
        centre_at = (near + SUM_RADIUS) * PADDED + PAD
        centre = load_like(kind, tile.greys, centre_at)
        for tap in range(TAPS):
            row, place = top + near + tap - SUM_RADIUS, (near * TAPS + tap) * WIDE
            like = nothing
            if 0 <= row < rows:
                like = bit_and(inside, at_most(absolute_difference(
                    centre, load_like(kind, tile.greys, (near + tap) * PADDED + PAD)), reach))
            store(tile.down, place, like)
            store(tile.across, place, at_most(absolute_difference(
                centre, load_like(kind, tile.greys, centre_at + tap - SUM_RADIUS)), reach))


@inlined
def _gather_parents(pair, tile, kind, start, top, below):
    """Gather the parents of a tile's cells, and the cost of each label away from them."""
    columns, own, weak = pair.columns, splat_like(kind, OWN), splat_like(kind, WEAK - OWN)
    for near in range(below - top):
        at, place = (top + near) * columns, 2 * near * WIDE
        if pair.label_bytes == 1:
            _copy_reversed(kind, pair.parents, at, start, columns, tile.parents, place)
        else:
            for lane in range(WIDE):
                column = at + min(max(start + WIDE - 1 - lane, 0), columns - 1)
                store_byte(tile.parents, place + lane, np.uint8(
                    load_short(pair.parents, column) & 255))
        _copy_reversed(kind, pair.weights, at, start, columns, tile.parents, place + WIDE)
        weighty = less(splat_like(kind, 0), load_like(kind, tile.parents, place + WIDE))
        store(tile.parents, place + WIDE, add(own, bit_and(weighty, weak)))


@inlined
def _fill_costs(pair, tile, kind, label, start, top, height, cuts):
    """Write the costs of a candidate in the rows of a tile and around it."""
    pointed = pair.columns - WIDE - start + label
    for near in range(height + 2 * SUM_RADIUS):
        row, place = top - SUM_RADIUS + near, 4 * near * WIDE
        if 0 <= row < pair.rows:
            code = (load_like(kind, tile.codes, place), load_like(kind, tile.codes, place + WIDE),
                    load_like(kind, tile.codes, place + 2 * WIDE))
            store(tile.costs, near * WIDE, raw_costs(
                pair.target_census, 3 * row * pair.target_stride + pointed, pair.target_stride,
                pair.target_slopes, row * pair.target_stride + pointed, code,
                load_like(kind, tile.codes, place + 3 * WIDE), cuts))


@inlined
def _sum_columns(tile, kind, index, height):
    """Write the sums of the costs of a candidate over the like neighbours in the columns."""
    for near in range(height):
        total = splat_like(kind, 0)
        for tap in range(TAPS):
            total = add(total, bit_and(
                load_like(kind, tile.costs, (near + tap) * WIDE),
                load_like(kind, tile.down, (near * TAPS + tap) * WIDE)))
        store(tile.sums, (index * TILE_ROWS + near) * PADDED + PAD, shift_right(total, SUM_PLACES))


@inlined
def _summed(tile, kind, near, index, here):
    """Return the cost of a candidate in a row of a tile: distance from its parent, and sums."""
    parent = load_like(kind, tile.parents, 2 * near * WIDE)
    away = minimum(minimum(subtract(here, parent), subtract(parent, here)), splat_like(kind, CUT))
    total = multiply(away, load_like(kind, tile.parents, (2 * near + 1) * WIDE))
    row = (index * TILE_ROWS + near) * PADDED + PAD
    for tap in range(TAPS):
        total = saturating_add(total, bit_and(
            load_like(kind, tile.sums, row + tap - SUM_RADIUS),
            load_like(kind, tile.across, (near * TAPS + tap) * WIDE)))
    return total


@inlined
def _select(tile, kind, near, count):
    """
    Select the best of the candidates of a row of a tile, which come in ascending order.

    Written to `lines`: its index, its cost, those of the labels below and above it, and the least
    cost of the labels that are neither.
    """
    best = splat_like(kind, 255)
    chosen = splat_like(kind, 0)
    below = above = elsewhere = last = former = best
    before = np.int64(-2)
    for index in range(count):
        label = np.int64(load_short(tile.numbers, index))
        total = _summed(tile, kind, near, index, splat_like(kind, label & 255))
        better = less(total, best)
        # the best cost so far among the labels that are not beside this one
        beside = splat_like(kind, 255 if label == before + 1 else 0)
        beside_best = bit_and(beside, equal(chosen, splat_like(kind, index - 1)))
        apart = choose(beside, former, best)
        elsewhere = choose(better, apart, minimum(elsewhere, bit_or(total, beside_best)))
        below = choose(better, last, below)
        above = choose(beside_best, total, above)
        chosen = choose(better, splat_like(kind, index), chosen)
        former, last, before = best, total, label
        best = minimum(best, total)
    store(tile.lines, 0, reversed_lanes(chosen, chosen))
    store(tile.lines, WIDE, reversed_lanes(best, best))
    store(tile.lines, 2 * WIDE, reversed_lanes(below, below))
    store(tile.lines, 3 * WIDE, reversed_lanes(above, above))
    store(tile.lines, 4 * WIDE, reversed_lanes(elsewhere, elsewhere))


@inlined
def _hand_over(pair, tile, lane, at, width):
    """Write the selected genes of a row of a tile, from lane on; at: the first pixel."""
    indices, offsets = tile.lines + lane, pair.offsets + at
    least, elsewhere = indices + WIDE, indices + 4 * WIDE
    fit_offsets(indices + 2 * WIDE, least, indices + 3 * WIDE, width, offsets)
    for column in range(width):
        index = np.int64(load_byte(indices, column))
        store_byte(offsets, column, np.uint8(
            load_byte(offsets, column) & load_byte(tile.inner, index)))
        label = load_short(tile.numbers, index)
        if pair.label_bytes == 1:
            store_byte(pair.labels + at, column, np.uint8(label))
        else:
            store_short(pair.labels + 2 * at, column, label)
    for column in range(width):
        store_byte(pair.sums + at, column, load_byte(least, column))
        store_byte(pair.margins + at, column, np.uint8(
            load_byte(elsewhere, column) - load_byte(least, column)))


@kernel
def propagate(pair, tile, first, last):
    """
    Choose the genes of the rows first .. last - 1.

    pair, tile: the fields of a Pair and of a Tile
    """
    pair, tile = Pair(*pair), Tile(*tile)
    kind, columns = doubled(splat(np.uint8(0))), pair.columns
    cuts = cuts_of(pair, kind)
    for top in range(first, last, TILE_ROWS):
        below = min(top + TILE_ROWS, last)
        for left in range(0, columns, TILE_COLUMNS):
            right = min(left + TILE_COLUMNS, columns)
            start = min(max(left - SUM_RADIUS - 1, 0), columns - WIDE)
            count = _inherit(pair, tile, top, below, left, right)
            _gather(pair, tile, kind, start, top, below)
            _gather_parents(pair, tile, kind, start, top, below)
            for index in range(count):
                _fill_costs(pair, tile, kind, np.int64(load_short(tile.numbers, index)), start,
                            top, below - top, cuts)
                _sum_columns(tile, kind, index, below - top)
            for near in range(below - top):
                _select(tile, kind, near, count)
                _hand_over(pair, tile, left - start, (top + near) * columns + left, right - left)
        for row in range(top, below):
            at = row * columns
            choose_of_target(pair.labels + at * pair.label_bytes, pair.label_bytes,
                             pair.sums + at, columns, tile.offers,
                             pair.target + row * pair.target_columns, pair.target_columns)
