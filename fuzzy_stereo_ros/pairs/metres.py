# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From disparities in pixels to metres: depth, and points in space."""
import cv2
import numpy as np

LARGEST_MILLIMETRES = 65535     # of 16 bits


def depth_of(disparity, calibration):
    """
    Return the distance along the optical axis, as REP 118 wants it: float32 (R, C), metres.

    disparity: float32 (R, C), px, NaN = invalid, which stays NaN. A valid pixel whose disparity
    is not above the calibration's offset is too far: infinite. Without a baseline all is NaN.
    """
    if not calibration.baseline:
        return np.full_like(disparity, np.nan)
    depth = disparity - np.float32(calibration.offset)
    with np.errstate(divide='ignore', over='ignore'):
        np.divide(np.float32(calibration.focal * calibration.baseline), depth, out=depth)
    np.copyto(depth, np.inf, where=depth < 0)       # -inf as well: the inverse of -0.0
    return depth


def disparity_of(depth, calibration):
    """
    Return the disparities that a depth comes from: float32 (R, C), px, NaN = invalid.

    depth: float32 (R, C), metres; NaN and what is not above 0 is invalid. What is infinitely far
    has the calibration's offset.
    """
    with np.errstate(divide='ignore', invalid='ignore'):
        disparity = calibration.focal * calibration.baseline / depth.astype(np.float64)
        disparity = np.where(depth > 0, disparity + calibration.offset, np.nan)
    return disparity.astype(np.float32)


def millimetres_of(depth):
    """
    Return depth in whole millimetres, uint16 (R, C), 0 = invalid, infinite or beyond 65.535 m.

    depth: float32 (R, C), metres, NaN = invalid. 16 bits have no number for too far, and
    depth_image_proc takes every value but 0 for a distance: the largest would be a wall.
    """
    near = cv2.threshold(depth, LARGEST_MILLIMETRES / 1000, 0, cv2.THRESH_TOZERO_INV)[1]
    cv2.patchNaNs(near, 0.0)    # what NaN rounds to is the processor's choice
    # No multiply by a number: OpenCV 4 takes a number beside 4 x 1 values for four of them.
    return cv2.addWeighted(near, 1000.0, near, 0.0, 0.0, dtype=cv2.CV_16U)


def write_points(depth, left, points):
    """
    Write where pixels lie in the left optical frame: x right, y down, z forward, metres.

    depth: float32 (R, C), metres; where it is NaN or infinite the point is NaN.
    left: Projection of the left camera; points: float32 (R, C, 3 or more), the first three of
    each pixel are written.
    """
    rows, columns = depth.shape
    x, y, z = (points[:, :, place] for place in range(3))
    np.copyto(z, depth)
    np.copyto(z, np.nan, where=np.isinf(depth))
    across = (np.arange(columns) - left.cx) / left.fx
    down = (np.arange(rows) - left.cy) / left.fy
    with np.errstate(over='ignore'):    # too far beside the axis is infinite too
        np.multiply(z, across.astype(np.float32), out=x)
        np.multiply(z, down.astype(np.float32)[:, np.newaxis], out=y)
