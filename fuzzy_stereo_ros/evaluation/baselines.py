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
from fuzzy_stereo_ros.matching.row_offsets import grey
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
import numpy as np

MODES = {'SGBM': cv2.STEREO_SGBM_MODE_SGBM, '3WAY': cv2.STEREO_SGBM_MODE_SGBM_3WAY,
         'HH4': cv2.STEREO_SGBM_MODE_HH4}
ALGORITHMS = ('BM', *MODES)
SIXTEENTHS = 16  # OpenCV stores a disparity in sixteenths and searches a multiple of 16
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
    """One of OpenCV's matchers, at the defaults of stereo_image_proc or tuned for a family."""

    name: str
    algorithm: str
    tuned: bool = False
    rejects_zero: bool = False  # a disparity of 0 is invalid: better if nothing is infinitely far

    def matcher(self, family, disparities):
        """Return its `PreparedBaseline`: from 0 to the next multiple of 16 disparities."""
        settings = TUNED_SETTINGS[family][self.algorithm] if self.tuned else Settings()
        return PreparedBaseline(self.algorithm, settings, disparities,
                                padded=self.tuned, rejects_zero=self.rejects_zero)


class PreparedBaseline:
    """One of OpenCV's matchers for many pairs; opencv: it alone, to be timed on `images`."""

    def __init__(self, algorithm, settings, disparities, padded, rejects_zero=False):
        """Make OpenCV's matcher of `Settings`; padded: whether the left border is matched."""
        # OpenCV searches the next multiple of 16, from 0.
        labels = -(-disparities // SIXTEENTHS) * SIXTEENTHS
        self.padding, self.rejects_zero = labels if padded else 0, rejects_zero
        if algorithm != 'BM':
            self.opencv = cv2.StereoSGBM_create(
                0, labels, settings.block, settings.p1, settings.p2, settings.left_right,
                settings.cap, settings.uniqueness, settings.speckle_size, settings.speckle_range,
                MODES[algorithm])
            return
        self.opencv = cv2.StereoBM_create(labels, settings.block)
        self.opencv.setPreFilterSize(9)
        self.opencv.setPreFilterCap(settings.cap)
        self.opencv.setTextureThreshold(settings.texture)
        self.opencv.setUniquenessRatio(settings.uniqueness)
        self.opencv.setDisp12MaxDiff(settings.left_right)
        self.opencv.setSpeckleWindowSize(settings.speckle_size)
        self.opencv.setSpeckleRange(settings.speckle_range)

    def images(self, left, right):
        """Return what OpenCV takes of two images: grey, padded, uint8 (R, padding + C)."""
        # Both together, as 16 bits are scaled by their largest value.
        both = in_eight_bits(np.hstack([grey(left), grey(right)]))
        return tuple(cv2.copyMakeBorder(image, 0, 0, self.padding, 0, cv2.BORDER_REPLICATE)
                     for image in np.hsplit(both, 2))

    def disparity(self, found):
        """Return what `opencv` computed without padding: float32 (R, C), px, NaN = invalid."""
        found = found[:, self.padding:]
        valid = found > 0 if self.rejects_zero else found >= 0
        return np.where(valid, found / np.float32(SIXTEENTHS), np.nan).astype(np.float32)

    def match(self, left, right):
        """Return the disparities of two images: float32 (R, C), pixels, NaN = invalid."""
        return self.disparity(self.opencv.compute(*self.images(left, right)))


def _tuned(block, p1, ratio, *others):
    """Return `Settings`; p1: in squares of the side; ratio: P2 / P1; others: from cap on."""
    return Settings(block, p1 * block**2, ratio * p1 * block**2, *others, texture=0)


# Found by `python -m bench tuning` on scenes 1, 3, 5 and so on of each group: by the error
# of dense maps, with and without noise, over block, P1, P2 / P1 from 2 to 8, cap, uniqueness,
# left-right difference and speckles. What the search began with stays if better on all scenes.
TUNED_SETTINGS = {
    MIDDLEBURY: {'BM': _tuned(9, 0, 1, 15, 5, 1, 100, 4),
                 'SGBM': _tuned(3, 4, 2, 31, 0, 2, 400, 1),
                 '3WAY': _tuned(3, 8, 3, 31, 0, 2, 400, 1),
                 'HH4': _tuned(3, 8, 4, 31, 0, 1, 400, 4)},
    KITTI: {'BM': _tuned(7, 0, 1, 31, 0, -1, 100, 4),
            'SGBM': _tuned(5, 4, 8, 31, 0, 2, 400, 1),
            '3WAY': _tuned(7, 8, 8, 31, 0, 1, 100, 2),
            'HH4': _tuned(5, 16, 8, 31, 0, 1, 400, 2)},
}
TUNED = [Baseline(f'{name} tuned', name, tuned=True) for name in ALGORITHMS]


@contextmanager
def opencv_threads(threads):
    """Set the number of OpenCV's threads for the with block."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def dense(disparity):
    """
    Return a disparity map without gaps: filled from the background, then by a 5x5 median.

    An invalid pixel takes the smaller of the nearest valid disparities to its left and right. A
    row without any takes the nearest row that has one; a map without any becomes 0.
    disparity: float32 (R, C), pixels, NaN = invalid.
    """
    import pandas as pd

    given = pd.DataFrame(disparity)
    filled = np.fmin(given.ffill(axis=1), given.bfill(axis=1)).to_numpy()
    known = np.flatnonzero(np.isfinite(filled[:, 0]))
    if not known.size:
        return np.zeros_like(filled)
    rows = np.arange(len(filled))
    nearest = known[np.argmin(abs(rows[:, None] - known), axis=1)]
    return cv2.medianBlur(np.ascontiguousarray(filled[nearest], np.float32), MEDIAN)
