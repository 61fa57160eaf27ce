# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sub-pixel disparities: the mean offset of the like neighbours of a pixel."""
from fuzzy_stereo_ros.matching.kernels.choice import STEPS
from fuzzy_stereo_ros.matching.kernels.consistency import REFUSED
from numba import njit
import numpy as np

RADIUS = 2
REFUSED_FIT = -(2**14)     # farther than STEPS from any disparity


@njit(nogil=True, cache=True)
def fit(labels, offsets, verdict, fitted, first, last):
    """
    Write the fitted disparities of the pixels not refused, far out of reach for the others.

    labels: uint8 or uint16 (R, C); offsets: int8 (R, C); fitted: int16 or int32 (R, C + 4),
    1 / STEPS px, with a margin of RADIUS columns.
    """
    rows, columns = labels.shape
    for row in range(first, last):
        fitted[row, :RADIUS] = REFUSED_FIT
        fitted[row, columns + RADIUS:] = REFUSED_FIT
        inside = fitted[row, RADIUS:RADIUS + columns]
        for column in range(columns):
            value = STEPS * np.int32(labels[row, column]) + np.int32(offsets[row, column])
            inside[column] = value if verdict[row, column] != REFUSED else REFUSED_FIT


@njit(nogil=True, cache=True)
def smooth_offsets(final, fitted, total, count, fine, first, last):
    """
    Average over 5 x 5 pixels the fitted disparities that are within one pixel of the final label.

    final: uint8 or uint16 (R, C), labels after refinement; total, count: (C,) of the dtype of
    fitted, working memory; fine: (R, C) of that dtype, 1 / STEPS px.
    """
    rows, columns = final.shape
    one = total.dtype.type(STEPS)
    for row in range(first, last):
        centre = fine[row]
        for column in range(columns):
            centre[column] = STEPS * np.int32(final[row, column])
        total[:] = 0
        count[:] = 0
        for other in range(max(row - RADIUS, 0), min(row + RADIUS + 1, rows)):
            for shift in range(2 * RADIUS + 1):
                near = fitted[other, shift:shift + columns]
                for column in range(columns):
                    difference = near[column] - centre[column]
                    like = (difference <= one) & (difference >= -one)
                    total[column] += difference if like else 0
                    count[column] += 1 if like else 0
        for column in range(columns):
            if count[column] > 0:
                centre[column] += np.int32(np.floor(
                    np.float32(total[column]) / np.float32(count[column]) + np.float32(0.5)))
