# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Regions that may lie in one plane, and planes fitted to regions and around pixels.

Regions are segments of like pixels at several scales. Maps of planes are float32 (R, 3, C).
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.planes import fits, segments
import numpy as np

SCALES = ((60, 40), (150, 80), (400, 200))   # size parameter and least pixels of segments
BLUR = 0.6           # px, standard deviation, before segments are grown


class Regions(NamedTuple):
    """
    A partition of the pixels of an image.

    labels: int32 (R, C), from 0; starts: int32 (N + 1,), pixels: int32 (R * C,): those of region
    i are pixels[starts[i]:starts[i + 1]], row * C + column
    """

    labels: np.ndarray
    starts: np.ndarray
    pixels: np.ndarray

    @property
    def number(self):
        """How many regions there are."""
        return len(self.starts) - 1


def listed(labels, number):
    """Return the `Regions` of labels, int32 (R, C), from 0 to number - 1."""
    ends = np.bincount(labels.reshape(-1), minlength=number).cumsum(dtype=np.int32)
    return Regions(labels, np.append(np.int32(0), ends),
                   np.argsort(labels, axis=None, kind='stable').astype(np.int32))


def segments_of(roots):
    """Return the `Regions` of segments of each scale, finest first; roots: float32 (R, C, 3)."""
    rows, columns = roots.shape[:2]
    pixels = rows * columns
    differences, order = np.zeros(2 * pixels, np.int16), np.zeros(2 * pixels, np.int32)
    edges = order[:segments.sort_edges(
        cv2.GaussianBlur(roots, (0, 0), BLUR), differences,
        np.zeros(segments.LEVELS + 1, np.int32), order)]
    parent, size = (np.zeros(pixels, np.int32) for _ in range(2))
    inner, found = np.zeros(pixels, np.float32), []
    for scale, smallest in SCALES:
        labels = np.zeros((rows, columns), np.int32)
        found.append(listed(labels, segments.join_pixels(
            edges, differences, np.float32(scale), smallest, parent, size, inner, labels)))
    return found


PLANE_RADIUS, LIMIT = 4, 0.6  # of local planes: px, px that neighbours may differ by
GROWTH = 0.25            # of the limit: by this share of it a px of distance
# Weights of neighbours by grey levels of difference, summed over channels.
BY_COLOUR = np.exp(-np.arange(766) / 15.0).astype(np.float32)
_PARTS = 8                               # of the regions of an image, for threads


def local_planes(pool, disparity, colour):
    """Return planes around pixels; disparity: float32 (R, C), px; colour: uint8 (R, C, 3)."""
    rows, columns = disparity.shape
    planes = np.empty((rows, 3, columns), np.float32)
    around = neighbours(PLANE_RADIUS, LIMIT)
    pool.each(lambda band: fits.local_planes(
        disparity, colour, around, planes, *band[1:]), cut_bands(rows))
    return planes


def neighbours(radius, limit):
    """Return the neighbours that planes around pixels are fitted to, see fits; limit: px."""
    return radius, BY_COLOUR, np.float32(limit), np.float32(GROWTH)


def region_planes(pool, disparity, trusted, regions, random):
    """Return a plane for each of some `Regions`, fitted to its trusted pixels: float32 (N, 3)."""
    planes = np.zeros((regions.number, 3), np.float32)
    key = random.key
    edges = [regions.number * part // _PARTS for part in range(_PARTS + 1)]
    pool.each(lambda part: fits.region_planes(
        disparity, trusted, regions[1:], key, planes, *part), list(zip(edges, edges[1:])))
    return planes


def planes_of(planes, labels):
    """Return the map of the planes of regions, float32 (N, 3); labels: (R, C), regions."""
    return np.stack([part[labels] for part in planes.T], axis=1)
