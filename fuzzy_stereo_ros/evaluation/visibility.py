# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which pixels both cameras see, judged by the ground truth alone."""
import numpy as np

TOLERANCE = 1.0  # px between the truths of a pixel and of what it meets in the other image


def warped_to_right(truth):
    """
    Return a left-referenced truth carried over to the right image; the nearest surface wins.

    truth: float32 (R, C), pixels, NaN = unknown; so is the result, where no left pixel arrives.
    """
    rows, target, inside = _targets(truth)
    carried = np.full(truth.shape, -np.inf, np.float32)
    np.maximum.at(carried, (rows[inside], target[inside]), truth[inside])
    return np.where(np.isfinite(carried), carried, np.nan).astype(np.float32)


def seen_by_both(truth):
    """
    Return where the right image shows the same point: bool (R, C).

    A pixel counts where its truth is known, its match lies inside the right image, and no
    surface nearer by more than a pixel is carried over to the same place.
    """
    rows, target, inside = _targets(truth)
    nearest = warped_to_right(truth)
    seen = inside.copy()
    seen[inside] = truth[inside] >= nearest[rows[inside], target[inside]] - TOLERANCE
    return seen


def agreeing(truth, other):
    """
    Return where the truths of the two images agree within a pixel: bool (R, C), left image.

    truth: float32 (R, C), pixels, NaN = unknown; other: the same of the right image.
    """
    rows, target, inside = _targets(truth)
    agree = np.zeros(inside.shape, bool)
    agree[inside] = abs(truth[inside] - other[rows[inside], target[inside]]) <= TOLERANCE
    return agree


def cross_checked(truth_right, truth_left):
    """
    Return where the truths of the two images agree within a pixel: bool (R, C), right image.

    truth_right, truth_left: float32 (R, C), pixels, NaN = unknown.
    """
    # Seen in mirrors, the right image is a left one.
    return agreeing(truth_right[:, ::-1], truth_left[:, ::-1])[:, ::-1]


def _targets(truth):
    """Return row and matching right column of each pixel, and where that is inside."""
    rows, columns = np.indices(truth.shape)
    place = columns - truth
    inside = np.isfinite(place) & (place >= 0) & (place <= truth.shape[1] - 1)
    return rows, np.rint(np.where(inside, place, 0)).astype(np.intp), inside
