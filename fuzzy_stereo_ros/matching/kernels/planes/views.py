# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Left-right consistency of maps in parts of a pixel."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import CONSISTENT, OUTSIDE, REFUSED
import numpy as np


@kernel
def compare_views(disparities, others, lowest, most, verdict, first, last):
    """
    Compare each pixel with the pixel of the other view that it points at.

    disparities: float32 (R, C), px from `lowest`; others: likewise, of the mirrored other view;
    most: px by which they may differ; verdict: uint8 (R, C), see refinement/consistency.py
    """
    columns = disparities.shape[1]
    for row in range(first, last):
        for column in range(columns):
            mine = disparities[row, column]
            pointed = column - lowest - np.int64(np.rint(mine))
            if pointed < 0 or pointed >= columns:
                verdict[row, column] = OUTSIDE
            elif abs(others[row, columns - 1 - pointed] - mine) <= most:
                verdict[row, column] = CONSISTENT
            else:
                verdict[row, column] = REFUSED
