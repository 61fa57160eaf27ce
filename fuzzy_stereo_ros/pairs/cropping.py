# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The rectangle of an image in which no pixel is missing."""
import numpy as np


def whole_window(there):
    """
    Return the slices of rows and of columns of a large rectangle in which every pixel is there.

    there: bool (R, C). While one is missing inside, the side that misses the largest share of
    its pixels is dropped: not always the largest rectangle, but near it where what is missing
    lies along the borders. Both slices are empty where nothing is left.
    """
    top, left, (bottom, right) = 0, 0, there.shape
    absent = ~there
    missing = np.count_nonzero(absent)
    while missing:
        rows, columns = slice(top, bottom), slice(left, right)
        gone = [np.count_nonzero(side) for side in (
            absent[top, columns], absent[bottom - 1, columns],
            absent[rows, left], absent[rows, right - 1])]
        width, height = right - left, bottom - top
        worst = int(np.argmax([gone[0] / width, gone[1] / width,
                               gone[2] / height, gone[3] / height]))
        missing -= gone[worst]
        top, bottom = top + (worst == 0), bottom - (worst == 1)
        left, right = left + (worst == 2), right - (worst == 3)
    if top == bottom or left == right:
        return slice(0, 0), slice(0, 0)
    return slice(top, bottom), slice(left, right)
