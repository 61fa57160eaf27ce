# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plane maps, float32 (R, C, 3), fitted to disparities around pixels and in regions."""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.planes import fits
import numpy as np

RADIUS, LIMIT, GROWTH = 4, 0.6, 0.25     # of local planes: px, px that neighbours may differ by
PLANE_COLOUR = 15.0      # grey levels, summed over channels, at which a neighbour counts 1 / e
ROUNDS, AGREEMENT = 60, 0.7              # random planes tried a region; px by which pixels agree
_PARTS = 8                               # that the regions of an image are cut into, for threads


def local_planes(pool, disparity, colour):
    """Return planes around pixels; disparity: float32 (R, C), px; colour: uint8 (R, C, 3)."""
    planes = np.empty((*disparity.shape, 3), np.float32)
    by_colour = np.exp(-np.arange(766) / PLANE_COLOUR).astype(np.float32)
    pool.each(lambda band: fits.local_planes(
        disparity, colour, RADIUS, by_colour, np.float32(LIMIT), np.float32(GROWTH), planes,
        band[1], band[2]), cut_bands(len(disparity)))
    return planes


def region_planes(pool, disparity, trusted, regions, random):
    """Return a plane for each of some `Regions`, fitted to its trusted pixels: float32 (N, 3)."""
    planes = np.zeros((regions.number, 3), np.float32)
    largest, key = int(np.diff(regions.starts).max()), random.key
    edges = [regions.number * part // _PARTS for part in range(_PARTS + 1)]
    pool.each(lambda part: fits.region_planes(
        disparity, trusted, regions.starts, regions.pixels, ROUNDS, np.float32(AGREEMENT), key,
        np.zeros((3, largest), np.float32), planes, *part), list(zip(edges, edges[1:])))
    return planes


def spread(pool, planes, source, regions):
    """Return a map in which each region has a plane: that of region source[i], int32 (N,)."""
    result = np.empty((*regions.labels.shape, 3), np.float32)
    pool.each(lambda band: fits.spread_planes(
        planes, source, regions.labels, result, band[1], band[2]), cut_bands(len(result)))
    return result
