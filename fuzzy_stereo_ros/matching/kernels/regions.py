# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Connected regions, found in one pass: cells come row by row, and join those left and above."""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import root


@inlined
def region_of(parent, left, above, known):
    """
    Return the region of a cell, joining those of its neighbours; `known` where it is a new one.

    parent: int32, the union-find of the regions 1 .. known - 1, written; left, above: regions of
    the neighbours, 0 for none.
    """
    if left > 0:
        if above > 0 and above != left:
            one, two = root(parent, left), root(parent, above)
            parent[max(one, two)] = min(one, two)
        return left
    if above > 0:
        return above
    parent[known] = known
    return known


@inlined
def row_of(cell, row, columns):
    """Return the row of a cell, row * columns + column, from the row of one not behind it on."""
    while cell >= (row + 1) * columns:
        row += 1
    return row
