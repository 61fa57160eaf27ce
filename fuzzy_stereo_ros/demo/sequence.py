# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A real stereo sequence with ground truth that needs no download: a window pans over a pair."""
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.ground_truth import read_motorcycle
import numpy as np

ROWS, COLUMNS = 480, 640
STEP = 2  # pixels per frame to the right or left


class WindowPair(NamedTuple):
    """
    What the window shows in one frame.

    left, right: uint8 (R, C, 3) BGR.
    truth: float32 (R, C), pixels, x_left - x_right, left-referenced, NaN = unknown.
    first_row, first_column: of the window in the whole images.
    """

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray
    first_row: int
    first_column: int


class MotorcycleWindow:
    """
    The Motorcycle pair of scikit-image by a window.

    focal: px. baseline: metres. offset: px, the left camera's principal point minus that of the
    right one; a disparity of the images minus it is zero at infinity.
    """

    focal = 994.978
    baseline = 0.193001
    offset = -31.086

    def __init__(self):
        self._pair = read_motorcycle()

    def frame(self, number):
        """Return the `WindowPair` of a frame; the window turns round at the images' borders."""
        rows, columns = self._pair.truth.shape
        row = _to_and_fro(number // 2, rows - ROWS)
        column = _to_and_fro(STEP * number, columns - COLUMNS)
        shown = (slice(row, row + ROWS), slice(column, column + COLUMNS))
        return WindowPair(np.ascontiguousarray(self._pair.left[shown]),
                          np.ascontiguousarray(self._pair.right[shown]),
                          self._pair.truth[shown], row, column)


def _to_and_fro(distance, length):
    """Return where something is that walks from 0 to length and back, again and again."""
    place = distance % (2 * length)
    return min(place, 2 * length - place)
