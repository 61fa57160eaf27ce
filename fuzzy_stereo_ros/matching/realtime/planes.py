# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Mutation of the profile `realtime`: regions of weak texture as planes.

The paper mutates the least possible cells by patches. Here the least certain ones are those of
plain walls, which data cannot tell apart: a region of like grey takes the plane on which most of
its consistent matches agree, as the segments of `quality` do (Bleyer and Gelautz, 2005). The
crossover then keeps what is fitter.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
import numpy as np

STEP, APART, OVERLAP = 768, 384, 6   # of runs, in 1/256 grey levels and half-size px: find_runs
LEAST = 60           # half-size pixels of a region
POINTS = 200         # of a region, at most, that its plane is fitted to
ROUNDS, AGREEMENT = 24, 0.7          # random planes that are tried, and px by which a point agrees
SHARE = 0.6          # of the points that lie within 1 px, else the region is no plane


class GreyRegions:
    """Regions of like grey of half-size pictures of one size."""

    def __init__(self, rows, columns):
        """Allocate for half-size pictures of a size."""
        self._bands = cut_bands(rows)
        self._edges = np.array([first for _, first, _ in self._bands])
        self._begin, self._end, self._parent, self._size, self._region = (
            np.zeros(rows * columns, np.int32) for _ in range(5))
        self._row_runs = np.zeros((rows, 2), np.int32)
        self._sums = np.zeros((len(self._bands), 2, columns + 1), np.int32)

    def grow(self, pool, fine, weak, step, apart, overlap, least):
        """
        Return the runs of rows with their regions, as kernels take them, and how many regions.

        fine: uint16, the picture with a margin; weak: uint8 (r, c), where regions may lie; step,
        apart, overlap: see find_runs; least: pixels of a region
        """
        runs = self._begin, self._end, self._parent, self._row_runs
        pool.each(lambda band: segments.find_runs(
            fine, MARGIN, weak, step, apart, overlap, *runs, self._sums[band[0]], band[1],
            band[2]), self._bands)
        segments.join_runs(fine, MARGIN, apart, overlap, *runs, self._sums[0], self._edges)
        number = segments.number_regions(*runs, least, self._size, self._region)
        return (self._begin, self._end, self._row_runs, self._region), number


class WeakRegions:
    """The mutation of one image size and its memory."""

    def __init__(self, rows, columns, labels_type):
        """Allocate for full images of a size, and labels of a type."""
        self._regions = GreyRegions(rows // 2, columns // 2)
        pixels, most = (rows // 2) * (columns // 2), (rows // 2) * (columns // 2) // LEAST
        self._tally, self._starts = np.zeros((most, 3), np.int32), np.zeros(most + 1, np.int32)
        self._points = np.zeros((3, pixels), np.float32)
        self._planes = np.zeros((most, 3), np.float32)
        self._mutant = np.zeros((rows, columns), labels_type)

    def grow(self, pool, fine, weak):
        """
        Return the regions of a picture, as `GreyRegions.grow` does.

        fine: uint16, the half-size picture with a margin; weak: uint8 (r, c), where texture is
        weak
        """
        return self._regions.grow(pool, fine, weak, STEP, APART, OVERLAP, LEAST)

    def mutant(self, grown, chosen, validity, disparities, inside, parent, random):
        """
        Return a chromosome whose regions lie in planes: (R, C) labels.

        grown: the regions; chosen, validity: the `Chosen` of the scanlines, and which of its
        labels are consistent; inside: first and last column of the target that exist; parent:
        the other genes
        """
        regions, number = grown
        planes = self._planes[:number]
        segments.gather_points(
            *regions, POINTS, chosen.labels, chosen.offsets, validity, self._tally[:number],
            self._starts, self._points)
        segments.fit_planes(
            self._points, self._starts, ROUNDS, np.float32(AGREEMENT), SHARE, random.key, planes)
        self._mutant[:] = parent
        segments.write_mutant(*regions, planes, disparities, inside, self._mutant)
        return self._mutant
