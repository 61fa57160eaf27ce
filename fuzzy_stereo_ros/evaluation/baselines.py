# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
OpenCV's matchers, at the defaults of stereo_image_proc and tuned, and how their gaps are filled.

All take grey images. For a tuned baseline the left border of both images is padded by the number
of disparities, so that it matches there too; a default one runs as in the node of
stereo_image_proc. P1 and P2 are multiples of the square of the block's side.
"""
from contextlib import contextmanager
from dataclasses import dataclass

import cv2
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI, MIDDLEBURY
import numpy as np

MODES = {'SGBM': cv2.STEREO_SGBM_MODE_SGBM, '3WAY': cv2.STEREO_SGBM_MODE_SGBM_3WAY,
         'HH4': cv2.STEREO_SGBM_MODE_HH4}
ALGORITHMS = ('BM', *MODES)
STEP = 16  # OpenCV stores a disparity in sixteenths and searches a multiple of 16
MEDIAN = 5


@dataclass(frozen=True)
class Settings:
    """Settings of a baseline; the defaults are those of stereo_image_proc."""

    block: int = 15
    p1: int = 200
    p2: int = 400
    cap: int = 31
    uniqueness: int = 15
    left_right: int = 0
    speckle_size: int = 100
    speckle_range: int = 4
    texture: int = 10


@dataclass(frozen=True)
class Baseline:
    """
    One of OpenCV's matchers, at the defaults of stereo_image_proc or tuned for a family of scenes.

    rejects_zero: whether a disparity of 0 is invalid: better if nothing is infinitely far.
    """

    name: str
    algorithm: str
    tuned: bool = False
    rejects_zero: bool = False

    def settings(self, family):
        """Return its `Settings` for a family, None if it was not tuned for that."""
        return TUNED_SETTINGS[family].get(self.algorithm) if self.tuned else Settings()

    def matcher(self, family, disparities):
        """Return OpenCV's matcher, which searches from 0 to the next multiple of 16."""
        chosen, labels = self.settings(family), multiple_of_16(disparities)
        if self.algorithm != 'BM':
            return cv2.StereoSGBM_create(
                0, labels, chosen.block, chosen.p1, chosen.p2, chosen.left_right, chosen.cap,
                chosen.uniqueness, chosen.speckle_size, chosen.speckle_range,
                MODES[self.algorithm])
        matcher = cv2.StereoBM_create(labels, chosen.block)
        matcher.setPreFilterSize(9)
        matcher.setPreFilterCap(chosen.cap)
        matcher.setTextureThreshold(chosen.texture)
        matcher.setUniquenessRatio(chosen.uniqueness)
        matcher.setDisp12MaxDiff(chosen.left_right)
        matcher.setSpeckleWindowSize(chosen.speckle_size)
        matcher.setSpeckleRange(chosen.speckle_range)
        return matcher

    def match(self, left, right, family, disparities):
        """Return the disparities of two images: float32 (R, C), pixels, NaN = invalid."""
        padding = multiple_of_16(disparities) if self.tuned else 0
        left, right = (cv2.copyMakeBorder(grey(image), 0, 0, padding, 0, cv2.BORDER_REPLICATE)
                       for image in (left, right))
        found = self.matcher(family, disparities).compute(left, right)[:, padding:]
        valid = found > 0 if self.rejects_zero else found >= 0
        return np.where(valid, found / np.float32(STEP), np.nan).astype(np.float32)


def _tuned(block, p1, p2, cap, uniqueness):
    return Settings(block, p1 * block**2, p2 * block**2, cap, uniqueness, left_right=1,
                    speckle_range=2, texture=0)


# Chosen by their errors on these families. BM and SGBM were not tuned for KITTI.
TUNED_SETTINGS = {
    MIDDLEBURY: {'BM': _tuned(13, 0, 0, 15, 0), 'SGBM': _tuned(5, 2, 16, 15, 0),
                 '3WAY': _tuned(3, 4, 32, 15, 5), 'HH4': _tuned(3, 8, 32, 15, 10)},
    KITTI: {'3WAY': _tuned(7, 8, 64, 31, 0), 'HH4': _tuned(5, 16, 128, 31, 0)},
}
DEFAULT = [Baseline(f'{name} default', name) for name in ALGORITHMS]
TUNED = [Baseline(f'{name} tuned', name, tuned=True) for name in ALGORITHMS]
REFERENCE = Baseline('3WAY tuned', '3WAY', tuned=True)      # of benchmarks with one baseline
STRICTEST = Baseline('HH4 tuned, 0 rejected', 'HH4', tuned=True, rejects_zero=True)


@contextmanager
def opencv_threads(threads):
    """Set the number of OpenCV's threads for the with block."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def grey(image):
    """Return an image as OpenCV's matchers take it: uint8 (R, C)."""
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def multiple_of_16(disparities):
    """Return the next multiple of 16: the number of disparities that OpenCV searches."""
    return -(-disparities // STEP) * STEP


def dense(disparity):
    """
    Return a disparity map without gaps: filled from the background, then by a 5x5 median.

    An invalid pixel takes the smaller of the nearest valid disparities to its left and right. A
    row without any takes the nearest row that has one; a map without any becomes 0.
    disparity: float32 (R, C), pixels, NaN = invalid.
    """
    filled = np.fmin(_last_valid(disparity), _last_valid(disparity[:, ::-1])[:, ::-1])
    known = np.flatnonzero(np.isfinite(filled[:, 0]))
    if not known.size:
        return np.zeros_like(filled)
    rows = np.arange(len(filled))
    nearest = known[np.argmin(abs(rows[:, None] - known), axis=1)]
    return cv2.medianBlur(np.ascontiguousarray(filled[nearest], np.float32), MEDIAN)


def _last_valid(disparity):
    """Return for each pixel the nearest valid disparity to its left or itself, NaN if none."""
    columns = np.arange(disparity.shape[1])
    last = np.maximum.accumulate(np.where(np.isfinite(disparity), columns, -1), axis=1)
    found = np.take_along_axis(disparity, np.maximum(last, 0), axis=1)
    return np.where(last >= 0, found, np.nan)
