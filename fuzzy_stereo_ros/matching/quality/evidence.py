# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Evidence of the images alone for what a proposal moves.

A smooth plane is fitter than a rough surface even where the images say little, as in shadows on a
road. A region therefore moves only if its matches, without smoothness, are not less possible; it
may lose something where the two views disagree about what is there.
"""
from fuzzy_stereo_ros.matching.kernels.planes.costs import UNIT
from fuzzy_stereo_ros.matching.kernels.planes.evidence import reject_unfounded
import numpy as np

FAR = 0.5            # px by which a pixel moves, as it counts
PRICE = 0.2          # of a pixel about which the views disagree, parts of an impossible match
LEAST = 100          # px of a region that is asked for evidence


class Evidence:
    """Memory for one image size."""

    def __init__(self, rows, columns):
        """Allocate."""
        self._region = np.zeros((rows, columns), np.int32)
        self._parent, self._size = (np.zeros(rows * columns + 1, np.int32) for _ in range(2))
        self._dearer = np.zeros(rows * columns + 1, np.int64)

    def reject(self, labels, old, new, old_costs, new_costs, trusted, selected):
        """Let `selected` be false in regions that must not move: see reject_unfounded."""
        reject_unfounded(labels, old, new, np.float32(FAR), old_costs, new_costs, trusted,
                         int(PRICE * UNIT), LEAST, self._region, self._parent, self._dearer,
                         self._size, selected)


class NoEvidence:
    """Asks for none: what is fitter moves."""

    def __init__(self, rows, columns):
        """Need no memory."""

    def reject(self, *_):
        """Reject nothing."""
