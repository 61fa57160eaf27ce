# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Four messages into the pair to be matched: rectified, cut and reduced as asked for."""
from dataclasses import replace
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.calibration import (
    content_of, expected_size, numbers_of, read_calibration, times_binned)
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, StereoPair, width_by_height
import numpy as np

SCALES = (1.0, 0.5, 0.25)
SIDES = ('left', 'right')
COEFFICIENTS = {'plumb_bob': (4, 5, 8, 12, 14), 'rational_polynomial': (4, 5, 8, 12, 14),
                'equidistant': (4,)}        # how many D may have, of the models that cv2 knows
ROTATION_TOLERANCE = 0.01   # of an element of R times its transpose
LARGEST = 1e9               # number of K, D and P: of larger ones products are infinite
STEPS = 1000                # at which it is looked where a lens turns back
NOWHERE = -2.0              # px; remap finds only its border there
FRACTIONS = 32              # of a pixel: what remap rounds places to


class _Plan(NamedTuple):
    """
    What is done to the images of one calibration and size.

    calibration: of the images as they come out. window: slices of rows and columns to be cut.
    maps: of the window, for each side what remap takes; None where nothing is rectified.
    missing: as of a StereoPair.
    """

    calibration: Calibration
    window: tuple
    maps: tuple | None
    missing: tuple | None


class PairReader:
    """
    Reads pairs from messages.

    What follows from a calibration is computed with its first pair and kept until it changes.
    scale: of the images that come out, one of `SCALES`.
    """

    def __init__(self, rectify=False, crop=False, scale=1.0):
        """
        Read images from now on so.

        rectify: the images are raw; rectify them by K, D, R and P of their CameraInfo.
        crop: cut both to a rectangle in which both rectified images have pixels.
        scale: one of `SCALES`; average blocks of 1 / scale x 1 / scale pixels.
        Raises ValueError for another scale.
        """
        if scale not in SCALES:
            allowed = ', '.join(f'{one:g}' for one in SCALES)
            raise ValueError(f'scale is {scale!r}; allowed are {allowed}')
        self._rectify, self._crop, self.scale = rectify, crop, scale
        self._plan, self._planned_for = None, None

    def read(self, left, left_info, right, right_info):
        """
        Return the StereoPair of two images, raw or compressed, and their CameraInfo.

        Its calibration describes the images as they come out; its remarks also tell where an
        image is not of the size its CameraInfo expects.
        Raises BadPair with a sentence where the four cannot be matched.
        """
        images = _read_images(left, right)
        rows, columns = images[0].shape[:2]
        asked = content_of(left_info), content_of(right_info), rows, columns
        if asked != self._planned_for:
            self._plan = self._plan_for((left_info, right_info), rows, columns)
            self._planned_for = asked
        plan = self._plan
        if plan.maps is None:
            images = [image[plan.window] for image in images]
        else:
            images = [cv2.remap(image, *places, cv2.INTER_LINEAR)
                      for image, places in zip(images, plan.maps)]
        if self.scale != 1:
            images = [_reduced(image, self.scale) for image in images]
        return StereoPair(*map(np.ascontiguousarray, images), plan.calibration,
                          stamp_of(left.header), left.header.frame_id, plan.missing)

    def _plan_for(self, infos, rows, columns):
        calibration = read_calibration(*infos)
        remarks = self._remarks_on_size(infos, rows, columns)
        calibration = replace(calibration, remarks=(*calibration.remarks, *remarks))
        window, maps, missing = (slice(0, rows), slice(0, columns)), None, None
        if self._rectify or self._crop:
            places = [source_places(side, info, rows, columns)
                      for side, info in zip(SIDES, infos)]
            if self._crop:
                window = whole_window(np.logical_and(
                    *(has_source(x, y, rows, columns) for x, y in places)))
                if window[0].stop == 0:
                    raise BadPair('calibration', 'no rectangle is left in which both rectified '
                                  'images have pixels; K, D, R and P of the two camera_info do '
                                  'not fit each other: calibrate the two cameras as a pair')
            if self._rectify:
                maps = tuple(cv2.convertMaps(x[window], y[window], cv2.CV_16SC2)
                             for x, y in places)
                missing = [~has_source(x[window], y[window], rows, columns) for x, y in places]
        calibration = calibration.cut(window[0].start, window[1].start)
        if self.scale != 1:
            height, width = (part.stop - part.start for part in window)
            block = round(1 / self.scale)
            if min(height, width) < block:
                raise BadPair('size', f'the images are {width}x{height}; scale {self.scale:g} '
                              f'averages blocks of {block}x{block} pixels and needs one at least')
            calibration = calibration.scaled(self.scale)
            if missing is not None:     # a block is, where one of its pixels is
                missing = [_reduced(one.astype(np.float32), self.scale) > 0 for one in missing]
        if missing is not None and not np.any(missing):
            missing = None
        return _Plan(calibration, window, maps, missing and tuple(missing))

    def _remarks_on_size(self, infos, rows, columns):
        """Return sentences on images of an unexpected size; reject what depends on it."""
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
            remarks.append(f'{fact}; disparities are of the image as it is')
        return remarks


