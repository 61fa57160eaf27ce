# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fusion of two parents by a minimum cut: what surrounds the maximum flow, found by growing trees.

A choice x in {0, 1}^n costs sum alone_i x_i - sum weight_ij x_i x_j, weights not below 0. Twice
this is sum (2 alone_i - sum_j weight_ij) x_i + sum weight_ij |x_i - x_j|, whose least value is a
cut.

The flow is found after Boykov and Kolmogorov, An experimental comparison of min-cut/max-flow
algorithms for energy minimization in vision, 2004. A node is its place in a grid with a border;
direction d leads to the node at `offsets[d]`, and d ^ 1 back. A network of N nodes is the offsets,
int64 (D,); capacity, int32 (N, D), what still fits, symmetric at first, 0 out of the nodes that
take part; and supply, int32 (N,), what comes from the source, below 0 goes to the sink.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
import numpy as np

OUTSIDE, FREE, SOURCE, SINK = 2, 0, 1, -1   # no cell is there; what tree a node belongs to
ROOT, ORPHAN = 8, 9                 # parents that are no directions
_FAR = 2**30


class Trees(NamedTuple):
    """What is known of each node while the trees of the source and of the sink grow."""

    tree: np.ndarray         # int8 (N,), OUTSIDE, FREE, SOURCE or SINK
    parent: np.ndarray       # int8 (N,), a direction, ROOT or ORPHAN
    stamp: np.ndarray        # int32 (N,), when `distance` was found
    distance: np.ndarray     # int32 (N,), nodes to the root


@inlined
def _append(queue, end, node):
    """Append a node to a ring buffer; return the new end."""
    queue[end] = node
    return end + 1 if end + 1 < queue.size else 0


@inlined
def _after(queue, begin):
    """Return the place behind the first one of a ring buffer."""
    return begin + 1 if begin + 1 < queue.size else 0


@inlined
def _fits(capacity, node, other, direction, side):
    """Return what still fits on the way from the root of a tree: from the other node to a node."""
    return capacity[other, direction ^ 1] if side == SOURCE else capacity[node, direction]


@inlined
def _cut_off(parent, node, orphans, begin):
    """Put a node in front of the orphans; return their begin."""
    parent[node] = ORPHAN
    begin = begin - 1 if begin > 0 else orphans.size - 1
    orphans[begin] = node
    return begin


@called
def _narrowest(network, parent, node, side):
    """Return the least capacity from the root of the source to a node, or from it to the sink."""
    offsets, capacity, supply = network
    least = np.int64(_FAR) * 4
    while parent[node] != ROOT:
        direction = np.int64(parent[node])
        above = node + offsets[direction]
        least = min(least, np.int64(_fits(capacity, node, above, direction, side)))
        node = above
    return min(least, abs(np.int64(supply[node])))


@called
def _push(network, parent, node, flow, orphans, begin):
    """
    Send flow along that way; put nodes cut off in front of the orphans; return their begin.

    flow: above 0 to a node of the source's trees, below 0 to one of the sink's
    """
    offsets, capacity, supply = network
    side = SOURCE if flow > 0 else SINK
    while parent[node] != ROOT:
        direction = np.int64(parent[node])
        above = node + offsets[direction]
        capacity[node, direction] += flow
        capacity[above, direction ^ 1] -= flow
        if _fits(capacity, node, above, direction, side) == 0:
            begin = _cut_off(parent, node, orphans, begin)
        node = above
    supply[node] -= flow
    return begin if supply[node] else _cut_off(parent, node, orphans, begin)


@inlined
def _distance_to_root(offsets, trees, node, now):
    """Return how far a node is from its root, _FAR if it has none; remember it on the way."""
    parent, stamp, distance = trees.parent, trees.stamp, trees.distance
    far, place = 0, node
    while True:
        if stamp[place] == now:
            far += distance[place]
            break
        up = np.int64(parent[place])
        if up == ORPHAN:
            return _FAR
        far += 1
        if up == ROOT:
            stamp[place], distance[place] = now, 1
            break
        place += offsets[up]
    place, left = node, far
    while stamp[place] != now:
        stamp[place], distance[place] = now, left
        left -= 1
        place += offsets[np.int64(parent[place])]
    return far


