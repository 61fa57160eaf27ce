# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Winner takes all: the label of least summed cost, seen from the target, and sub-pixel offsets.

The offsets are of the equiangular fit (Shimizu and Okutomi, 2001).
"""
from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_short, store_byte, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, at_most, bit_and, choose, less, maximum, narrow, shift_left,
    splat_like, subtract, widen)
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
def choose_of_target(labels, label_bytes, sums, columns, offers, target, target_columns):
    """
    Give each target pixel the label of the cheapest pixel that points at it.

    The nearer of two that point at one pixel hides the other: it may cost HIDES more. All but the
    sizes are addresses of a row. labels: of 1 or 2 bytes; sums: uint8; offers: uint16, working
    memory; target: uint8, labels modulo 256, 0 where no pixel points; its last columns are those
    of the pixels, any more come before them.
    """
    extra = target_columns - columns
    for column in range(target_columns):
        store_short(offers, column, np.uint16(2**15))
        store_byte(target, column, np.uint8(0))
    for column in range(columns):       # the nearer of two comes later
        label = np.int64(load_byte(labels, column)) if label_bytes == 1 else np.int64(
            load_short(labels, column))
        pointed = column - label + extra
        if pointed >= 0:
            here, known = np.int64(load_byte(sums, column)), np.int64(load_short(offers, pointed))
            taken = here <= known + HIDES
            store_short(offers, pointed, here if taken else known)
            store_byte(target, pointed, label if taken else np.int64(load_byte(target, pointed)))
