# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Regions that may lie in one plane: segments of like pixels at several scales, and tiles."""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.kernels.planes import fits, segments
import numpy as np

SCALES = ((60, 40), (150, 80), (400, 200))   # size parameter and least pixels of segments
BLUR = 0.6           # px, standard deviation, before segments are grown


class Regions(NamedTuple):
    """
    A partition of the pixels of an image.

    labels: int32 (R, C), from 0; starts: int32 (N + 1,), pixels: int32 (R * C,), the pixels of
    region i are pixels[starts[i]:starts[i + 1]]
    """

    labels: np.ndarray
    starts: np.ndarray
    pixels: np.ndarray

    @property
    def number(self):
        """How many regions there are."""
        return len(self.starts) - 1


def listed(labels, number):
    """Return the `Regions` of labels, int32 (R, C)."""
    regions = Regions(labels, np.zeros(number + 1, np.int32), np.zeros(labels.size, np.int32))
    fits.list_regions(labels.reshape(-1), regions.starts, regions.pixels)
    return regions


def tiles(shape, side, random):
    """Return square tiles as `Regions`, their grid at a random place."""
    down, right = (int(draw * side) for draw in random.uniform(2))
    labels = np.zeros(shape, np.int32)
    return listed(labels, fits.label_tiles(side, down, right, labels))


def segments_of(seen):
    """
    Return the segments of an image, finest first: of each scale labels and how many there are.

    seen: float32 (R, C, 3); labels: int32 (R, C), from 0, see listed
    """
    rows, columns = seen.shape[:2]
    pixels = rows * columns
    differences, order = np.zeros(2 * pixels, np.int16), np.zeros(2 * pixels, np.int32)
    edges = order[:segments.sort_edges(
        cv2.GaussianBlur(seen, (0, 0), BLUR), differences,
        np.zeros(segments.LEVELS + 1, np.int32), order)]
    parent, size = (np.zeros(pixels, np.int32) for _ in range(2))
    inner, found = np.zeros(pixels, np.float32), []
    for scale, smallest in SCALES:
        labels = np.zeros((rows, columns), np.int32)
        found.append((labels, segments.join_pixels(
            edges, differences, columns, np.float32(scale), smallest, parent, size, inner,
            labels.reshape(-1))))
    return found
