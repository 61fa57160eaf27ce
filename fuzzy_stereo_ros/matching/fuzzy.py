# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fuzzy grey classes of the paper: black, average and white pixels."""
import numpy as np

CENTRES = (0.0, 127.5, 255.0)


def membership(intensity, centre, sigma):
    """
    Return how much pixels belong to a grey class, 0 to 1: Eq. 1.

    intensity: any shape, grey levels of 8 bits; centre, sigma: grey levels of 8 bits
    """
    return np.exp(-(np.asarray(intensity, np.float64) - centre)**2 / (2.0 * sigma**2))


def matching_possibility(first, second, sigma):
    """
    Return how possible it is that pixels of two intensities match, 0 to 1: Eq. 2.

    It is the best of the three classes at having both pixels: fuzzy AND is the minimum,
    fuzzy OR the maximum.

    first, second: shapes that broadcast, grey levels of 8 bits
    """
    both = [np.minimum(membership(first, centre, sigma), membership(second, centre, sigma))
            for centre in CENTRES]
    return np.maximum.reduce(both)
