# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Does confidence tell what is wrong? Sparsification, and how often what it says is right."""
from typing import NamedTuple

import numpy as np

BINS = 0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1     # of confidence


class Sparsification(NamedTuple):
    """
    What is left wrong when the least sure pixels are dropped first.

    area: percent, the mean of the share of wrong pixels among those kept, over all shares kept.
    at_80: percent wrong among the 80 percent most sure. at_100: percent wrong of all.
    """

    area: float
    at_80: float
    at_100: float


def sparsification(wrong, sureness):
    """
    Return the `Sparsification` of pixels; pixels that are equally sure count as mixed.

    wrong: bool (N,). sureness: float (N,), higher is surer; NaN is the least sure.
    """
    if not wrong.size:
        return Sparsification(*(float('nan'),) * 3)
    ranks = np.where(np.isnan(sureness), -np.inf, sureness)
    levels, level_of = np.unique(-ranks, return_inverse=True)
    kept = np.cumsum(np.bincount(level_of, minlength=levels.size))
    found = np.cumsum(np.bincount(level_of, weights=wrong, minlength=levels.size))
    share = np.arange(1, wrong.size + 1)
    curve = 100 * np.interp(share, np.r_[0, kept], np.r_[0, found]) / share
    return Sparsification(float(curve.mean()), float(curve[int(0.8 * wrong.size) - 1]),
                          float(curve[-1]))


def left_right_sureness(left_map, right_map):
    """
    Return minus the difference of two maps where they meet: float (R, C), NaN where they do not.

    left_map: float (R, C), pixels, of the left image. right_map: of the right image.
    """
    rows, columns = np.indices(left_map.shape)
    place = columns - left_map
    inside = np.isfinite(place) & (place >= -0.5) & (place < left_map.shape[1] - 0.5)
    met = np.full(left_map.shape, np.nan)
    met[inside] = right_map[rows[inside], np.rint(place[inside]).astype(np.intp)]
    return -abs(left_map - met)


def reliability(wrong, confidence):
    """
    Return how many pixels a confidence has in each of its BINS, and how many of these are right.

    wrong: bool (N,); confidence: float (N,), 0 to 1; returns int64 (2, bins). Pixels of confidence
    0 are invalid, and in no bin.
    """
    valid = confidence > 0
    place = np.digitize(confidence[valid], BINS[1:-1])
    return np.array([np.bincount(place[chosen], minlength=len(BINS) - 1)
                     for chosen in (slice(None), ~wrong[valid])])
