# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the way from chosen labels to disparities: validities, fills, medians, output."""
import math

import numpy as np
from reference import mirrored_around

CONSISTENT, OUTSIDE, INVALID, VOTED = 0, 1, 2, 6

# ---- validities ----


def validities(labels, target, inside):
    """Return whether the target, known modulo 256, chose what points back, within one pixel."""
    # inside: its first and last column that exist; any extra columns come before column 0.
    extra = target.shape[1] - labels.shape[1]
    validity = np.zeros(labels.shape, np.uint8)
    for row, column in np.ndindex(labels.shape):
        pointed = column - int(labels[row, column])
        if not inside[0] <= pointed <= inside[1]:
            validity[row, column] = OUTSIDE
        else:
            away = (int(labels[row, column]) - int(target[row, extra + pointed])) % 256
            validity[row, column] = CONSISTENT if away in (255, 0, 1) else INVALID
    return validity


def components(inside, joined):
    """Return the 4-connected components of a mask as lists of places: flood fill."""
    # joined(place, near): whether two neighbours inside belong together.
    rows, columns = inside.shape
    unseen, found = inside.copy(), []
    for start in np.ndindex(inside.shape):
        if not unseen[start]:
            continue
        component = [start]
        unseen[start] = False
        for row, column in component:           # grows while it is walked
            for near in ((row - 1, column), (row + 1, column), (row, column - 1),
                         (row, column + 1)):
                if (0 <= near[0] < rows and 0 <= near[1] < columns and unseen[near]
                        and joined((row, column), near)):
                    unseen[near] = False
                    component.append(near)
        found.append(component)
    return found


def without_speckles(labels, validity, step, smallest):
    """Return the validity with the components of fewer pixels rejected too."""
    validity = validity.copy()
    for component in components(validity != INVALID, lambda place, near: abs(
            int(labels[place]) - int(labels[near])) <= step):
        if len(component) < smallest:
            validity[tuple(np.transpose(component))] = INVALID
    return validity


# ---- fills ----


def filled_by_rows(labels, validity):
    """Return the labels, rejected ones from behind a hiding strip, else from the nearer end."""
    filled = labels.copy()
    for row in range(labels.shape[0]):
        known = np.flatnonzero(validity[row] != INVALID)
        if not known.size:
            filled[row] = filled[row - 1] if row else 0
            continue
        for column in np.flatnonzero(validity[row] == INVALID):
            left, right = known[known < column][-1:], known[known > column][:1]
            ends = [*left, *right]
            if len(ends) == 2:
                jump = int(labels[row, right[0]]) - int(labels[row, left[0]])
                hidden = jump > 0 and right[0] - left[0] - 1 <= 3 * jump + 2
                ends = left if hidden or 2 * column <= left[0] + right[0] else right
            filled[row, column] = labels[row, ends[0]]
    return filled


# ---- medians ----


def membership_median(labels, grey, reach):
    """Return the (upper) median of the neighbours in 7 x 7 of like grey, only at jumps."""
    around, grey_around = np.pad(labels, 3, 'edge'), np.pad(grey.astype(np.int64), 3, 'edge')
    median = labels.copy()
    for row, column in np.ndindex(labels.shape):
        window = np.s_[row:row + 7, column:column + 7]
        if int(around[window].max()) - int(around[window].min()) > 1:
            alike = abs(grey_around[window] - int(grey[row, column])) <= reach
            members = sorted(around[window][alike].tolist())
            median[row, column] = members[len(members) // 2]
    return median


def median_of_25(labels):
    """Return the median of 5 x 5 pixels, borders repeated."""
    around = np.pad(labels, 2, 'edge')
    median = labels.copy()
    for row, column in np.ndindex(labels.shape):
        median[row, column] = sorted(around[row:row + 5, column:column + 5].ravel())[12]
    return median


# ---- what the user gets ----


def fine_disparities(final, labels, offsets, validity):
    """
    Return 16ths of a pixel, and how many pixels they are the mean of: int64 (R, C).

    The final label, moved by the mean of what the pixels of 5 x 5 found, of those not rejected and
    within one pixel of it.
    """
    fine, agreeing = (np.zeros(final.shape, np.int64) for _ in range(2))
    rows, columns = final.shape
    for row, column in np.ndindex(final.shape):
        here, moves = 16 * int(final[row, column]), []
        for near_row in range(max(row - 2, 0), min(row + 3, rows)):
            for near in range(max(column - 2, 0), min(column + 3, columns)):
                found = 16 * int(labels[near_row, near]) + int(offsets[near_row, near])
                if validity[near_row, near] != INVALID and abs(found - here) <= 16:
                    moves.append(found - here)
        fine[row, column] = here + (
            math.floor(sum(moves) / len(moves) + 0.5) if moves else 0)
        agreeing[row, column] = len(moves)
    return fine, agreeing


def margins_of_half(half):
    """Return what the margin of the half-size search allows: (R, C), 255 where voted."""
    margins = np.zeros(half.prior.weights.shape, int)
    rows, columns = half.chosen.margins.shape
    for row, column in np.ndindex(margins.shape):
        place = min(row // 2, rows - 1), min(column // 2, columns - 1)
        voted = half.prior.weights[row, column] == VOTED
        margins[row, column] = 255 if voted else min(
            3 * max(int(half.chosen.margins[place]) - 14, 0), 255)
    return margins


def certainty(sums, margins, validity):
    """Return how sure labels are, 0 to 1: half at a margin of 24, less the more they cost."""
    certain = np.zeros(sums.shape)
    for place in np.ndindex(sums.shape):
        if validity[place] == CONSISTENT:
            margin = int(margins[place])
            certain[place] = margin / (margin + 24) * (1 - int(sums[place]) / 256)
    return certain


def confidence(certain, agreeing, validity, side=9):
    """
    Return the mean certainty of a square times the share of 25 pixels that agree: float (R, C).

    It is mirrored at the border; one pixel agrees at the least; 0 where not consistent.
    """
    around = mirrored_around(certain, side // 2)
    sure = np.zeros(certain.shape)
    for row, column in zip(*np.nonzero(validity == CONSISTENT)):
        share = max(int(agreeing[row, column]), 1) / 25
        sure[row, column] = share * around[row:row + side, column:column + side].mean()
    return sure


def disparities_of(fine, validity, sure, min_disparity, disparities, fill, threshold):
    """Return pixels inside the range searched, NaN where rejected, outside or not sure enough."""
    found = np.full(fine.shape, np.nan)
    for place in np.ndindex(fine.shape):
        if fill or (validity[place] == CONSISTENT and sure[place] >= threshold):
            found[place] = min(max(fine[place] / 16 + min_disparity, min_disparity),
                               min_disparity + disparities - 1)
    return found
