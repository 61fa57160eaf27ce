# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs whose disparities are known, as they are read and as they are scored."""
from dataclasses import dataclass, field
from pathlib import Path

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image
import numpy as np

MIDDLEBURY, KITTI = 'Middlebury', 'KITTI'
LIMITS = {MIDDLEBURY: 1.0, KITTI: 3.0}
WHOLE_PIXEL_TRUTH = {'tsukuba'}
NUMBERS = ('.pfm', '.npy', '.npz')     # suffixes of files that hold pixels, not grey levels


@dataclass(frozen=True)
class KnownPair:
    """
    A pair whose disparities are known.

    left, right: uint8 (R, C) or (R, C, 3) BGR.
    truth: float32 (R, C), pixels, NaN = unknown, or None where nothing is known.
    counts: bool (R, C), the pixels that are scored; None = all with a truth.
    whole_pixel: the truth has whole pixels only, so that a disparity is rounded before scoring.
    masks: {name: bool (R, C)}, all sets of pixels that may be scored, the main one first, where
    several are known.
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


def bad_percent(disparity, known, limit):
    """
    Return the percent of the pixels that count which are off by more than limit, or invalid.

    disparity: float (R, C), pixels, NaN = invalid; rounded first where the truth is whole.
    """
    return score(known.as_scored(disparity), known.truth, known.counts,
                 (limit,)).bad_dense[limit]


def read_truth(path, scale=None):
    """
    Return the disparities of a file: float32 (R, C), pixels, NaN = unknown.

    scale: as of `read_disparity`, for a picture; files of other kinds do without.
    Raises ValueError where the file cannot be read, or has 8 bits and no scale.
    """
    return read_disparity(path, None if Path(path).suffix.lower() in NUMBERS else scale)


def read_mask(path):
    """Return which pixels of a picture are 255: bool (R, C)."""
    levels = read_image(path)
    return (levels if levels.ndim == 2 else levels[:, :, 0]) == 255
