# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Features that two images have in common, without regard to rows, range and sides."""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.row_offsets import reduced
import numpy as np

REDUCED_COLUMNS = 560   # about so many, of images that are reduced to find features
FEATURES, PATCH = 500, 31
UNIQUE, LIKE = 0.85, 60         # share of the second best distance, and bits of 256
WANTED_CONTRAST, MOST_GAIN = 30.0, 4.0     # grey levels that a dull image gets, and largest factor


class Features(NamedTuple):
    """
    Features that two images have in common, px of the images as they are.

    number: of features of the left image, before any were compared. places: float64 (N, 2),
    column and row in the right image. disparities, lower: float64 (N,), by how much the
    feature is farther left and lower in the right image. pixel: px of a reduced image's pixel.
    """

    number: int
    places: np.ndarray
    disparities: np.ndarray
    lower: np.ndarray
    pixel: int


def features_in_common(left, right):
    """Return the Features, by ORB of one scale, that are each other's best of two uint8 (R, C)."""
    pixel = max(1, round(left.shape[1] / REDUCED_COLUMNS))
    none = Features(0, np.empty((0, 2)), np.empty(0), np.empty(0), pixel)
    if min(left.shape) < 2 * PATCH * pixel:
        return none
    detector = cv2.ORB_create(nfeatures=FEATURES, nlevels=1, edgeThreshold=PATCH // 2 + 1,
                              patchSize=PATCH, fastThreshold=7)
    (ours, our_bits), (theirs, their_bits) = (
        detector.detectAndCompute(_with_contrast(reduced(image, pixel)), None)
        for image in (left, right))
    if min(len(ours), len(theirs)) < 2:
        return none._replace(number=len(ours))
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    back = {one.queryIdx: one.trainIdx for one in matcher.match(their_bits, our_bits)}
    chosen = [(*ours[best.queryIdx].pt, *theirs[best.trainIdx].pt)
              for best, second in matcher.knnMatch(our_bits, their_bits, 2)
              if best.distance < min(UNIQUE * second.distance, LIKE)
              and back[best.trainIdx] == best.queryIdx]
    x, y, other_x, other_y = pixel * np.array(chosen, np.float64).reshape(-1, 4).T
    return Features(len(ours), np.stack([other_x, other_y], 1), x - other_x, other_y - y, pixel)


def _with_contrast(image):
    """Return an image, a dull one with more contrast: uint8."""
    mean, spread = (one.item() for one in cv2.meanStdDev(image))
    gain = float(np.clip(WANTED_CONTRAST / max(spread, 1e-6), 1, MOST_GAIN))
    return cv2.addWeighted(image, gain, image, 0, (1 - gain) * mean)
