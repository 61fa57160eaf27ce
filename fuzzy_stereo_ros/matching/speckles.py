# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speckles: small components of a disparity map, which are seldom right.

Not in the paper. As cv2.filterSpeckles finds them, but by bands that threads share: each finds
the components of its rows, these are joined where bands meet, and each refuses its small ones.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    find_components, join_components, refuse_small)
import numpy as np


class Speckles:
    """Memory for one image size."""

    def __init__(self, rows, columns):
        """Allocate for images of a size."""
        self._bands, self._columns = cut_bands(rows), columns
        self._edges = np.array([first for _, first, _ in self._bands])
        self._marks = np.zeros((len(self._bands), 3), np.int64)
        self._runs = [np.zeros(rows * columns, np.int32) for _ in range(4)]

    def refuse(self, crew, labels, verdict, step, smallest):
        """
        Refuse the components of fewer than `smallest` pixels.

        labels: whole numbers (R, C); verdict: uint8 (R, C), written; step: neighbours whose labels
        differ by at most this are connected
        """
        labels, verdict = labels.reshape(-1), verdict.reshape(-1)
        runs, marks, columns = self._runs, self._marks, self._columns
        crew.each(lambda band: find_components(
            labels, verdict, columns, step, *runs, marks[band[0]], band[1], band[2]), self._bands)
        join_components(labels, columns, step, *runs, marks, self._edges)
        crew.each(lambda band: refuse_small(
            verdict, smallest, *runs, band[1] * columns, marks[band[0], 2]), self._bands)
