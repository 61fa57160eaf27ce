# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pictures of scenes for a page: what is true, what contestants found, and how far that is off."""
import math
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.evaluation.small_pictures import drawing, photograph
from fuzzy_stereo_ros.pairs.colours import colour_disparity, in_eight_bits
from fuzzy_stereo_ros.views.pictures import ERROR_LIMIT
import numpy as np

SHADES = 128            # of disparities and of errors
THICK = 2.5             # px, half of a point's size where the truth has gaps everywhere
UNKNOWN_GREY = 110      # no truth
NOTHING_FOUND = (190, 140, 0)   # BGR: a truth, but no disparity


class Shown(NamedTuple):
    """The pictures of a scene as data URIs; of_matchers: {name: (disparity, error)}."""

    left: str
    truth: str
    of_matchers: dict


class Gallery:
    """
    The pictures of scenes, kept while there are few; of many, those of the best and the worst.

    shown: {scene's name: `Shown`}.
    """

    def __init__(self, limit, judged):
        """limit: how many scenes; judged: (name, start) of the contestant that ranks them."""
        self._limit, self._judged = limit, judged
        self._errors, self.shown = {}, {}

    def show(self, known, result, maps):
        """Draw a `KnownPair` with {contestant's name: map}; let one go if they are too many."""
        name = result.found.name
        error = result.main_error(*self._judged)
        self._errors[name] = math.nan if error is None else error
        self.shown[name] = drawn(known, maps)
        if len(self.shown) > self._limit:
            unknown = [each for each in self.shown if math.isnan(self._errors[each])]
            ranked = unknown or sorted(self.shown, key=self._errors.get)
            del self.shown[ranked[len(ranked) // 2]]


def drawn(known, maps):
    """Return the `Shown` of a `KnownPair` and {contestant's name: float32 (R, C), px}."""
    valid = np.isfinite(known.truth)
    low, high = (float(known.truth[valid].min()), float(known.truth[valid].max())
                 ) if valid.any() else (0.0, 1.0)
    return Shown(
        photograph(in_eight_bits(known.left)),
        drawing(_colours(_thickened(known.truth, valid), low, high)),
        {name: (drawing(_colours(disparity, low, high)),
                drawing(colour_error(known.as_scored(disparity), known.truth)))
         for name, disparity in maps.items()})


def colour_error(disparity, truth):
    """
    Return how far off a map is, in the colours of Magma: uint8 (R, C, 3) BGR.

    disparity, truth: float (R, C), pixels, NaN = invalid. Black is right, the brightest off by
    ERROR_LIMIT px or more; grey has no truth, blue a truth but no disparity.
    """
    error = np.minimum(abs(disparity - truth), ERROR_LIMIT)
    levels = _thickened(np.where(np.isfinite(error), error, 2 * ERROR_LIMIT).astype(np.float32),
                        np.isfinite(truth))
    shares = np.clip(np.nan_to_num(levels) / ERROR_LIMIT, 0, 1)
    shades = np.rint(np.rint(shares * (SHADES - 1)) * (255 / (SHADES - 1))).astype(np.uint8)
    picture = cv2.applyColorMap(shades, cv2.COLORMAP_MAGMA)
    picture[levels > ERROR_LIMIT] = NOTHING_FOUND
    picture[np.isnan(levels)] = UNKNOWN_GREY
    return picture


def error_legend():
    """Return the colours of errors from 0 to ERROR_LIMIT, as a data URI."""
    ramp = np.linspace(0, ERROR_LIMIT, SHADES, dtype=np.float32)[None].repeat(10, axis=0)
    return drawing(colour_error(ramp, np.zeros_like(ramp)))


def _colours(disparity, low, high):
    """Return disparities in SHADES colours."""
    step = max(high - low, 1e-6) / (SHADES - 1)
    return colour_disparity(low + step * np.rint((disparity - low) / step), low, high)


def _thickened(values, there):
    """
    Return values with points made thick where less than half are there; NaN where none is near.

    values: float32 (R, C); there: bool (R, C).
    """
    if np.count_nonzero(there) > there.size / 2 or not there.any():
        return np.where(there, values, np.float32(np.nan))
    distance, nearest = cv2.distanceTransformWithLabels(
        np.uint8(~there), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL)
    of_points = np.zeros(nearest.max() + 1, np.float32)
    of_points[nearest[there]] = values[there]
    return np.where(distance <= THICK, of_points[nearest], np.float32(np.nan))
