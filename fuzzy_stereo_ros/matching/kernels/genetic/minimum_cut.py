# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fusion of two parents by a minimum cut: what surrounds the maximum flow.

A choice x in {0, 1}^n costs sum alone_i x_i - sum weight_ij x_i x_j, weights not below 0. A cell
that gains by itself is taken at once, one that does not gain with all of its neighbours is left;
either may decide its neighbours. Twice the cost of the others is
sum (2 alone_i - sum_j weight_ij) x_i + sum weight_ij |x_i - x_j|, whose least value is a cut.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import row_of
from fuzzy_stereo_ros.matching.kernels.genetic.max_flow import SOURCE
import numpy as np

LEFT, OPEN, TAKEN = 0, 1, 2     # what is known of a cell; others are left


@kernel
def load(cells, alone, pairs, columns, offsets, places, weight, change, state):
    """
    Write the costs of a choice into a grid with a border: int32 places (n,) of the cells there.

    cells, alone, pairs: see crossover.Exchange; pairs above 0, or with no cell, count as 0;
    weight: int32 (N, D), change: int32 (N,), state: uint8 (N,). weight and state are 0 before.
    """
    row = 0
    for index in range(cells.size):
        row = row_of(cells[index], row, columns)
        place = cells[index] + row + columns + 2
        places[index], change[place], state[place] = place, alone[index], OPEN
        for side in range(pairs.shape[1]):
            together, other = pairs[index, side], place + offsets[2 * side]
            if together < 0 and state[other] == OPEN:
                weight[place, 2 * side] = weight[other, 2 * side + 1] = -together


@inlined
def _decided(change, room):
    return change < 0 or room >= 0


@kernel
def decide(places, offsets, weight, change, room, state, stack):
    """
    Take or leave all cells that need no cut; return how many are open, whose places come first.

    places: int32 (n,); change: int32 (N,), what a cell costs if no open neighbour is taken; room:
    int32 (N,), if all of them are; state: uint8 (N,); stack: int32 (n,), memory.
    """
    for index in range(places.size):
        place = np.int64(places[index])
        room[place] = change[place]
        for direction in range(offsets.size):
            room[place] -= weight[place, direction]
    for index in range(places.size):
        place, height = np.int64(places[index]), 0
        if state[place] == OPEN and _decided(change[place], room[place]):
            stack[0], height = place, 1
        while height > 0:
            height -= 1
            place = np.int64(stack[height])
            taken = change[place] < 0
            state[place] = TAKEN if taken else LEFT
            for direction in range(offsets.size):
                pays = weight[place, direction]
                if pays == 0:
                    continue
                other = place + offsets[direction]
                weight[place, direction] = weight[other, direction ^ 1] = 0
                before = _decided(change[other], room[other])
                if taken:
                    change[other] -= pays
                else:
                    room[other] += pays
                if not before and _decided(change[other], room[other]):
                    stack[height] = other
                    height += 1
    number = 0
    for index in range(places.size):
        place = places[index]
        if state[place] == OPEN:
            stack[number] = place
            change[place] = -(change[place] + room[place])
            number += 1
    return number


@kernel
def unload(places, state, tree, weight, taken):
    """
    Write which cells are taken, and let the weights and states of all cells be 0 again.

    places: int32 (n,); tree: int8 (N,), of the flow over the open cells; taken: bool (n,)
    """
    for index in range(places.size):
        place = places[index]
        taken[index] = state[place] == TAKEN or (state[place] == OPEN and tree[place] == SOURCE)
        weight[place, :], state[place] = 0, LEFT
