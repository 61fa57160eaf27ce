# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Images as a camera sees them that has moved since it was calibrated."""
import cv2
import numpy as np


def misaligned(image, tilt=0.0, roll=0.0, zoom=0.0):
    """
    Return an image, uint8 or uint16 (R, C, ...), of a camera that has moved.

    tilt: px by which all comes to stand lower. roll: degrees by which it is turned clockwise
    about its middle. zoom: percent by which it is larger.
    """
    rows, columns = image.shape[:2]
    middle = np.array([(columns - 1) / 2, (rows - 1) / 2])
    angle = np.deg2rad(roll)
    turn = (1 + zoom / 100) * np.array([[np.cos(angle), -np.sin(angle)],
                                        [np.sin(angle), np.cos(angle)]])
    moved = np.column_stack([turn, middle + (0, tilt) - turn @ middle])
    return cv2.warpAffine(image, moved, (columns, rows), flags=cv2.INTER_CUBIC,
                          borderMode=cv2.BORDER_REFLECT_101)
