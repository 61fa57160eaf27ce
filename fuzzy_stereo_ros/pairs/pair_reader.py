# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read the pair to be matched from four messages: rectify, crop and scale its images."""
from dataclasses import replace
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.calibration import (
    content_of, expected_size, numbers_of, read_calibration, times_binned)
from fuzzy_stereo_ros.pairs.camera_files import (
    are_usable, coefficients_of, EQUIDISTANT, LARGEST_NUMBER, model_of)
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from fuzzy_stereo_ros.pairs.stereo_pair import (
    BadPair, Calibration, SIDES, StereoPair, UNCALIBRATED, width_by_height)
import numpy as np

SCALES = (1.0, 0.5, 0.25)
SIZE_SHARE = 0.01       # by which ratios of sizes differ if only rounding made them
ROTATION_TOLERANCE = 0.01   # of each element of R times its transpose
RADIUS_STEPS = 10_000       # samples in the search for the radius where a distortion folds back
OFF_IMAGE = -2.0            # px; a position outside every image, for remap
FRACTIONS = 32              # of a pixel, to which remap rounds positions


class _Plan(NamedTuple):
    calibration: Calibration    # of the images after these steps
    window: tuple               # slices of the rows and columns to keep
    maps: tuple | None          # of the window, for each side, for cv2.remap if it is rectified
    missing: tuple | None       # as in StereoPair


class PairReader:
    """Reads pairs from messages; maps to rectify are kept while the cameras stay the same."""

    def __init__(self, rectify=False, crop=False, scale=1.0):
        """
        Store what to do with each pair; ValueError for a scale that is none of `SCALES`.

        rectify: by K, D, R and P of the CameraInfo. crop: to a rectangle in which both rectified
        images have pixels. scale: average blocks of 1 / scale x 1 / scale pixels.
        """
        if scale not in SCALES:
            allowed = ', '.join(f'{one:g}' for one in SCALES)
            raise ValueError(f'scale is {scale!r}; allowed are {allowed}')
        self._rectify, self._crop, self.scale = rectify, crop, scale
        self._plan, self._planned_for = None, None

    def read(self, left, left_info, right, right_info):
        """
        Return the StereoPair of two images, raw or compressed, and their CameraInfo.

        Without a calibration both CameraInfo are None; such images can only be scaled. Remarks
        say if an image has another size than its CameraInfo expects, and no stamp or frame.
        Raises BadPair with a sentence if the four messages make no pair.
        """
        stamp, frame_id = stamp_of(left.header), left.header.frame_id
        remarks = [f'the {name} of the left image is {value!r}: its results cannot be placed; let '
                   f'the driver set header.{name}'
                   for name, value in (('stamp', stamp), ('frame_id', frame_id))
                   if not value and not getattr(left, 'numbered', False)]
        images = []
        for side, message in zip(SIDES, (left, right)):
            try:
                images.append(read_image(message))
            except BadPair as bad:
                raise BadPair(bad.reason, f'{side} image: {bad}') from None
        return self.read_images(images, (left_info, right_info), stamp, frame_id, remarks)

    def read_images(self, images, infos=(None, None), stamp=0, frame_id='', remarks=()):
        """Return the same of two images, each as `image_files.read_image` returns it."""
        images = _alike(*images)
        rows, columns = images[0].shape[:2]
        infos = infos if infos[0] is not None else ()
        key = (*map(content_of, infos), rows, columns, *remarks)
        if key != self._planned_for:
            self._plan = self._plan_for(infos, rows, columns, remarks)
            self._planned_for = key
        plan = self._plan
        images = [image[plan.window] for image in images] if plan.maps is None else [
            cv2.remap(image, *maps, cv2.INTER_LINEAR) for image, maps in zip(images, plan.maps)]
        if self.scale != 1:
            images = [_reduced(image, self.scale) for image in images]
        return StereoPair(*map(np.ascontiguousarray, images), plan.calibration, stamp, frame_id,
                          plan.missing)

    def _plan_for(self, infos, rows, columns, remarks):
        calibration = read_calibration(*infos) if infos else UNCALIBRATED
        remarks = *remarks, *self._remarks_on_size(infos, rows, columns)
        calibration = replace(calibration, remarks=(*calibration.remarks, *remarks))
        window, maps, missing = (slice(0, rows), slice(0, columns)), None, None
        if self._rectify or self._crop:
            positions = [raw_positions(side, info, rows, columns)
                         for side, info in zip(SIDES, infos)]
            if self._crop:
                window = largest_window(np.logical_and(
                    *(is_inside(x, y, rows, columns) for x, y in positions)))
                if window[0].stop == 0:
                    raise BadPair('calibration', 'no rectangle is left in which both rectified '
                                  'images have pixels; K, D, R and P of the two camera_info do '
                                  'not fit each other: calibrate the two cameras as a pair')
            if self._rectify:
                maps = tuple(cv2.convertMaps(x[window], y[window], cv2.CV_16SC2)
                             for x, y in positions)
                missing = [~is_inside(x[window], y[window], rows, columns) for x, y in positions]
        calibration = calibration.cut(window[0].start, window[1].start)
        if self.scale != 1:
            height, width = (part.stop - part.start for part in window)
            block = round(1 / self.scale)
            if min(height, width) < block:
                raise BadPair('size', f'the images are {width}x{height}; scale {self.scale:g} '
                              f'averages blocks of {block}x{block} pixels and needs one at least')
            calibration = calibration.scaled(self.scale)
            if missing is not None:     # a block is missing if one of its pixels is
                missing = [_reduced(one.astype(np.float32), self.scale) > 0 for one in missing]
        if missing is not None and not np.any(missing):
            missing = None
        return _Plan(calibration, window, maps, missing and tuple(missing))

    def _remarks_on_size(self, infos, rows, columns):
        """Return sentences about images of an unexpected size; BadPair if they are rectified."""
        remarks = []
        for side, info in zip(SIDES, infos):
            expected = expected_size(info)
            if expected in (None, (rows, columns)):
                continue
            fact = (f'the {side} image is {columns}x{rows}, its camera_info expects '
                    f'{expected[1]}x{expected[0]}')
            if self._rectify or self._crop:
                raise BadPair('size', f'{fact}; it can be neither rectified nor cropped: correct '
                              'the camera_info, or set rectify and crop to false')
            remarks.append(f'{fact}: {_effect((rows, columns), expected)}')
        return remarks


