# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the calibration of a pair from two CameraInfo, and compute depth and points with it.

The messages are of ROS 1 or ROS 2, live or from a bag.
"""
import math

import cv2
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, Projection, SIDES
import numpy as np

VERTICAL_SHARE = 0.01   # share of Tx; a larger Ty means that the cameras are mounted vertically
FOCAL_SHARE = 1e-3      # by which focal lengths of a rectified pair may differ
ROW_DIFFERENCE = 0.5    # px, by which cy of a rectified pair may differ
# Limits within which float32 outputs still resolve sixteenths of pixels.
FARTHEST_CENTRE = 1e6   # px, of cx and cy from 0, and from each other
LARGEST_MILLIMETRES = 65535     # of uint16
LENGTHS = 1e-9, 1e9     # of focal lengths in px, and of the baseline in metres
LONG_BASELINE = 2.0     # m; from here on it is probably given in centimetres or millimetres
RECTIFIED = {1: 0, 4: 0, 8: 0, 9: 0, 10: 1}     # elements of P of every rectified camera
ROUNDING = 1e-6         # of these, of those in px as a share of fx
MIDDLE = 0.25           # share of an image's side; principal points lie this near to the middle


def read_calibration(left_info, right_info):
    """
    Return the Calibration of a pair.

    left_info, right_info: any objects with the fields of sensor_msgs/CameraInfo. Their P is of
    the full rectified image; the calibration is of the region of interest, after binning.
    If only the baseline is missing it is 0 and a remark says so: rectified images can be matched
    without it, as by stereo_image_proc, which does not read K either.
    Raises BadPair for a P without focal length, and for cameras that are swapped, mounted one
    above the other, or show different rows.
    """
    infos = left_info, right_info
    (left, tx_left, ty_left), (right, tx_right, ty_right) = map(_projection, SIDES, infos)
    times = ['{}x{}'.format(*times_binned(info)) for info in infos]
    if times[0] != times[1]:
        raise BadPair('calibration', f"the cameras bin {' and '.join(times)} pixels; a pair "
                      'needs equal binning')
    rows = [int(info.roi.y_offset) for info in infos]
    if rows[0] != rows[1]:
        raise BadPair('calibration', f'the regions of interest begin in rows {rows[0]} '
                      f'and {rows[1]}; a pair needs the same rows of both cameras')
    across, down = tx_left - tx_right, ty_left - ty_right
    if abs(down) > VERTICAL_SHARE * abs(across):
        raise BadPair('calibration', f'Ty of the pair is {-down:g}: the cameras are mounted one '
                      'above the other; only side by side can be matched, turn the images')
    baseline = across / right.fx
    if baseline < 0:
        raise BadPair('calibration', f'the baseline is {baseline:g} m: left and right are '
                      'swapped, or Tx is in the wrong camera_info; swap the topics, or '
                      'write P[3] = -fx * baseline into the right one')
    calibration = Calibration(
        focal=right.fx, baseline=baseline, offset=left.cx - right.cx, left=left,
        remarks=tuple(_remarks(infos, (left, right), baseline)))
    check_range(calibration)
    return calibration


def check_range(calibration):
    """Raise BadPair for numbers outside the limits of real cameras and of our messages."""
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
    """Return the (rows, columns) of the image that a CameraInfo describes; None without them."""
    region, (across, down) = info.roi, times_binned(info)
    rows = (int(region.height) or int(info.height)) // down
    columns = (int(region.width) or int(info.width)) // across
    return (rows, columns) if rows and columns else None


def numbers_of(info, name):
    """Return the list of floats d, k, r or p of a CameraInfo; ROS 1 has upper-case names."""
    values = getattr(info, name) if hasattr(info, name) else getattr(info, name.upper())
    return [float(value) for value in values]


def content_of(info):
    """Return the content of a CameraInfo without its header, as a tuple to be compared."""
    region = info.roi
    return (*(np.array(numbers_of(info, name)).tobytes() for name in 'dkrp'),
            info.distortion_model, info.height, info.width, info.binning_x, info.binning_y,
            region.x_offset, region.y_offset, region.height, region.width)


def times_binned(info):
    """Return how many columns and how many rows a camera bins into one, 1 without binning."""
    return max(int(info.binning_x), 1), max(int(info.binning_y), 1)


def _projection(side, info):
    """Return the Projection, Tx and Ty of a camera, after region of interest and binning."""
    p = numbers_of(info, 'p')
    if len(p) != 12 or not all(math.isfinite(value) for value in p):
        raise BadPair('calibration', f'{side} camera_info: P is not twelve finite numbers; '
                      'calibrate the camera')
    if min(p[0], p[5]) < LENGTHS[0]:      # smaller ones may become 0 by binning
        raise BadPair('calibration', f'{side} camera_info: the camera is not calibrated (P[0] is '
                      f'{p[0]:g}, P[5] is {p[5]:g}); calibrate it, or load its '
                      'calibration into the driver')
    region, (across, down) = info.roi, times_binned(info)
    return (Projection(p[0] / across, p[5] / down, (p[2] - int(region.x_offset)) / across,
                       (p[6] - int(region.y_offset)) / down), p[3] / across, p[7] / down)


def _remarks(infos, projections, baseline):
    """Yield sentences about numbers that are probably wrong, or missing for depth."""
    left, right = projections
    if abs(left.fx - right.fx) > FOCAL_SHARE * right.fx:
        yield (f'fx is {left.fx:g} in the left and {right.fx:g} in the right camera_info; the '
               'two of a rectified pair are equal, the right one is used')
    if abs(left.cy - right.cy) > ROW_DIFFERENCE:
        yield (f'cy is {left.cy:g} in the left and {right.cy:g} in the right camera_info; rows '
               'of a rectified pair lie at the same height, calibrate the two as a pair')
    for side, info in zip(SIDES, infos):
        p = numbers_of(info, 'p')
        odd = [f'P[{place}] is {p[place]:g}' for place, value in RECTIFIED.items()
               if abs(p[place] - value) > ROUNDING * (p[0] if place < 8 else 1)]
        if odd:
            yield (f"{', '.join(odd)} in the {side} camera_info: P of a rectified "
                   'camera has no rotation, only fx, cx, Tx, fy, cy and P[10] = 1; take P1 and '
                   'P2 of a calibration of the two as a pair')
    if not baseline:
        cause = ('both camera_info is the same' if numbers_of(infos[1], 'p')[3] else
                 'the right camera_info is not -fx * baseline')
        yield (f'the baseline is 0 m, as P[3] of {cause}: disparities are without metres '
               '(t is 0), depth and points are left out; calibrate the two cameras as a pair, '
               'or load their calibration into the drivers')
        return
    if baseline >= LONG_BASELINE:
        yield (f'the baseline is {baseline:g} m; if that is meant to be cm or mm, all depths and '
               'points are 100 or 1000 times too far: P[3] of the right camera_info is '
               '-fx * baseline in metres (of a file: see --unit)')
    for side, info, camera in zip(SIDES, infos, projections):
        rows, columns = expected_size(info) or (0, 0)
        if rows and max(abs(camera.cx / columns - 0.5), abs(camera.cy / rows - 0.5)) > MIDDLE:
            yield (f'the principal point {camera.cx:g}, {camera.cy:g} of the {side} camera_info '
                   f'is far outside the middle of {columns}x{rows} pixels: give the region of '
                   'interest of images that are cut out, and the calibration of their size')


def reach(first, count, calibration):
    """Return a sentence on the depths of disparities, '' without a baseline; px, from first on."""
    product, last = calibration.focal * calibration.baseline, first + count - 1
    if not product or last <= calibration.offset:
        return ''
    farthest = first - calibration.offset
    far = 'infinity' if farthest <= 0 else f'{product / farthest:.3g} m'
    return (f'{first} to {last} px at focal length {calibration.focal:.4g} px and baseline '
            f'{calibration.baseline:.3g} m reach from {far} to '
            f'{product / (last - calibration.offset):.3g} m')


def points_reach(farthest):
    """Return a sentence on the `Calibration.points_limit` of a file of points, '' for none."""
    return f'points beyond {farthest:.3g} m are left out (--points-max-depth)' * math.isfinite(
        farthest)


def disparity_of(depth, calibration):
    """Return disparities, float32 (R, C), px, of depth in m: NaN where it is 0, less or NaN."""
    with np.errstate(divide='ignore', invalid='ignore'):
        disparity = calibration.focal * calibration.baseline / depth.astype(np.float64)
        disparity = np.where(depth > 0, disparity + calibration.offset, np.nan)
    return disparity.astype(np.float32)


def millimetres_of(depth):
    """
    Return depth in whole millimetres, uint16 (R, C), 0 = invalid, infinite or beyond 65.535 m.

    depth: float32 (R, C), metres, NaN = invalid. uint16 has no value for infinite, and
    depth_image_proc takes every value but 0 for a distance.
    """
    near = cv2.threshold(depth, LARGEST_MILLIMETRES / 1000, 0, cv2.THRESH_TOZERO_INV)[1]
    cv2.patchNaNs(near, 0.0)    # processors round NaN differently
    # Not cv2.multiply: for 4 x 1 values OpenCV 4 takes a scalar for an array of four values.
    return cv2.addWeighted(near, 1000.0, near, 0.0, 0.0, dtype=cv2.CV_16U)
