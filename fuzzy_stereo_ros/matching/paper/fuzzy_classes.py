# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fuzzy classes of pixels: grey classes of the paper, gradient classes beside them."""
import numpy as np

GREY_CENTRES = (0.0, 127.5, 255.0)      # black, average and white
# Falling strongly, falling, flat, rising, rising strongly; in logarithms of grey levels a pixel.
GRADIENT_CENTRES = (-4.0, -2.0, 0.0, 2.0, 4.0)
# Neighbouring classes cross at one half.
GRADIENT_SIGMA = 1.0 / np.sqrt(2.0 * np.log(2.0))


def membership(level, centre, sigma):
    """
    Return how much pixels belong to a fuzzy class, 0 to 1: Eq. 1.

    level: any shape; centre, sigma: in the unit of the level
    """
    return np.exp(-(np.asarray(level, np.float64) - centre)**2 / (2.0 * sigma**2))


def memberships(level, centres, sigma):
    """Return the memberships in several classes, the last axis: Eq. 1 of each."""
    return np.stack([membership(level, centre, sigma) for centre in centres], axis=-1)


def matching_possibility(first, second, sigma, centres=GREY_CENTRES):
    """
    Return how possible it is that pixels of two levels match, 0 to 1: Eq. 2.

    It is the best of the classes at having both pixels: fuzzy AND is the minimum, fuzzy OR the
    maximum.

    first, second: shapes that broadcast, grey levels of 8 bits
    """
    return np.minimum(memberships(first, centres, sigma),
                      memberships(second, centres, sigma)).max(axis=-1)


def shared_membership(first, second, sigma, centres):
    """
    Return the share of their memberships that pixels of two levels have in common, 0 to 1.

    Not in the paper, whose Eq. 2 is at most one half for two equal pixels between two classes:
    the sum over the classes of the smaller memberships over that of the larger ones is 1 there.

    first, second: shapes that broadcast, in the unit of sigma and centres
    """
    first, second = memberships(first, centres, sigma), memberships(second, centres, sigma)
    return np.minimum(first, second).sum(axis=-1) / np.maximum(first, second).sum(axis=-1)


def compressed(gradient):
    """
    Return gradients on the scale of the gradient classes: the logarithm of 1 + their size, signed.

    A faint gradient of a plain surface is told from none, a strong one is not told from a
    stronger one. Not in the paper.

    gradient: float, grey levels of 8 bits a pixel
    """
    return np.copysign(np.log1p(np.abs(gradient)), gradient)
