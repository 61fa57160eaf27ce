# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The costs of the genes of a tile at its cells, priors included, see selection.py."""
from fuzzy_stereo_ros.matching.kernels.addresses import load_byte, load_short, store_byte
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.possibility.costs import cuts_of, DEAD_ZONE, raw_costs
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import AHEAD, stride_of
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, bit_and, equal_bits, label_above, label_below, LANES, LINE, load_like, minimum, narrow,
    prefetch, reversed_lanes, saturating_subtract, shift_right, splat, splat_like, store,
    subtract, widen)
import numpy as np

NONE = np.uint32(2**LANES - 1)      # of the lanes of a prior have weight


@inlined
def pixels_of(kind, numbers, number_bytes, at, end, spare, byte=0):
    """
    Return 32 bytes of a row, each the first or another byte of a number, from end - 1 to the left.

    at: index of column 0; columns before it repeat it
    """
    if end >= LANES and number_bytes == 1:
        pixels = load_like(kind, numbers, at + end - LANES)
    elif end >= LANES:
        pixels = narrow(shift_right(
            load_like(widen(kind), numbers, 2 * (at + end - LANES)), 8 * byte))
    else:
        for lane in range(LANES):
            store_byte(spare, lane, load_byte(
                numbers, number_bytes * (at + max(end - LANES + lane, 0)) + byte))
        pixels = load_like(kind, spare, 0)
    return reversed_lanes(pixels, pixels)


@inlined
def _prior_costs(label, prior):
    """Return what a prior adds to the cost of a label: vectors of its labels, dead zone, cut."""
    known, dead_zone, cut, _ = prior
    away = minimum(subtract(known, label), subtract(label, known))      # modulo 256
    return minimum(saturating_subtract(away, dead_zone), cut)


@inlined
def _prior(kind, labels, weights, label_bytes, at, end, spare):
    """
    Return a prior in a row of a tile: labels, dead zones, cuts, and lanes without weight.

    The last has a bit for each lane.
    """
    weight = pixels_of(kind, weights, 1, at, end, spare)
    return (pixels_of(kind, labels, label_bytes, at, end, spare), shift_right(weight, DEAD_ZONE),
            bit_and(weight, splat_like(kind, 2**DEAD_ZONE - 1)), equal_bits(weight, kind))


@inlined
def _sum_across(kind, line):
    """Return the sums of three neighbours in a row of a tile, whose ends repeat."""
    here = load_like(kind, line, 0)
    ends = reversed_lanes(here, here)
    return add(here, add(label_below(ends, here), label_above(here, ends)))


@inlined
def _sum_boxes(kind, costs, stride, rows, places):
    """Write the sums of 3 x 3 cells / 2**places over the costs of a gene; borders repeat."""
    above = here = _sum_across(kind, costs)
    for row in range(rows):
        below = _sum_across(kind, costs + (row + 1) * stride) if row + 1 < rows else here
        store(costs, row * stride, shift_right(add(above, add(here, below)), places))
        above, here = here, below


@inlined
def fetch_features(features, found, label, row, end):
    """Have features and priors of a row of a tile on their way; label: its first gene."""
    first, pointed = end - LANES, features.columns - end + label
    for plane in range(3 * row, 3 * row + 3):
        prefetch(features.census + plane * features.census_stride + first)
        target = features.target_census + plane * features.target_stride + pointed
        prefetch(target)
        prefetch(target + LINE)
    prefetch(features.slopes + row * features.slope_stride + first)
    prefetch(features.target_slopes + row * features.target_stride + pointed)
    at = row * features.columns + first
    for labels, weights in ((found.half_labels, found.half_weights),
                            (found.previous_labels, found.previous_weights)):
        prefetch(labels + at * found.label_bytes)
        prefetch(weights + at)


@called
def fill_costs(features, found, genes, count, top, below, end, costs, spare):
    """Write the costs of the genes of a tile, whose last column is end - 1, priors included."""
    kind = splat(np.uint8(0))
    cuts, stride = cuts_of(features, kind), features.census_stride
    pointed, target_stride = features.columns - end, features.target_stride
    line = stride_of(count)
    for row in range(top, below):
        code = (pixels_of(kind, features.census, 1, 3 * row * stride, end, spare),
                pixels_of(kind, features.census, 1, (3 * row + 1) * stride, end, spare),
                pixels_of(kind, features.census, 1, (3 * row + 2) * stride, end, spare))
        slope = pixels_of(kind, features.slopes, 1, row * features.slope_stride, end, spare)
        at = row * features.columns
        fetch_features(features, found, np.int64(load_short(genes, 0)), row + AHEAD, end)
        half = _prior(kind, found.half_labels, found.half_weights, found.label_bytes, at, end,
                      spare)
        previous = _prior(kind, found.previous_labels, found.previous_weights, found.label_bytes,
                          at, end, spare)
        of_half, of_previous = half[3] != NONE, previous[3] != NONE
        for index in range(count):
            label = np.int64(load_short(genes, index))
            place = row * target_stride + pointed + label
            cost = raw_costs(features.target_census, place + 2 * row * target_stride,
                             target_stride, features.target_slopes, place, code, slope, cuts)
            if of_half:
                cost = add(cost, _prior_costs(splat_like(kind, label), half))
            if of_previous:
                cost = add(cost, _prior_costs(splat_like(kind, label), previous))
            store(costs, (row - top) * line + index * LANES, cost)
    if found.box:
        for gene in range(costs, costs + count * LANES, LANES):
            _sum_boxes(kind, gene, line, below - top, found.box)
