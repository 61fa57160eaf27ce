# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Mutation of the profile `realtime`: regions of weak texture as planes.

The paper mutates the least possible cells by patches. Here the least certain ones are those of
plain walls, which data cannot tell apart: a region of like grey takes the plane on which most of
its consistent matches agree, as the segments of `quality` do (Bleyer and Gelautz, 2005). The
crossover then keeps what is fitter.
"""
from fuzzy_stereo_ros.matching.kernels.planes import weak_regions
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
import numpy as np

STEP, APART, OVERLAP = 768, 384, 6   # of runs, in 1/256 grey levels and half-size px: find_runs
LEAST = 60           # half-size pixels of a region
POINTS = 200         # of a region, at most, that its plane is fitted to
ROUNDS, AGREEMENT = 24, 0.7          # random planes that are tried, and px by which a point agrees
SHARE = 0.6          # of the points that lie within 1 px, else the region is no plane


class WeakRegions:
    """The mutation of one image size and its memory."""

    def __init__(self, rows, columns, labels_type):
        """Allocate for full images of a size, and labels of a type."""
        pixels, most = (rows // 2) * (columns // 2), (rows // 2) * (columns // 2) // LEAST
        self._begin, self._end, self._parent, self._size, self._region = (
            np.zeros(pixels, np.int32) for _ in range(5))
        self._row_starts = np.zeros(rows // 2 + 1, np.int32)
        self._sums = np.zeros((2, columns // 2 + 1), np.int32)
        self._tally, self._starts = np.zeros((3, most), np.int32), np.zeros(most + 1, np.int32)
        self._points = np.zeros((3, pixels), np.float32)
        self._planes = np.zeros((most, 3), np.float32)
        self._mutant = np.zeros((rows, columns), labels_type)

    def grow(self, fine, weak):
        """
        Grow the regions of a picture; return how many there are.

        fine: uint16, the half-size picture with a margin; weak: uint8 (r, c), where texture is
        weak
        """
        weak_regions.find_runs(fine, MARGIN, weak, STEP, APART, OVERLAP, self._begin, self._end,
                               self._parent, self._row_starts, self._sums)
        return weak_regions.number_regions(
            self._begin, self._end, self._parent, self._row_starts[-1], LEAST, self._size,
            self._region)

    def mutant(self, number, chosen, verdict, disparities, inside, parent, random):
        """
        Return a chromosome whose regions, of a number, lie in planes: (R, C) labels.

        chosen, verdict: the `Chosen` of the scanlines, and which of its labels are consistent;
        inside: first and last column of the target that exist; parent: the other genes
        """
        regions = self._begin, self._end, self._row_starts, self._region
        planes = self._planes[:number]
        weak_regions.gather_points(
            *regions, POINTS, chosen.labels, chosen.offsets, verdict, self._tally[:, :number],
            self._starts, self._points)
        weak_regions.fit_planes(
            self._points, self._starts, ROUNDS, np.float32(AGREEMENT), SHARE, random.key, planes)
        self._mutant[:] = parent
        weak_regions.write_mutant(*regions, planes, disparities, inside, self._mutant)
        return self._mutant
