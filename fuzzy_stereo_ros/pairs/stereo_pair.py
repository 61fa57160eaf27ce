# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A stereo pair as the matcher needs it, wherever it came from, and why one may be refused."""
from dataclasses import dataclass

import numpy as np


class BadPair(ValueError):
    """
    A pair that cannot be matched, with a sentence that says why.

    reason: one word for counters and throttled logs, the same for all sentences of a kind.
    """

    def __init__(self, reason, sentence):
        super().__init__(sentence)
        self.reason = reason


@dataclass(frozen=True)
class Calibration:
    """
    What turns a disparity of this pair into metres: Z = focal * baseline / (disparity - offset).

    focal: px of the image as it is, after binning. baseline: metres, > 0.
    offset: px, cx of the left image minus cx of the right one.
    remarks: sentences about a calibration that is usable but hardly right.
    """

    focal: float
    baseline: float
    offset: float = 0.0
    remarks: tuple = ()


@dataclass(frozen=True)
class StereoPair:
    """
    Two rectified images of one moment.

    left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR, of one size and dtype, contiguous;
    one may have colour where the other has none.
    stamp: ns. frame_id: the left camera's, empty where there is none.
    """

    left: np.ndarray
    right: np.ndarray
    calibration: Calibration
    stamp: int
    frame_id: str = ''