def _read_images(left, right):
    """Return the two images of a pair, of one size and depth."""
    images = []
    for side, message in zip(SIDES, (left, right)):
        try:
            images.append(read_image(message))
        except BadPair as bad:
            raise BadPair(bad.reason, f'{side} image: {bad}') from None
    left, right = images
    if left.shape[:2] != right.shape[:2]:
        raise BadPair('size', f'the left image is {width_by_height(left)}, the right one '
                      f'{width_by_height(right)}; a pair needs two of one size')
    if left.dtype != right.dtype:
        images = [_full_range(image) for image in images]
    return images


def _full_range(image):
    """Return an image of 8 bits, or of few used bits in 16, spread over the 16."""
    if image.dtype == np.uint8:
        return image.astype(np.uint16) * np.uint16(257)
    return image << np.uint16(16 - max(8, int(image.max()).bit_length()))


def _reduced(image, scale):
    """Return an image averaged over blocks; rows and columns that fill none are left out."""
    block = round(1 / scale)
    rows, columns = (side // block for side in image.shape[:2])
    return cv2.resize(image[:rows * block, :columns * block], (columns, rows),
                      interpolation=cv2.INTER_AREA)


def source_places(side, info, rows, columns):
    """
    Return x and y in the raw image for each pixel of the rectified one: float32 (R, C), px.

    Both images are as they are, after the CameraInfo's region of interest and binning, and of one
    size. What the camera cannot see, behind it or where the polynomial of its lens turns back,
    comes from nowhere. A distortion_model that is not named counts as none.
    Raises BadPair for K, D, R or a distortion_model that cannot be rectified with.
    """
    intrinsic, rotation, projection = _matrices(side, info)
    distortion = _distortion(side, info)
    arguments = rotation, projection, (columns, rows), cv2.CV_32FC1
    if distortion is not None and info.distortion_model == 'equidistant':
        places = cv2.fisheye.initUndistortRectifyMap(intrinsic, distortion, *arguments)
    else:
        places = cv2.initUndistortRectifyMap(intrinsic, distortion, *arguments)
    x, y = places
    unseen = _unseen(info.distortion_model, distortion, projection @ rotation, rows, columns)
    x[unseen] = y[unseen] = NOWHERE
    return x, y


def has_source(x, y, rows, columns):
    """Return which places lie inside an image of a size, as remap rounds them: bool (R, C)."""
    x, y = (np.rint(places * np.float32(FRACTIONS)) for places in (x, y))
    return (x >= 0) & (x <= FRACTIONS * (columns - 1)) & (y >= 0) & (y <= FRACTIONS * (rows - 1))


def _matrices(side, info):
    """Return K, R and the left of P, (3, 3), of the image as it is."""
    k, r, p = (numbers_of(info, name) for name in 'krp')
    if len(k) != 9 or not _are_usable(k) or min(k[0], k[4]) < 1 / LARGEST:
        raise BadPair('calibration', f'{side} camera_info: K is not of a calibrated camera; '
                      'calibrate it, or set rectify and crop to false')
    if not _are_usable(p):
        raise BadPair('calibration', f'{side} camera_info: P holds numbers above {LARGEST:g}; '
                      'calibrate it, or set rectify and crop to false')
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


def _are_usable(values):
    """Return whether all of some numbers are finite, and not so large that squares are not."""
    return bool(np.all(np.abs(values) <= LARGEST))


def _is_rotation(values):
    if len(values) != 9 or not _are_usable(values):
        return False
    matrix = np.reshape(values, (3, 3))
    return np.linalg.det(matrix) > 0 and np.allclose(
        matrix @ matrix.T, np.eye(3), rtol=0, atol=ROTATION_TOLERANCE)


def _distortion(side, info):
    """Return D as an array, None where there is no distortion."""
    distortion, model = np.array(numbers_of(info, 'd')), info.distortion_model
    if not model or not distortion.any():
        return None
    if model not in COEFFICIENTS:
        raise BadPair('calibration', f'{side} camera_info: distortion_model is {model!r:.60}; '
                      f"allowed are {', '.join(COEFFICIENTS)}; for others rectify elsewhere, "
                      'and set rectify and crop to false')
    allowed = COEFFICIENTS[model]
    if distortion.size not in allowed or not _are_usable(distortion):
        raise BadPair('calibration', f'{side} camera_info: D has {distortion.size} numbers; '
                      f"allowed for {model} are {', '.join(map(str, allowed))} finite ones, "
                      f'none above {LARGEST:g}')
    return distortion


def _unseen(model, distortion, of_raw, rows, columns):
    """
    Return the pixels of the rectified image whose rays the raw image cannot hold: bool (R, C).

    of_raw: float64 (3, 3), the raw camera's directions into rectified pixels.
    """
    back = np.linalg.inv(of_raw)
    across, down = np.arange(columns), np.arange(rows)[:, np.newaxis]
    x, y, z = (line[0] * across + line[1] * down + line[2] for line in back)
    behind = z <= 0
    if distortion is None or behind.all():
        return behind
    radius = np.hypot(x, y) / np.where(behind, np.inf, z)
    tried = np.linspace(0, radius.max(), STEPS)
    turned = np.diff(_distorted(model, distortion, tried)) <= 0
    return behind | (radius > tried[turned.argmax()]) if turned.any() else behind


def _distorted(model, distortion, radius):
    """Return how far from the centre a lens shows what an ideal one shows at a radius."""
    if model == 'equidistant':
        angle = np.arctan(radius)
        return angle * (1 + np.polyval([*distortion[::-1], 0], angle**2))
    k1, k2, _, _, k3, k4, k5, k6 = np.pad(distortion, (0, 8))[:8]
    square = radius**2
    with np.errstate(divide='ignore', invalid='ignore'):
        return radius * np.polyval([k3, k2, k1, 1], square) / np.polyval([k6, k5, k4, 1], square)


def whole_window(there):
    """
    Return the slices of rows and of columns of a large rectangle in which every pixel is there.

    there: bool (R, C). While one is missing inside, the side that misses the largest share of
    its pixels is dropped: not always the largest rectangle, but near it where what is missing
    lies along the borders. Both slices are empty where nothing is left.
    """
    top, left, (bottom, right) = 0, 0, there.shape
    absent = ~there
    missing = np.count_nonzero(absent)
    while missing:
        rows, columns = slice(top, bottom), slice(left, right)
        gone = [np.count_nonzero(side) for side in (
            absent[top, columns], absent[bottom - 1, columns],
            absent[rows, left], absent[rows, right - 1])]
        width, height = right - left, bottom - top
        worst = int(np.argmax([gone[0] / width, gone[1] / width,
                               gone[2] / height, gone[3] / height]))
        missing -= gone[worst]
        top, bottom = top + (worst == 0), bottom - (worst == 1)
        left, right = left + (worst == 2), right - (worst == 3)
    if top == bottom or left == right:
        return slice(0, 0), slice(0, 0)
    return slice(top, bottom), slice(left, right)
