# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scanline passes: the least cost of a path that ends at a pixel, for each of its labels.

After Hirschmueller, Stereo processing by semi-global matching, 2008. A pass computes
L(p, d) = C(p, d) + min(L(q, d), L(q, d - 1) + P1, L(q, d + 1) + P1, min L(q) + P2) - min L(q)
in saturating uint8, q being the pixel before p. Four passes are summed: right, left, down, up.
Paths are kept with their least cost, min L(q), already taken off.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.simd import (
    doubled, label_above, label_below, LANES, load, lowest, minimum, saturating_add, splat,
    splat_like, store, subtract)
import numpy as np


@inlined
def in_registers(work, small, blocks, *arguments):
    """
    Return work(P1, *arguments), the number of columns done, for 1, 2 or 4 blocks of labels.

    P1 is a vector of all labels, whose paths so stay in registers. Other numbers of labels are too
    large for that: return 0.
    """
    penalty = splat(np.uint8(small))
    if blocks == 1:
        return work(penalty, *arguments)
    if blocks == 2:
        return work(doubled(penalty), *arguments)
    if blocks == 4:
        return work(doubled(doubled(penalty)), *arguments)
    return 0


@inlined
def advance(path, jump, penalty, costs):
    """
    Return L(p, d) of one, two or four blocks of labels; all arguments are vectors.

    path: L(q, d) - min L(q); jump, penalty: P2 and P1; costs: C(p, d).
    """
    full = splat_like(path, 255)
    neighbours = minimum(label_below(full, path), label_above(path, full))
    cheapest = minimum(minimum(path, jump), saturating_add(neighbours, penalty))
    return saturating_add(cheapest, costs)


@inlined
def step(path, blocks, jump, penalty, costs, sums, begins):
    """
    Move the paths of a pixel on to the next one and add them to its sums.

    path: address of `blocks` of 32 labels, read and written; jump, penalty: vectors of P2 and P1;
    costs, sums: addresses of those of the next pixel; begins: whether sums are overwritten.
    """
    full = splat(np.uint8(255))
    before, here, smallest = full, load(path, 0), full
    for block in range(blocks):
        offset = LANES * block
        after = load(path, offset + LANES) if block + 1 < blocks else full
        neighbours = minimum(label_below(before, here), label_above(here, after))
        cheapest = minimum(minimum(here, jump), saturating_add(neighbours, penalty))
        cost = saturating_add(cheapest, load(costs, offset))
        store(path, offset, cost)
        store(sums, offset, cost if begins else saturating_add(load(sums, offset), cost))
        smallest = minimum(smallest, cost)
        before, here = here, after
    floor = splat(lowest(smallest))
    for block in range(blocks):
        offset = LANES * block
        store(path, offset, subtract(load(path, offset), floor))


@inlined
def clear(path, at, blocks):
    """Write 0, the cost of each label where a path begins, to `blocks` blocks at path + at."""
    for block in range(blocks):
        store(path, at + LANES * block, splat(np.uint8(0)))
