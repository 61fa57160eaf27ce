# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What makes a match possible by the grey classes of the paper.

The volume itself, Eq. 2 at each (r, c, d), is written by `kernels.grey_possibility`.
"""
import cv2
from fuzzy_stereo_ros.matching.fuzzy import matching_possibility
import numpy as np

FULL = 255.0  # a possibility of 1 in the whole numbers of the kernels


def possibility_table(sigma):
    """
    Return Eq. 2 of every pair of grey levels.

    table: uint8 (256, 256), 255ths
    """
    levels = np.arange(256)
    exact = matching_possibility(levels[:, np.newaxis], levels[np.newaxis, :], sigma)
    return np.rint(FULL * exact).astype(np.uint8)


def grey_levels(left, right):
    """
    Return both images as grey levels of 8 bits, on which Eq. 1 is defined.

    Images of 16 bits lose their lowest bits, the same number in both, until the brighter one
    fits: cameras of 10 and 12 bits fill only a part of the 16.

    left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR
    greys: two arrays, uint8 (R, C)
    """
    greys = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
             for image in (left, right)]
    brightest = max(int(grey.max()) for grey in greys)
    lost = max(brightest.bit_length() - 8, 0)
    return [np.ascontiguousarray((grey >> lost).astype(np.uint8)) for grey in greys]
