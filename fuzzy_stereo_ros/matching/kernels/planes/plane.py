# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A plane (a, b, c): its disparity at (x, y) is a x + b y + c.

Maps of planes are float32 (r, 3, c): a row has all its a, then all its b, then all its c, so that
loops over cells work with vectors.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
import numpy as np


@inlined
def plane_at(planes, row, column):
    """Return the plane of a cell of a map."""
    return planes[row, 0, column], planes[row, 1, column], planes[row, 2, column]


@inlined
def disparity_at(plane, x, y):
    """Return the disparity of a plane at a place."""
    return plane[0] * np.float32(x) + plane[1] * np.float32(y) + plane[2]


@called
def write_disparities(planes, row, lowest, highest, disparities):
    """Write the disparities of a row of a map of planes, within limits: float32 (c,)."""
    for column in range(disparities.size):
        disparity = disparity_at(plane_at(planes, row, column), column, row)
        disparities[column] = min(max(disparity, lowest), highest)


@kernel
def disparities_of(planes, highest, disparities, first, last):
    """Write the disparities of a map of planes, within 0 to highest: float32 (r, c), px."""
    for row in range(first, last):
        write_disparities(planes, row, np.float32(0), highest, disparities[row])
