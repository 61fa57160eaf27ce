# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sets that are joined, as a tree of parents: the representative of a set is its own parent."""
from fuzzy_stereo_ros.matching.kernels.compiled import called


@called
def root(parent, member):
    """Return the representative of a member's set, halving the way to it."""
    while parent[member] != member:
        parent[member] = parent[parent[member]]
        member = parent[member]
    return member


@called
def join(parent, one, two):
    """Join the sets of two members; return their representatives; the first, lesser one stays."""
    one, two = root(parent, one), root(parent, two)
    least, largest = min(one, two), max(one, two)
    parent[largest] = least
    return least, largest
