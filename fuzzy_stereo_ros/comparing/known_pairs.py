# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs whose disparities are known, as they are read and as they are scored."""
from dataclasses import dataclass

from fuzzy_stereo_ros.evaluation import score
from fuzzy_stereo_ros.pairs.image_files import read_image
import numpy as np

MIDDLEBURY, KITTI = 'Middlebury', 'KITTI'
LIMITS = {MIDDLEBURY: 1.0, KITTI: 3.0}
WHOLE_PIXEL_TRUTH = {'tsukuba'}


@dataclass(frozen=True)
class KnownPair:
    """
    A pair whose disparities are known.

    left, right: uint8 (R, C) or (R, C, 3) BGR.
    truth: float32 (R, C), pixels, NaN = unknown, or None where nothing is known.
    counts: bool (R, C), the pixels that are scored; None = all with a truth.
    whole_pixel: the truth has whole pixels only, so that a disparity is rounded before scoring.
    """

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray | None
    counts: np.ndarray | None = None
    whole_pixel: bool = False


def bad_percent(disparity, known, limit):
    """
    Return the percent of the pixels that count which are off by more than limit, or invalid.

    disparity: float (R, C), pixels, NaN = invalid; rounded first where the truth is whole.
    """
    found = np.rint(disparity) if known.whole_pixel else disparity
    return score(found, known.truth, known.counts, (limit,)).bad_dense[limit]


def read_truth(path, scale):
    """Return the disparities of a picture, grey or grey in three channels: float32, NaN."""
    levels = read_image(path)
    levels = levels if levels.ndim == 2 else levels[:, :, 0]
    return np.where(levels > 0, levels / np.float32(scale), np.nan).astype(np.float32)
