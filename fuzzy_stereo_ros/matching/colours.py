# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Disparities as people look at them: in colours."""
import cv2
import numpy as np

INVALID_GREY = 32       # of invalid pixels in pictures


def colour_disparity(disparity, low, high):
    """
    Return disparities in the colour map Turbo, far blue and near red: uint8 (R, C, 3) BGR.

    disparity: float (R, C), pixels, NaN or infinite = invalid, shown in dark grey.
    low, high: pixels, the disparities at the two ends of the colour map; others are clipped.
    """
    span = max(high - low, 1e-6)
    levels = cv2.convertScaleAbs(np.clip(disparity - low, 0, span), alpha=255 / span)
    picture = cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)
    invalid = ~np.isfinite(disparity)
    return cv2.copyTo(np.full_like(picture, INVALID_GREY), invalid.view(np.uint8), picture)
