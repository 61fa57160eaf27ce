# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The calibration of a pair, from two CameraInfo messages, and what it makes of disparities: metres.

The messages are of ROS 1 or ROS 2, live or from a bag.
"""
from dataclasses import dataclass
import math

import cv2
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, Projection
import numpy as np

VERTICAL_SHARE = 1e-3   # Ty beyond this share of Tx is a vertical rig
FOCAL_SHARE = 1e-3      # focal lengths of a rectified pair differ by less
ROW_DIFFERENCE = 0.5    # px; cy of a rectified pair differ by less
# What outputs of 32 bits can be made of: sixteenths of pixels, and a number below each disparity.
FARTHEST_CENTRE = 1e6   # px, cx and cy from 0, and from each other
LARGEST_MILLIMETRES = 65535     # of 16 bits
LENGTHS = 1e-9, 1e9     # px of focal lengths, metres of the baseline


@dataclass(frozen=True)
class _Camera:
    """One camera's P, of the image as it is: after region of interest and binning, in px."""

    fx: float
    fy: float
    cx: float
    cy: float
    tx: float
    ty: float
    binning: tuple
    first_row: int
    has_k: bool


def read_calibration(left_info, right_info):
    """
    Return the Calibration of a pair.

    left_info, right_info: anything with the fields of sensor_msgs/CameraInfo; P is of the full
    rectified image, region of interest and binning are taken into account.
    Where only K or the baseline is missing, the baseline is 0 and a remark says so: rectified
    images match without them, as with stereo_image_proc.
    Raises BadPair for a P without focal length, for cameras that are swapped, one above the other
    or that do not look at the same rows.
    """
    left, right = _camera('left', left_info), _camera('right', right_info)
    if left.binning != right.binning:
        times = ['{}x{}'.format(*camera.binning) for camera in (left, right)]
        raise BadPair('calibration', f"the cameras bin {' and '.join(times)} pixels; a pair "
                      'needs equal binning')
    if left.first_row != right.first_row:
        raise BadPair('calibration', f'the regions of interest begin in rows {left.first_row} '
                      f'and {right.first_row}; a pair needs the same rows of both cameras')
    across, down = left.tx - right.tx, left.ty - right.ty
    if abs(down) > VERTICAL_SHARE * abs(across):
        raise BadPair('calibration', f'Ty of the pair is {-down:g}: the cameras are mounted one '
                      'above the other; only side by side can be matched, turn the images')
    baseline = across / right.fx
    if baseline < 0:
        raise BadPair('calibration', f'the baseline is {baseline:g} m: left and right are '
                      'swapped, or Tx stands in the wrong camera_info; swap the topics, or '
                      'write P[3] = -fx * baseline into the right one')
    calibration = Calibration(
        focal=right.fx, baseline=baseline if left.has_k and right.has_k else 0.0,
        offset=left.cx - right.cx,
        left=Projection(left.fx, left.fy, left.cx, left.cy),
        remarks=tuple(_remarks(left, right, baseline)))
    _check_range(calibration)
    return calibration


def _check_range(calibration):
    """Raise BadPair for numbers that no camera has, and no message of ours can hold."""
    focal, baseline, offset, (fx, fy, cx, cy) = (
        calibration.focal, calibration.baseline, calibration.offset, calibration.left)
    for name, value, low, high in (
            ('fx of the right camera', focal, *LENGTHS), ('fx', fx, *LENGTHS),
            ('fy', fy, *LENGTHS), ('baseline', baseline or LENGTHS[0], *LENGTHS),
            ('cx', cx, -FARTHEST_CENTRE, FARTHEST_CENTRE),
            ('cy', cy, -FARTHEST_CENTRE, FARTHEST_CENTRE),
            ('cx_left - cx_right', offset, -FARTHEST_CENTRE, FARTHEST_CENTRE)):
        if not low <= value <= high:
            raise BadPair('calibration', f'{name} is {value:g} by the two camera_info; allowed '
                          f'are {low:g} to {high:g}: calibrate the two cameras as a pair')


def expected_size(info):
    """Return (rows, columns) an image must have to fit its CameraInfo; None where it is silent."""
    region, (across, down) = info.roi, times_binned(info)
    rows = (int(region.height) or int(info.height)) // down
    columns = (int(region.width) or int(info.width)) // across
    return (rows, columns) if rows and columns else None


def numbers_of(info, name):
    """Return d, k, r or p of a CameraInfo as floats; in ROS 1 the names are upper case."""
    values = getattr(info, name) if hasattr(info, name) else getattr(info, name.upper())
    return [float(value) for value in values]


def content_of(info):
    """Return what a CameraInfo says of its camera, without the header, to be compared."""
    region = info.roi
    return (*(np.array(numbers_of(info, name)).tobytes() for name in 'dkrp'),
            info.distortion_model, info.height, info.width, info.binning_x, info.binning_y,
            region.x_offset, region.y_offset, region.height, region.width)


def times_binned(info):
    """Return by how many pixels across and down a camera bins, 1 where it does not."""
    return max(int(info.binning_x), 1), max(int(info.binning_y), 1)


def _camera(side, info):
    projection, intrinsic = numbers_of(info, 'p'), numbers_of(info, 'k')
    if len(projection) != 12 or not all(math.isfinite(value) for value in projection):
        raise BadPair('calibration', f'{side} camera_info: P is not twelve finite numbers; '
                      'calibrate the camera')
    if min(projection[0], projection[5]) < LENGTHS[0]:      # smaller ones are 0 when binned
        raise BadPair('calibration', f'{side} camera_info: the camera is not calibrated (P[0] is '
                      f'{projection[0]:g}, P[5] is {projection[5]:g}); calibrate it, or load its '
                      'calibration into the driver')
    region, (across, down) = info.roi, times_binned(info)
    return _Camera(
        fx=projection[0] / across, fy=projection[5] / down,
        cx=(projection[2] - int(region.x_offset)) / across,
        cy=(projection[6] - int(region.y_offset)) / down,
        tx=projection[3] / across, ty=projection[7] / down,
        binning=(across, down), first_row=int(region.y_offset),
        has_k=bool(intrinsic) and intrinsic[0] > 0)


def _remarks(left, right, baseline):
    """Yield sentences about what is usable but hardly right, or has no metres."""
    if abs(left.fx - right.fx) > FOCAL_SHARE * right.fx:
        yield (f'fx is {left.fx:g} in the left and {right.fx:g} in the right camera_info; the '
               'two of a rectified pair are equal, the right one is used')
    if abs(left.cy - right.cy) > ROW_DIFFERENCE:
        yield (f'cy is {left.cy:g} in the left and {right.cy:g} in the right camera_info; rows '
               'of a rectified pair lie at the same height, calibrate the two as a pair')
    missing = [f'K of the {side} camera_info is not that of a calibrated camera'
               for side, camera in (('right', right), ('left', left)) if not camera.has_k]
    if not baseline:
        missing.append('the baseline is 0 m, as P[3] of the right camera_info is not -fx * '
                       'baseline')
    if missing:
        yield (f'{missing[0]}: disparities are without metres (t is 0), depth and points are '
               'left out; calibrate the two cameras as a pair, or load their calibration into '
               'the drivers')


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
