# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Four messages into the pair to be matched: rectified, cut and reduced as asked for."""
from dataclasses import replace
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.calibration import content_of, expected_size, read_calibration
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from fuzzy_stereo_ros.pairs.rectification import has_source, source_places, whole_window
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, StereoPair, width_by_height
import numpy as np

SCALES = (1.0, 0.5, 0.25)
SIDES = ('left', 'right')


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
                window = _seen_by_both(places, rows, columns)
            if self._rectify:
                maps = tuple(cv2.convertMaps(x[window], y[window], cv2.CV_16SC2)
                             for x, y in places)
                missing = [~has_source(x[window], y[window], rows, columns) for x, y in places]
        calibration = calibration.cut(window[0].start, window[1].start)
        if self.scale != 1:
            _check_blocks(window, self.scale)
            calibration = calibration.scaled(self.scale)
            if missing is not None:     # a block is, where one of its pixels is
                missing = [_reduced(one.astype(np.float32), self.scale) > 0 for one in missing]
        if missing is not None and not np.any(missing):
            missing = None
        return _Plan(calibration, window, maps, missing and tuple(missing))

    def _remarks_on_size(self, infos, rows, columns):
        """Return sentences on images of an unexpected size; refuse what depends on it."""
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
    used = max(8, int(image.max()).bit_length())
    return image << np.uint16(16 - used)


def _seen_by_both(places, rows, columns):
    """Return the window in which both rectified images have pixels."""
    there = [has_source(x, y, rows, columns) for x, y in places]
    window = whole_window(there[0] & there[1])
    if window[0].stop == 0:
        raise BadPair('calibration', 'no rectangle is left in which both rectified images have '
                      'pixels; K, D, R and P of the two camera_info do not fit each other: '
                      'calibrate the two cameras as a pair')
    return window


def _check_blocks(window, scale):
    rows, columns = (part.stop - part.start for part in window)
    block = round(1 / scale)
    if min(rows, columns) < block:
        raise BadPair('size', f'the images are {columns}x{rows}; scale {scale:g} averages blocks '
                      f'of {block}x{block} pixels and needs one at least')


def _reduced(image, scale):
    """Return an image averaged over blocks; rows and columns that fill none are left out."""
    block = round(1 / scale)
    rows, columns = (side // block for side in image.shape[:2])
    return cv2.resize(image[:rows * block, :columns * block], (columns, rows),
                      interpolation=cv2.INTER_AREA)
