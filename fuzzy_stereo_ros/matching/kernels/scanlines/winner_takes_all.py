# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Winner takes all: the label of least summed cost, seen from the target, and sub-pixel offsets.

The offsets are of the equiangular fit (Shimizu and Okutomi, 2001).
"""
from fuzzy_stereo_ros.matching.kernels.addresses import load_byte, store_byte
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_costs import pixels_of
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, at_most, bit_and, bit_or, choose, equal, lane_numbers, LANES, less,
    load_like, lowest, maximum, narrow, reversed_lanes, saturating_add, shift_left, splat,
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
def _offer(left, none, place, cost, offers, found):
    """
    Offer the pixels of the target the labels of a vector of pixels, in ascending order.

    left: vector of labels, 8 or 16 bits, all of them set, `none`, where there is no pixel; place:
    where the first of them is offered with label 0, a vector lies before the target
    """
    label = np.int64(lowest(left))
    while label != none:        # the nearer of two later
        here = equal(left, splat_like(left, label))
        left, here = bit_or(left, here), narrow(here)
        at = place - label
        if at > 0:
            offered = load_like(cost, offers, at)
            taken = bit_and(here, at_most(cost, saturating_add(
                offered, splat_like(cost, HIDES))))
            store(offers, at, choose(taken, cost, offered))
            store(found, at, choose(
                taken, splat_like(cost, label), load_like(cost, found, at)))
        label = np.int64(lowest(left))


@inlined
def choose_of_target(chosen, columns, scratch, target, target_columns):
    """
    Give each target pixel the label of the cheapest pixel that points at it.

    The nearer of two that point at one pixel hides the other: it may cost HIDES more. All but the
    sizes are addresses of a row. chosen: labels, bytes of one, and their sums, uint8; scratch: see
    Scratch; target: uint8, labels modulo 256, 0 where no pixel points; its last columns are those
    of the pixels, any more come before them.
    """
    (labels, label_bytes, sums), extra = chosen, target_columns - columns
    kind = splat(np.uint8(0))
    full, lanes = splat_like(kind, 255), lane_numbers(kind)
    offers, found = scratch.offers, scratch.offers + LANES + target_columns
    for place in range(target_columns, 0, -LANES):      # a vector lies before the first one
        store(offers, place, full)
        store(found, place, kind)
    for column in range(0, columns, LANES):
        end = min(column + LANES, columns)
        low = pixels_of(kind, labels, label_bytes, 0, end, scratch.spare)
        low, cost = reversed_lanes(low, low), pixels_of(kind, sums, 1, 0, end, scratch.spare)
        cost = reversed_lanes(cost, cost)
        # what has had its turn, and columns that do not exist or belong to the vector before
        done = less(lanes, splat_like(kind, column + LANES - end))
        if label_bytes == 1:
            _offer(bit_or(low, done), 2**8 - 1, extra + end, cost, offers, found)
        else:
            high = pixels_of(kind, labels, label_bytes, 0, end, scratch.spare, 1)
            high = bit_or(reversed_lanes(high, high), done)
            wide = bit_or(widen(bit_or(low, done)), shift_left(widen(high), 8))
            _offer(wide, 2**16 - 1, extra + end, cost, offers, found)
    for column in range(target_columns):
        store_byte(target, column, load_byte(found, LANES + column))
