# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs with ground truth: which pixels count, which both cameras see, how many are bad."""
from dataclasses import dataclass, field
from pathlib import Path

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image
import numpy as np

MIDDLEBURY, KITTI = 'Middlebury', 'KITTI'
LIMITS = {MIDDLEBURY: 1.0, KITTI: 3.0}      # px; an error above the limit of its family is bad
NUMBERS = ('.pfm', '.npy', '.npz')          # suffixes of files that hold pixels, not grey levels
MASKS = NONOCC, ALL, DISC = 'nonocc', 'all', 'disc'      # the one that counts most first
TOLERANCE = 1.0     # px between the truths of a pixel and of its match in the other image


@dataclass(frozen=True)
class GroundTruthPair:
    """
    A pair whose disparities are known.

    left, right: uint8 or uint16 (R, C) or (R, C, 3) BGR.
    truth: float32 (R, C), pixels, NaN = unknown; None = the frame has no truth.
    counts: bool (R, C), the pixels that are scored; None = all with a truth.
    whole_pixel: the truth has whole pixels only, so that a disparity is rounded before scoring.
    masks: {name of MASKS: bool (R, C)}, in the order of MASKS.
    """

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray | None
    counts: np.ndarray | None = None
    whole_pixel: bool = False
    masks: dict = field(default_factory=dict)

    def as_scored(self, disparity):
        """Return a disparity map as it is scored: rounded where the truth is whole."""
        return np.rint(disparity) if self.whole_pixel else disparity


def bad_percent(disparity, pair, limit):
    """
    Return the percent of the pixels that count which are off by more than limit, or invalid.

    disparity: float (R, C), pixels, NaN = invalid; rounded first where the truth is whole.
    """
    return score(pair.as_scored(disparity), pair.truth, pair.counts, (limit,)).bad_dense[limit]


def read_truth(path, scale=None):
    """
    Return the disparities of a file: float32 (R, C), pixels, NaN = unknown.

    scale: as of `read_disparity`, for a picture; files of other kinds do without.
    Raises ValueError where the file cannot be read, or has 8 bits and no scale.
    """
    return read_disparity(path, None if Path(path).suffix.lower() in NUMBERS else scale)


def read_motorcycle():
    """Return the Motorcycle pair of scikit-image (Middlebury 2014, a quarter of its size)."""
    from skimage.data import stereo_motorcycle  # takes a second: only where it is read

    left, right, truth = stereo_motorcycle()
    truth = np.where(np.isfinite(truth), truth, np.nan).astype(np.float32)
    return GroundTruthPair(*(np.ascontiguousarray(image[:, :, ::-1]) for image in (left, right)),
                           truth, seen_by_both(truth))


def read_mask(path):
    """Return which pixels of a picture are 255: bool (R, C)."""
    levels = read_image(path)
    return (levels if levels.ndim == 2 else levels[:, :, 0]) == 255


def warped_to_right(truth):
    """
    Return a left-referenced truth warped to the right image; the nearest surface wins.

    truth: float32 (R, C), pixels, NaN = unknown; so is the result, where no left pixel arrives.
    """
    rows, target, inside = _targets(truth)
    warped = np.full(truth.shape, -np.inf, np.float32)
    np.maximum.at(warped, (rows[inside], target[inside]), truth[inside])
    return np.where(np.isfinite(warped), warped, np.nan).astype(np.float32)


def seen_by_both(truth):
    """
    Return where the right image shows the same point: bool (R, C).

    A pixel counts where its truth is known, its match lies inside the right image, and no
    surface nearer by more than a pixel is warped to the same place.
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
    # Mirrored, the right image is a left one.
    return agreeing(truth_right[:, ::-1], truth_left[:, ::-1])[:, ::-1]


def _targets(truth):
    """Return row and matching right column of each pixel, and where that is inside."""
    rows, columns = np.indices(truth.shape)
    target = columns - truth
    inside = np.isfinite(target) & (target >= 0) & (target <= truth.shape[1] - 1)
    return rows, np.rint(np.where(inside, target, 0)).astype(np.intp), inside