@called
def _adopt(network, trees, now, queue, waiting, end, orphans, begin):
    """
    Find new parents for the orphans, or free them; return the new end of the queue.

    queue: int32 (> n,), ring buffer of the nodes from which trees may grow; waiting: bool (N,),
    which are in it; begin: place of the first orphan in their ring; the last one lies before
    place 0
    """
    stop = np.int64(0)
    offsets, capacity, _ = network
    tree, parent, stamp, distance = trees
    directions = offsets.size
    while begin != stop:
        node = np.int64(orphans[begin])
        begin = _after(orphans, begin)
        side = tree[node]
        nearest, chosen = _FAR, ORPHAN
        for direction in range(directions):
            other = node + offsets[direction]
            if tree[other] == side and _fits(capacity, node, other, direction, side) > 0:
                far = _distance_to_root(offsets, trees, other, now)
                if far < nearest:
                    nearest, chosen = far, direction
        parent[node] = chosen
        if chosen != ORPHAN:
            stamp[node], distance[node] = now, nearest + 1
            continue
        for direction in range(directions):
            other = node + offsets[direction]
            if tree[other] != side:
                continue
            if not waiting[other] and _fits(capacity, node, other, direction, side) > 0:
                waiting[other] = True
                end = _append(queue, end, other)
            if parent[other] == direction ^ 1:
                parent[other] = ORPHAN
                stop = _append(orphans, stop, other)
        tree[node] = FREE
    return end


@called
def _gather(nodes, network):
    """
    Send as much supply as fits from each node to earlier neighbours, from the last node on.

    Sources meet sinks, and few are left: the trees then need half the time.
    """
    offsets, capacity, supply = network
    for place in range(nodes.size - 1, -1, -1):
        node = np.int64(nodes[place])
        for direction in range(0, offsets.size, 2):
            other = node + offsets[direction]
            if supply[node] > 0:
                flow = min(supply[node], capacity[node, direction])
            else:
                flow = -min(-supply[node], capacity[other, direction + 1])
            supply[node] -= flow
            supply[other] += flow
            capacity[node, direction] -= flow
            capacity[other, direction + 1] += flow


@kernel
def load(alone, pairs, places, network, tree):
    """
    Write the costs of a choice into a grid with a border; places: int32 (n,), of the cells there.

    Pairs above 0, or with no cell, count as 0. Before, capacities are 0 and trees OUTSIDE.
    """
    offsets, capacity, supply = network
    for index in range(places.size):
        place = places[index]
        supply[place], tree[place] = -2 * alone[index], FREE
        for side in range(pairs.shape[1]):
            together, other = pairs[index, side], place + offsets[2 * side]
            if together < 0 and tree[other] != OUTSIDE:
                capacity[place, 2 * side] = capacity[other, 2 * side + 1] = -together
                supply[place] -= together
                supply[other] -= together


@kernel(allocates=True)
def maximum_flow(nodes, network, trees):
    """
    Send all the flow that fits; afterwards `tree` is SOURCE where a source still reaches.

    nodes: int32 (n,), those that take part
    """
    trees, (offsets, capacity, supply) = Trees(*trees), network
    tree, parent, stamp, distance = trees
    queue, orphans = np.empty(nodes.size + 1, np.int32), np.empty(nodes.size + 1, np.int32)
    waiting = np.zeros(tree.size, np.bool_)
    _gather(nodes, network)
    begin = end = 0
    for place in range(nodes.size):
        node = np.int64(nodes[place])
        stamp[node], tree[node], waiting[node] = 0, FREE, supply[node] != 0
        if supply[node] != 0:
            tree[node] = SOURCE if supply[node] > 0 else SINK
            parent[node], distance[node] = ROOT, 1
            end = _append(queue, end, node)
    now, directions = 0, offsets.size
    while begin != end:
        node = np.int64(queue[begin])
        side, met = tree[node], directions
        if side != FREE:
            for direction in range(directions):
                other = node + offsets[direction]
                if _fits(capacity, other, node, direction ^ 1, side) == 0:
                    continue
                if tree[other] == FREE:
                    tree[other], parent[other] = side, direction ^ 1
                    stamp[other], distance[other] = stamp[node], distance[node] + 1
                    if not waiting[other]:
                        waiting[other] = True
                        end = _append(queue, end, other)
                elif tree[other] != side:
                    met = direction
                    break
                elif stamp[other] <= stamp[node] and distance[other] > distance[node] + 1:
                    parent[other] = direction ^ 1
                    stamp[other], distance[other] = stamp[node], distance[node] + 1
        if met == directions:
            waiting[node] = False
            begin = _after(queue, begin)
            continue
        now += 1
        other = node + offsets[met]
        source, sink, across = (node, other, met) if side == SOURCE else (other, node, met ^ 1)
        flow = min(np.int64(capacity[source, across]),
                   _narrowest(network, parent, source, SOURCE),
                   _narrowest(network, parent, sink, SINK))
        capacity[source, across] -= flow
        capacity[sink, across ^ 1] += flow
        first = _push(network, parent, source, flow, orphans, 0)
        first = _push(network, parent, sink, -flow, orphans, first)
        end = _adopt(network, trees, now, queue, waiting, end, orphans, first)
