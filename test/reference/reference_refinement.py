# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the way from chosen labels to disparities: validities, fills, medians, output."""
import networkx
import numpy as np
from reference import windows
from reference_search import doubled

CONSISTENT, OUTSIDE, INVALID, VOTED = 0, 1, 2, 6

# ---- validities ----


def validities(labels, target, inside):
    """Return whether the target, known modulo 256, chose what points back, within one pixel."""
    # inside: its first and last column that exist; any extra columns come before column 0.
    extra, labels = target.shape[1] - labels.shape[1], labels.astype(int)
    pointed = np.arange(labels.shape[1]) - labels
    there = np.take_along_axis(target, np.clip(extra + pointed, 0, target.shape[1] - 1), axis=1)
    validity = np.where((labels - there + 1) % 256 <= 2, CONSISTENT, INVALID)
    return np.where((inside[0] <= pointed) & (pointed <= inside[1]), validity, OUTSIDE)


def components(inside, joined):
    """Return the 4-connected components of a mask as lists of places: networkx."""
    # joined(place, near): whether two neighbours inside belong together.
    graph = networkx.Graph()
    graph.add_nodes_from(zip(*map(np.ndarray.tolist, np.nonzero(inside))))
    graph.add_edges_from(pair for pair in networkx.grid_2d_graph(*inside.shape).edges if (
        inside[pair[0]] and inside[pair[1]] and joined(*pair)))
    return sorted(map(sorted, networkx.connected_components(graph)))


def without_speckles(labels, validity, step, smallest):
    """Return the validity with the components of fewer pixels rejected too."""
    validity = validity.copy()
    for component in components(validity != INVALID, lambda place, near: abs(
            int(labels[place]) - int(labels[near])) <= step):
        if len(component) < smallest:
            validity[tuple(np.transpose(component))] = INVALID
    return validity


# ---- fills and medians ----


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


def membership_median(labels, grey, reach):
    """Return the (upper) median of the neighbours in 7 x 7 of like grey, only at jumps."""
    around, grey = windows(labels.astype(int), 3), grey.astype(int)
    alike = abs(windows(grey, 3) - grey[..., np.newaxis]) <= reach
    members = np.sort(np.where(alike, around, 2**16), axis=2)
    median = np.take_along_axis(members, alike.sum(axis=2, keepdims=True) // 2, axis=2)[..., 0]
    return np.where(np.ptp(around, axis=2) > 1, median, labels)


def median_of_25(labels):
    """Return the median of 5 x 5 pixels, borders repeated."""
    return np.sort(windows(labels, 2), axis=2)[..., 12]


# ---- what the user gets ----


def fine_disparities(final, labels, offsets, validity):
    """
    Return 16ths of a pixel, and how many pixels they are the mean of: int64 (R, C).

    The final label, moved by the mean of what the pixels of 5 x 5 found, of those not rejected and
    within one pixel of it.
    """
    here = 16 * final.astype(int)
    moves = windows(16 * labels.astype(int) + offsets, 2) - here[..., np.newaxis]
    known = windows(validity, 2, constant_values=INVALID) != INVALID
    counted = known & (abs(moves) <= 16)
    agreeing = counted.sum(axis=2)
    mean = (moves * counted).sum(axis=2) / np.maximum(agreeing, 1)
    return here + np.floor(mean + 0.5).astype(int), agreeing


def margins_of_half(half):
    """Return what the margin of the half-size search allows: (R, C), 255 where voted."""
    margins = doubled(half.chosen.margins.astype(int), half.prior.weights.shape)
    return np.where(half.prior.weights == VOTED, 255, np.clip(3 * (margins - 14), 0, 255))


def certainty(sums, margins, validity):
    """Return how sure labels are, 0 to 1: half at a margin of 24, less the more they cost."""
    return np.where(validity == CONSISTENT, margins / (margins + 24) * (1 - sums / 256), 0)


def confidence(certain, agreeing, validity):
    """
    Return the mean certainty of a square times the share of 25 pixels that agree: float (R, C).

    It is mirrored at the border; one pixel agrees at the least; 0 where not consistent.
    """
    mean = windows(certain, 4, mode='reflect').mean(axis=2)
    return np.where(validity == CONSISTENT, np.maximum(agreeing, 1) / 25 * mean, 0)


def disparities_of(fine, validity, sure, min_disparity, disparities, fill, threshold):
    """Return pixels inside the range searched, NaN where rejected, outside or not sure enough."""
    found = np.clip(fine / 16, 0, disparities - 1) + min_disparity
    return np.where(fill | (validity == CONSISTENT) & (sure >= threshold), found, np.nan)
