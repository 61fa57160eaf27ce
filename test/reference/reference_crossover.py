# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of crossovers over an exchange of genes."""
import numpy as np

EARLIER = {4: [(0, -1), (-1, 0)], 8: [(0, -1), (-1, -1), (-1, 0), (-1, 1)]}


def pairs_of(exchange):
    """Return (index, index of the earlier neighbour, side) of all pairs of cells."""
    places = {divmod(int(cell), exchange.shape[1]): index
              for index, cell in enumerate(exchange.cells)}
    return [(index, places[row + down, column + right], side)
            for (row, column), index in places.items()
            for side, (down, right) in enumerate(EARLIER[exchange.neighbours])
            if (row + down, column + right) in places]


def change_of(exchange, taken):
    """Return the change of cost where some cells are taken."""
    total = sum(int(alone) for alone, mine in zip(exchange.alone, taken) if mine)
    return total + sum(int(exchange.pairs[one, side]) for one, other, side in pairs_of(exchange)
                       if taken[one] and taken[other])


def regions(exchange, advantage=0):
    """Return which cells are taken where each connected region is, if it gains enough."""
    region = np.arange(exchange.cells.size)
    for one, other, _ in pairs_of(exchange):
        region[region == region[one]] = region[other]
    taken = np.zeros(exchange.cells.size, bool)
    for inside in (region == number for number in set(region)):
        if change_of(exchange, inside) + advantage * inside.sum() < 0:
            taken |= inside
    return taken
