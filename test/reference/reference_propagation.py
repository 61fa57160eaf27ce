# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plain twin of the propagation from the half-size chromosome: candidates, sums, choice.

Nothing is mirrored or packed: column c of an array is column c of the image.
"""
import numpy as np
from reference_census import equiangular


def candidates(parents, disparities, last_parent):
    """Return the candidates of a tile with these parents around it, ascending."""
    known = {int(label) for label in parents.flat}
    beside = {label + step for label in known for step in (-1, 0, 1)}
    if max(known) >= last_parent:
        beside |= set(range(max(known), disparities))
    return sorted(label for label in beside if 0 <= label < disparities)[:255]


def column_sums(costs, grey, radius, alike, places):
    """Return the costs (R, C, D) summed over the like pixels of the column, / 2**places, cut."""
    sums, rows = np.zeros_like(costs), len(grey)
    for row in range(rows):
        for other in range(max(row - radius, 0), min(row + radius + 1, rows)):
            like = abs(grey[row] - grey[other]) <= alike
            sums[row] += np.where(like[:, None], costs[other], 0)
    return sums // 2**places


def summed(costs, grey, radius, alike, places):
    """Return the sums over the like pixels of the row of the sums over those of the column."""
    sums = column_sums(costs, grey, radius, alike, places)
    return column_sums(sums.swapaxes(0, 1), grey.T, radius, alike, 0).swapaxes(0, 1)


def inheritance(parents, weights, disparities, cut, own, weak):
    """Return what a label costs that is not the parent's: int64 (R, C, D)."""
    away = abs(np.arange(disparities) - parents.astype(np.int64)[:, :, None]) % 256
    away = np.minimum(np.minimum(away, 256 - away), cut)
    return away * np.where(weights > 0, weak, own)[:, :, None]


def winner(totals, labels):
    """Return the first best of labels by their totals, its offset, total and margin."""
    place = int(np.argmin(totals))
    label, least = labels[place], int(totals[place])
    elsewhere = min((int(total) for other, total in zip(labels, totals) if abs(other - label) > 1),
                    default=255)
    offset = 0
    if {label - 1, label + 1} <= set(labels):
        offset = equiangular(int(totals[place - 1]), least, int(totals[place + 1]))
    return label, offset, least, elsewhere - least


def propagated(totals, parents, last_parent, bands, tile, grow):
    """
    Return labels, offsets, sums and margins of the candidates chosen, (R, C) each.

    totals: (R, C, D), at most 255; bands: (first, last) rows; tile: its rows and columns
    """
    maps = [np.zeros(parents.shape, np.int64) for _ in range(4)]
    columns = parents.shape[1]
    tops = [(top, min(top + tile[0], last)) for first, last in bands
            for top in range(first, last, tile[0])]
    for (top, below), left in ((rows, left) for rows in tops
                               for left in range(0, columns, tile[1])):
        around = parents[max(top - grow, 0):below + grow:2,
                         max(left - grow, 0):left + tile[1] + grow:2]
        labels = candidates(around, totals.shape[2], last_parent)
        for row in range(top, below):
            for column in range(left, min(left + tile[1], columns)):
                found = winner(totals[row, column, labels], labels)
                for values, value in zip(maps, found):
                    values[row, column] = value
    return maps
