# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Winner takes all: the label of least summed cost, seen from the target, and sub-pixel offsets.

The offsets are of the equiangular fit (Shimizu and Okutomi, 2001).
"""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_long, load_short, store_byte)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_costs import NONE, pixels_of
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import SIDE
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, at_most, bit_and, choose, equal, equal_bits, lane_numbers, LANES,
    less, load_like, maximum, narrow, reversed_lanes, saturating_add, shift_left, splat,
    splat_like, store, subtract, widen)
from fuzzy_stereo_ros.matching.kernels.units import STEPS
import numpy as np

HIDES = 8           # summed cost by which a pixel may be dearer than one that it hides


@inlined
def fitted_offsets(below, least, above):
    """
    Return the minima of two lines of equal slope through three sums, in 1 / STEPS px, rounded.

    All are vectors of bytes, the offsets with a sign; 0 where a sum beside the least is 255.
    """
    highest, one = maximum(below, above), splat_like(least, 1)
    twice = shift_left(widen(absolute_difference(below, above)), 4)      # STEPS times
    rise = widen(maximum(subtract(highest, least), one))
    limit, more, offset = rise, add(rise, rise), subtract(rise, rise)
    for _ in range(STEPS // 2):
        offset = subtract(offset, at_most(limit, twice))
        limit = add(limit, more)
    offset = narrow(offset)
    away = subtract(subtract(one, one), offset)
    return bit_and(less(highest, splat_like(least, 255)),
                   choose(less(above, below), offset, away))


@inlined
def choose_of_target(chosen, columns, tiles, tile_row, scratch, target, target_columns):
    """
    Give each target pixel the label of the cheapest pixel that points at it.

    The nearer of two that point at one pixel hides the other: it may cost HIDES more. All but the
    sizes are addresses of a row. chosen: labels, bytes of one, and their sums, uint8; tiles: the
    `Tiles`, by whose order of genes the nearer of two comes later; scratch: see Scratch; target:
    uint8, labels modulo 256, 0 where no pixel points; its last columns are those of the pixels,
    any more come before them.
    """
    (labels, label_bytes, sums), extra = chosen, target_columns - columns
    kind = high = splat(np.uint8(0))
    none, full, lanes = kind, splat_like(kind, 255), lane_numbers(kind)
    offers, found = scratch.offers, scratch.offers + LANES + target_columns
    for place in range(target_columns, 0, -LANES):      # a vector lies before the first one
        store(offers, place, full)
        store(found, place, none)
    for column in range(tiles.columns):
        tile, end = tile_row * tiles.columns + column, min((column + 1) * SIDE, columns)
        own = at_most(splat_like(kind, (column + 1) * SIDE - end), lanes)
        low = pixels_of(kind, labels, label_bytes, 0, end, scratch.spare)
        low = reversed_lanes(low, low)
        if label_bytes == 2:
            high = pixels_of(kind, labels, label_bytes, 0, end, scratch.spare, 1)
            high = reversed_lanes(high, high)
        cost = pixels_of(kind, sums, 1, 0, end, scratch.spare)
        cost = reversed_lanes(cost, cost)
        genes = tiles.genes + 2 * tiles.stride * tile
        for index in range(load_long(tiles.counts, tile)):
            label = np.int64(load_short(genes, index))
            here = bit_and(own, bit_and(equal(low, splat_like(kind, label)),
                                        equal(high, splat_like(kind, label >> 8))))
            place = extra + end - label     # of column end - LANES, a vector before it
            if place > 0 and equal_bits(here, none) != NONE:
                known = load_like(kind, offers, place)
                taken = bit_and(here, at_most(cost, saturating_add(
                    known, splat_like(kind, HIDES))))
                store(offers, place, choose(taken, cost, known))
                store(found, place, choose(
                    taken, splat_like(kind, label), load_like(kind, found, place)))
    for column in range(target_columns):
        store_byte(target, column, load_byte(found, LANES + column))
