# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Choose one of several numbers by its rank; numba needs seconds to compile NumPy's functions."""
from fuzzy_stereo_ros.matching.kernels.compiled import called
import numpy as np


@called
def of_rank(values, number, rank):
    """Return the one of the first values that has so many before it; their order changes."""
    low, high = 0, number - 1
    while low < high:       # quickselect
        pivot, left, right = values[rank], low, high
        while left <= right:
            while values[left] < pivot:
                left += 1
            while values[right] > pivot:
                right -= 1
            if left <= right:
                values[left], values[right] = values[right], values[left]
                left, right = left + 1, right - 1
        if right < rank:
            low = left
        if rank < left:
            high = right
    return values[rank]


@called
def median(values, number):
    """Return the middle one of the first values, of two the lower one; their order changes."""
    return of_rank(values, number, max(np.int64(number) - 1, 0) // 2)
