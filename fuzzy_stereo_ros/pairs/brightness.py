# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Images of 16 bits as eyes and colour fields can take them."""
import cv2
import numpy as np


def in_eight_bits(image):
    """
    Return an image as uint8 of the same shape; one that is uint8 as it is.

    image: uint8 or uint16, (R, C) or (R, C, 3). 16 bits are divided by the largest value of all
    channels: cameras of 10 and 12 bits fill only a part of the 16.
    """
    if image.dtype == np.uint8:
        return image
    return cv2.convertScaleAbs(image, alpha=255.0 / max(int(image.max()), 1))
