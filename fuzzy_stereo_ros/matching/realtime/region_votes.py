# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What plain regions vote for, how sure that is, and whether they take it.

No estimate of noise is needed. A region is split into halves in many ways, and each half elects a
disparity of its own: if the evidence is chance, they differ. Halves are of whole columns, since
columns of a sensor differ. A map found by chance is as often consistent as not, so that
inconsistent pixels tell how much of a map is right.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.planes import region_votes as kernels
from fuzzy_stereo_ros.matching.kernels.planes.plain_regions import BANDS
import numpy as np

GROUPS = 32          # of columns of cells, a power of 2: split into halves in GROUPS - 1 ways
VISIBLE = 0.3        # least share of visible pixels, of the most that any disparity has
LEAST_LABELS = 2 * kernels.APART + 2  # that are visible, for an election
CHANCE = 0.6         # share of splits whose halves agree on noise, in one region of fifty
AGREE = 1            # px by which the choice of a half may differ from that of the region
LEAD = 2.0           # deviations by which a plane must exceed what is consistent of the map
DECISIVE = 4.0       # mean deviations of the plane in 3 x 3 cells from which windows can match it
LENIENT = -2.5       # deviations by which the map may exceed the plane in cells that accept it
SURE = 255           # of a certainty


class Election(NamedTuple):
    """What each region elects, and the evidence."""

    deviations: np.ndarray   # float64 (regions, labels)
    means: np.ndarray        # float64 (regions,), of the deviations
    valid: np.ndarray        # bool (regions, labels), visible often enough
    spreads: np.ndarray      # float64 (regions, BANDS), deviations of each band
    best: np.ndarray         # int64 (regions,)
    shares: np.ndarray       # float64 (regions, 2), of halves that elect it, and of splits both of
    #                          whose halves do


def elect(votes, places, labels, nearest):
    """
    Return the `Election` of some regions.

    votes: the fields of Votes; places: of number_cells; nearest: label from which on there is
    evidence
    """
    regions = len(places)
    totals = np.zeros((regions, GROUPS, BANDS, labels), np.int32)
    squares, seen = np.zeros(totals.shape[:3], np.int64), np.zeros((regions, labels), np.int32)
    kernels.sum_groups(votes, places, totals, seen, squares)
    valid = seen > VISIBLE * seen.max(1, keepdims=True)
    valid &= valid.sum(1, keepdims=True) >= LEAST_LABELS
    spreads = np.sqrt(squares.sum(1) / np.maximum(seen.sum(1, keepdims=True), 1)) + 1e-6
    scales = 1 / np.sqrt(np.maximum(seen, 1))
    groups = np.einsum('rgbl,rb,rl->rgl', totals, 1 / spreads, scales)
    deviations, allowed = groups.sum(1), valid & (np.arange(labels) >= nearest)
    best, shares = np.where(allowed, deviations, -np.inf).argmax(1), np.zeros((regions, 2))
    kernels.elect_by_halves(groups, squares.any(2), allowed, best, AGREE, shares)
    means = (deviations * valid).sum(1) / np.maximum(valid.sum(1), 1)
    return Election(deviations, means, valid, spreads, best, shares)


def judge(votes, found, labels, nearest):
    """
    Write the planes that regions take, the cells that take them, and how sure map and plane are.

    found: the `Found` regions; votes, labels, nearest: see `elect`
    """
    election, starts, cells = elect(votes, found.places, labels, nearest), found.starts, votes[2]
    pixels, inconsistent = np.array([cells[slice(*ends)][:, [0, 4]].sum(0)
                                     for ends in zip(starts[:-1], starts[1:])]).T
    consistent = 1 - inconsistent / pixels
    right = np.maximum(2 * consistent - 1, 0)   # share of the map
    found.certainty[:, 0] = SURE * right / np.maximum(consistent, 0.5)  # of consistent pixels
    found.certainty[:, 1] = SURE * np.maximum(election.shares[:, 1] - CHANCE, 0) / (1 - CHANCE)
    for region in np.flatnonzero(election.shares[:, 0] > right):
        place = slice(*starts[region:region + 2])
        lead = np.zeros(len(cells[place]))
        ahead, decisive = kernels.compare(
            votes, (found.places[region], place.start, place.stop), election.spreads[region],
            election.deviations[region], election.valid[region],
            (nearest, election.best[region], election.means[region], consistent[region]),
            found.planes[region], lead)
        if ahead > LEAD and decisive < DECISIVE:
            found.accepted[place] = lead > max(decisive - DECISIVE, LENIENT)
