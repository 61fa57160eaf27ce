# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a plain region elects: the disparity for which its cells have the most evidence.

No estimate of noise is needed: the halves of a region elect disparities, too, and differ if the
evidence is chance.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.planes.plain_texture import BANDS, COUNTED
import numpy as np

GROUPS = 32          # of columns of cells, a power of 2: split into halves in GROUPS - 1 ways
VISIBLE = 0.3        # least share of visible pixels, of the most that any disparity has
APART = 3            # px from the best disparity; nearer ones count as the same
LEAST_LABELS = 2 * APART + 2  # that are visible, for an election
AGREE = 1            # px by which the choice of a half may differ from that of the region
LEAST_SPREAD = 1e-6
FACTS = 5            # of a region
MEAN, FINE, HALVES, BOTH = 0, 1, 3, 4


class Votes(NamedTuple):
    """The evidence of the cells of regions."""

    curves: np.ndarray       # int16 (cells, BANDS, labels), sums of products
    counts: np.ndarray       # int16 (cells, labels), candidates that are seen, in COUNTED-th rows
    cells: np.ndarray        # int32 (cells, 5): number of half-size pixels, sums of their columns,
    #                          rows and labels, and how many of these are inconsistent


class Election(NamedTuple):
    """What each region elects, and the evidence."""

    deviations: np.ndarray   # float64 (regions, labels)
    valid: np.ndarray        # bool (regions, labels), visible often enough
    best: np.ndarray         # int64 (regions,)
    facts: np.ndarray        # float64 (regions, FACTS): the MEAN of the deviations; from FINE on
    #                          the spreads of BANDS, deviations; the shares of HALVES that elect
    #                          the best, and of splits BOTH of whose halves do


@called
def _sum_groups(curves, counts, places, totals, squares, seen):
    """
    Sum the cells of a region by columns of cells, in GROUPS, in turn.

    totals: int32 (GROUPS, BANDS, labels); squares: float64 (GROUPS, BANDS), of the sums of single
    cells; seen: int32 (labels,)
    """
    totals[:], squares[:], seen[:] = 0, 0, 0
    for row in range(places.shape[0]):
        for column in range(places.shape[1]):
            place = places[row, column]
            if place < 0:
                continue
            mine, count = column % GROUPS, counts[place]
            for label in range(seen.size):
                seen[label] += np.int32(COUNTED) * count[label]
            for band in range(BANDS):
                target, curve, square = totals[mine, band], curves[place, band], np.int64(0)
                for label in range(seen.size):
                    target[label] += curve[label]
                    square += np.int64(np.int32(curve[label]) * np.int32(curve[label]))
                squares[mine, band] += square


@called
def _elect_by_halves(sums, valid, nearest, best):
    """
    Return the share of halves of a region that elect its label, and of splits where both do.

    The groups of a region are split into halves in as many ways as a Hadamard matrix has other
    rows. Splits with an empty half do not count. sums: float64 (GROUPS, labels + 1), of each group
    the evidence, and whether it has any, overwritten
    """
    labels, apart = valid.size, 1
    while apart < GROUPS:
        for group in range(GROUPS):
            if not group & apart:
                first, second = sums[group], sums[group + apart]
                for label in range(labels + 1):
                    total, difference = first[label] + second[label], first[label] - second[label]
                    first[label], second[label] = total, difference
        apart *= 2
    splits, agreed, both = 0, 0.0, 0.0
    for split in range(1, GROUPS):
        if abs(sums[split, labels]) == sums[0, labels]:
            continue
        agree = 0
        for sign in (1.0, -1.0):
            most, choice = -np.inf, -1 - AGREE
            for label in range(nearest, labels):
                half = sums[0, label] + sign * sums[split, label]
                if valid[label] and half > most:
                    most, choice = half, label
            agree += abs(choice - best) <= AGREE
        splits += 1
        agreed, both = agreed + agree / 2, both + (agree == 2)
    return agreed / max(splits, 1), both / max(splits, 1)


@kernel(allocates=True)
def elect(votes, places, nearest, election):
    """
    Have each region elect a label.

    votes: the fields of Votes; places: of number_cells; nearest: label from which on there is
    evidence; election: the fields of Election, written
    """
    (curves, counts, _), (deviations, valid, best, facts) = votes, election
    labels = deviations.shape[1]
    totals, squares = np.empty((GROUPS, BANDS, labels), np.int32), np.empty((GROUPS, BANDS))
    seen, sums = np.empty(labels, np.int32), np.empty((GROUPS, labels + 1))
    for region in range(len(places)):
        _sum_groups(curves, counts, places[region], totals, squares, seen)
        mine, visible, found = deviations[region], valid[region], facts[region]
        visible[:] = seen > VISIBLE * seen.max()
        visible &= visible.sum() >= LEAST_LABELS
        pixels = max(seen.sum(), 1)
        for band in range(BANDS):
            found[FINE + band] = np.sqrt(squares[:, band].sum() / pixels) + LEAST_SPREAD
        mine[:] = 0
        for group in range(GROUPS):
            fine, coarse = totals[group, 0], totals[group, 1]
            for label in range(labels):
                evidence = ((fine[label] / found[FINE] + coarse[label] / found[FINE + 1])
                            / np.sqrt(np.float64(max(seen[label], 1))))
                sums[group, label] = evidence
                mine[label] += evidence
            sums[group, labels] = squares[group, 0] + squares[group, 1] > 0
        total = number = 0.0
        most, chosen = -np.inf, 0
        for label in range(labels):
            if visible[label]:
                total, number = total + mine[label], number + 1
                if label >= nearest and mine[label] > most:
                    most, chosen = mine[label], label
        found[MEAN], best[region] = total / max(number, 1.0), chosen
        found[HALVES], found[BOTH] = _elect_by_halves(sums, visible, nearest, chosen)
