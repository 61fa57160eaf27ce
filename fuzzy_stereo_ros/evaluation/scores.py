# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scores of disparity maps: errors against ground truth, flicker between frames."""
from dataclasses import dataclass
import math

import numpy as np

THRESHOLDS = (0.5, 1.0, 2.0, 3.0, 4.0)
ERROR_LIMIT = 4.0       # px, from which on pictures of errors show all alike


@dataclass(frozen=True)
class Score:
    """Figures of a map over the pixels with ground truth inside the mask; NaN of no pixels."""

    pixels: int
    density: float          # percentage with a disparity
    bad_sparse: dict        # {threshold, px: percentage of those that are off by more}
    bad_dense: dict         # the same of all, where a pixel without a disparity is bad
    d1_sparse: float        # percentage of those off by more than 3 px and 5 % (KITTI)
    d1_dense: float
    average_error: float    # px, of those with a disparity
    rms_error: float


def score(disparity, truth, mask=None, thresholds=THRESHOLDS):
    """
    Return the `Score` of a disparity map.

    disparity, truth: float (R, C), pixels, NaN or infinite = invalid, of the same camera.
    mask: (R, C), not 0 = counts; None = all. Give masks with a middle value (Middlebury's
        `disc`) as `mask == 255`.
    thresholds: pixels.
    Raises ValueError if the shapes differ.
    """
    for name, array in (('truth', truth), ('mask', mask)):
        if array is not None and array.shape != disparity.shape:
            raise ValueError(f'{name} has the shape {array.shape}, the disparity '
                             f'{disparity.shape}; they must be equal')
    counts = np.isfinite(truth) if mask is None else np.isfinite(truth) & (mask != 0)
    wanted = truth[counts].astype(np.float64)
    error = _apart(disparity[counts], wanted)
    valid = np.isfinite(error)
    found = error[valid]
    far_off = ~((error <= 3) | (error <= 0.05 * abs(wanted)))
    return Score(
        pixels=int(error.size),
        density=_percent(valid),
        bad_sparse={limit: _percent(found > limit) for limit in thresholds},
        bad_dense={limit: _percent(~(error <= limit)) for limit in thresholds},
        d1_sparse=_percent(far_off[valid]),
        d1_dense=_percent(far_off),
        average_error=float(found.mean()) if found.size else float('nan'),
        rms_error=float(np.sqrt((found**2).mean())) if found.size else float('nan'))


def error_map(disparity, truth):
    """Return |disparity - truth|: float32 (R, C), pixels, NaN where one of them is invalid."""
    error = _apart(disparity, truth)
    return np.where(np.isfinite(error), error, np.nan).astype(np.float32)


def flicker(before, after, shift=(0, 0)):
    """
    Return the percentage of pixels that change by more than a pixel between two frames.

    Only pixels with a disparity in both frames count.
    before, after: float (R, C), pixels, NaN or infinite = invalid.
    shift: whole rows and columns by which the scene moved from before to after; a window that
        pans to the right by 2 has (0, -2).
    Raises ValueError if the shapes differ, or the shift leaves no pixels.
    """
    if before.shape != after.shape:
        raise ValueError('the two disparity maps must have one shape')
    if any(abs(step) >= size for step, size in zip(shift, after.shape)):
        raise ValueError(f'shift is {shift}; nothing is left of {after.shape} pixels')
    new, old = (tuple(slice(max(sign * step, 0), size + min(sign * step, 0))
                      for step, size in zip(shift, after.shape)) for sign in (1, -1))
    change = _apart(after[new], before[old])
    return _percent(change[np.isfinite(change)] > 1)


def mean(values):
    """Return the mean of the values that are neither None nor NaN: float, NaN of none."""
    known = [value for value in values if value is not None and not math.isnan(value)]
    return float(np.mean(known)) if known else math.nan


def _apart(one, other):
    """Return |one - other|, float64, not finite where one of them is invalid."""
    with np.errstate(invalid='ignore'):     # infinity minus infinity is invalid, too
        return abs(np.subtract(one, other, dtype=np.float64))


def _percent(which):
    """Return the percentage of true values in a bool array; NaN of an empty one."""
    return 100.0 * float(np.count_nonzero(which)) / which.size if which.size else float('nan')
