# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Disparity and confidence as the user gets them."""
from numba import njit
import numpy as np

from fuzzy_stereo_ros.matching.kernels.choice import STEPS
from fuzzy_stereo_ros.matching.kernels.consistency import CONSISTENT

CLEAR_MARGIN = 24    # summed cost by which the best label elsewhere is worse: half sure


@njit(nogil=True, cache=True)
def write_out(fine, verdict, sums, margins, min_disparity, disparities, fill, threshold,
              disparity, confidence, first, last):
    """
    Write disparities in pixels and how sure each is.

    fine: int16 or int32 (R, C), 1 / STEPS px; sums, margins: uint8 (R, C), the summed cost of the
    label and how much worse the best label elsewhere is; threshold: float32, less sure is NaN;
    disparity, confidence: float32 (R, C). What is not consistent has confidence 0.
    """
    highest = np.float32(min_disparity + disparities - 1)
    for row in range(first, last):
        for column in range(fine.shape[1]):
            margin = np.float32(margins[row, column])
            sure = margin / (margin + np.float32(CLEAR_MARGIN)) * (
                np.float32(1) - np.float32(sums[row, column]) / np.float32(256))
            if verdict[row, column] != CONSISTENT:
                sure = np.float32(0)
            confidence[row, column] = sure
            known = fill or (verdict[row, column] == CONSISTENT and sure >= threshold)
            value = np.float32(fine[row, column]) / np.float32(STEPS) + np.float32(min_disparity)
            disparity[row, column] = min(max(value, np.float32(min_disparity)), highest) \
                if known else np.float32(np.nan)