def _effect(size, expected):
    """Return what is wrong with depth and points of images of a size that is not expected."""
    down, across = (of_info / of_image for of_info, of_image in zip(expected, size))
    if abs(down - across) > SIZE_SHARE * across or abs(across - 1) <= SIZE_SHARE:
        return ('if it is cut out, points lie beside their place: give its region of interest '
                'in both camera_info')
    ratio, far = (across, 'far') if across > 1 else (1 / across, 'near')
    return (f'depth and points are {ratio:.3g} times too {far}, as fx is of the other size: '
            'publish the camera_info of this size')


def _alike(left, right):
    """Return the two images of a pair, of one size and depth."""
    if left.shape[:2] != right.shape[:2]:
        raise BadPair('size', f'the left image is {width_by_height(left)}, the right one '
                      f'{width_by_height(right)}; a pair needs two of one size')
    return (left, right) if left.dtype == right.dtype else (_full_range(left), _full_range(right))


def _full_range(image):
    """Return an image of 8 bits, or of the bits used out of 16, scaled to all 16 bits."""
    if image.dtype == np.uint8:
        return image.astype(np.uint16) * np.uint16(257)
    return image << np.uint16(16 - max(8, int(image.max()).bit_length()))


def _reduced(image, scale):
    block = round(1 / scale)
    rows, columns = (side // block for side in image.shape[:2])
    return cv2.resize(image[:rows * block, :columns * block], (columns, rows),
                      interpolation=cv2.INTER_AREA)


def raw_positions(side, info, rows, columns):
    """
    Return x and y in the raw image for each pixel of the rectified image: float32 (R, C), px.

    Both images have the same size, after the CameraInfo's region of interest and binning. Pixels
    that the camera cannot see, behind it or where the distortion polynomial folds back, get
    positions outside the image. An empty distortion_model means no distortion.
    Raises BadPair for a K, D, R or distortion_model that does not allow rectification.
    """
    intrinsic, rotation, projection = _matrices(side, info)
    model, distortion = _distortion(side, info)
    of_opencv = cv2.fisheye if model == EQUIDISTANT else cv2
    x, y = of_opencv.initUndistortRectifyMap(intrinsic, distortion, rotation, projection,
                                             (columns, rows), cv2.CV_32FC1)
    unseen = _unseen(model, distortion, projection @ rotation, rows, columns)
    x[unseen] = y[unseen] = OFF_IMAGE
    return x, y


def is_inside(x, y, rows, columns):
    """Return whether positions lie inside an image, rounded as remap does: bool (R, C)."""
    x, y = (np.rint(positions * np.float32(FRACTIONS)) for positions in (x, y))
    return (x >= 0) & (x <= FRACTIONS * (columns - 1)) & (y >= 0) & (y <= FRACTIONS * (rows - 1))


def _matrices(side, info):
    """Return K, R and the left (3, 3) of P, after region of interest and binning."""
    k, r, p = (numbers_of(info, name) for name in 'krp')
    if len(k) != 9 or not are_usable(k) or min(k[0], k[4]) < 1 / LARGEST_NUMBER:
        raise BadPair('calibration', f'{side} camera_info: K is not of a calibrated camera; '
                      'calibrate it, or set rectify and crop to false')
    if not are_usable(p):
        raise BadPair('calibration', f'{side} camera_info: P holds numbers above '
                      f'{LARGEST_NUMBER:g}; calibrate it, or set rectify and crop to false')
    if not _is_rotation(r):
        raise BadPair('calibration', f'{side} camera_info: R is not a rotation; calibrate the two '
                      'cameras as a pair, or set rectify and crop to false')
    (across, down), region = times_binned(info), info.roi
    of_image = np.array([[1 / across, 0, -int(region.x_offset) / across],
                         [0, 1 / down, -int(region.y_offset) / down],
                         [0, 0, 1]])
    rotation = np.reshape(r, (3, 3))
    intrinsic = np.array([[k[0], 0, k[2]], [0, k[4], k[5]], [0, 0, 1]])
    projection = np.array([[p[0], p[1], p[2]], [0, p[5], p[6]], [0, 0, 1]])
    return of_image @ intrinsic, rotation, of_image @ projection


def _is_rotation(values):
    if len(values) != 9 or not are_usable(values):
        return False
    matrix = np.reshape(values, (3, 3))
    return np.linalg.det(matrix) > 0 and np.allclose(
        matrix @ matrix.T, np.eye(3), rtol=0, atol=ROTATION_TOLERANCE)


def _distortion(side, info):
    """Return the model of a lens and D; None for D of a pinhole without distortion."""
    model, distortion = model_of([info.distortion_model]), numbers_of(info, 'd')
    if not info.distortion_model or model != EQUIDISTANT and not any(distortion):
        return '', None
    try:
        return model, coefficients_of(model, distortion)
    except BadPair as bad:
        raise BadPair(bad.reason, f'{side} camera_info: {bad}') from None


def _unseen(model, distortion, projection, rows, columns):
    """Return which rectified pixels the raw camera cannot see: bool (R, C)."""
    inverse = np.linalg.inv(projection)
    across, down = np.arange(columns), np.arange(rows)[:, np.newaxis]
    x, y, z = (line[0] * across + line[1] * down + line[2] for line in inverse)
    behind = z <= 0
    if distortion is None or behind.all():
        return behind
    radius = np.hypot(x, y) / np.where(behind, np.inf, z)
    # in equal steps of the angle, as rays at a right angle to the axis have an infinite radius
    samples = np.tan(np.linspace(0, np.arctan(radius.max()), RADIUS_STEPS))
    folds = np.diff(_distorted(model, distortion, samples)) <= 0
    return behind | (radius > samples[folds.argmax()]) if folds.any() else behind


def _distorted(model, distortion, radius):
    """Return the distorted radius of an undistorted one, in the normalised image plane."""
    if model == EQUIDISTANT:
        angle = np.arctan(radius)
        return angle * (1 + np.polyval([*distortion[::-1], 0], angle**2))
    k1, k2, _, _, k3, k4, k5, k6 = np.pad(distortion, (0, 8))[:8]
    square = radius**2
    with np.errstate(divide='ignore', invalid='ignore'):
        return radius * np.polyval([k3, k2, k1, 1], square) / np.polyval([k6, k5, k4, 1], square)


def largest_window(valid):
    """
    Return the slices of rows and columns of a large rectangle without invalid pixels.

    valid: bool (R, C). The search is greedy: while the rectangle has invalid pixels, it loses the
    side with the largest share of them. The result is close to the largest rectangle if the
    invalid pixels lie along the borders. Both slices are empty if nothing is left.
    """
    top, left, (bottom, right) = 0, 0, valid.shape
    invalid = ~valid
    remaining = np.count_nonzero(invalid)
    while remaining:
        rows, columns = slice(top, bottom), slice(left, right)
        counts = [np.count_nonzero(side) for side in (
            invalid[top, columns], invalid[bottom - 1, columns],
            invalid[rows, left], invalid[rows, right - 1])]
        width, height = right - left, bottom - top
        worst = int(np.argmax(np.divide(counts, (width, width, height, height))))
        remaining -= counts[worst]
        top, bottom = top + (worst == 0), bottom - (worst == 1)
        left, right = left + (worst == 2), right - (worst == 3)
    if top == bottom or left == right:
        return slice(0, 0), slice(0, 0)
    return slice(top, bottom), slice(left, right)
