# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speckles: small components of a disparity map, which are seldom right.

Not in the paper. As cv2.filterSpeckles finds them, but by bands that threads share: `find` the
components of each band, `join` them where bands meet, then `reject` the small ones of each band.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    find_components, join_components, reject_small)
import numpy as np


class Speckles:
    """
    Memory for one image size.

    labels: whole numbers (R, C); validity: uint8 (R, C); step: neighbours whose labels differ by
    at most this are connected; smallest: pixels of a component that stays; band: one of `bands`
    """

    def __init__(self, columns, bands):
        """Allocate for images of so many columns; bands: of all rows, see `cut_bands`."""
        self._bands, self._columns, rows = bands, columns, bands[-1][2]
        self._edges = np.array([first for _, first, _ in bands])
        self._marks = np.zeros((len(bands), 3), np.int64)
        self._runs = [np.zeros(rows * columns, np.int32) for _ in range(4)]

    def find(self, labels, validity, step, band):
        """Find the components of a band."""
        index, first, last = band
        find_components(labels.reshape(-1), validity.reshape(-1), self._columns, step, *self._runs,
                        self._marks[index], first, last)

    def join(self, labels, step):
        """Join the components of all bands where they touch."""
        join_components(labels.reshape(-1), self._columns, step, *self._runs, self._marks,
                        self._edges)

    def reject(self, validity, smallest, band):
        """Reject the pixels of a band that belong to small components."""
        index, first, _ = band
        reject_small(validity.reshape(-1), smallest, *self._runs, first * self._columns,
                     self._marks[index, 2])


def reject_speckles(pool, labels, validity, step, smallest):
    """Reject the small components of a map; the arguments are those of Speckles."""
    bands = cut_bands(len(labels))
    speckles = Speckles(labels.shape[1], bands)
    pool.each(lambda band: speckles.find(labels, validity, step, band), bands)
    speckles.join(labels, step)
    pool.each(lambda band: speckles.reject(validity, smallest, band), bands)
