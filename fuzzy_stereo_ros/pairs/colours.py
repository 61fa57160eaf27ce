# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Images and disparities in colours of 8 bits, to look at."""
import cv2
import numpy as np

INVALID_GREY = 32


def in_eight_bits(image):
    """
    Return an image as uint8 of the same shape; one that is uint8 as it is.

    image: uint8 or uint16, (R, C) or (R, C, 3). 16 bits are divided by the largest value of all
    channels: cameras of 10 and 12 bits fill only a part of the 16.
    """
    if image.dtype == np.uint8:
        return image
    return cv2.convertScaleAbs(image, alpha=255.0 / max(int(image.max()), 1))


def colour_disparity(disparity, low, high):
    """
    Return disparities in the colours of Turbo, far blue and near red: uint8 (R, C, 3) BGR.

    disparity: float (R, C), pixels, NaN or infinite = invalid, which is dark grey.
    low, high: pixels, shown as the ends of the colours; what lies outside takes the end.
    """
    span = max(high - low, 1e-6)
    levels = cv2.convertScaleAbs(np.clip(disparity - low, 0, span), alpha=255 / span)
    picture = cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)
    invalid = ~np.isfinite(disparity)
    return cv2.copyTo(np.full_like(picture, INVALID_GREY), invalid.view(np.uint8), picture)
