# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A stereo pair as the matcher needs it, wherever it came from, and why one may be rejected."""
from dataclasses import dataclass, replace
import re
from typing import NamedTuple

import numpy as np

NUMBERS = re.compile(r'\d[\d.]*')


class BadPair(ValueError):
    """
    A pair that cannot be matched, with a sentence that says why.

    reason: one word for counters and throttled logs, the same for all sentences of a kind.
    """

    def __init__(self, reason, sentence):
        super().__init__(sentence)
        self.reason = reason


def kind_of(sentence):
    """Return a sentence without its numbers: what those that differ only there have in common."""
    return NUMBERS.sub('#', sentence)


def width_by_height(image):
    """Return the size of an image, any array (R, C, ...), as a sentence names it: 640x480."""
    return f'{image.shape[1]}x{image.shape[0]}'


class Projection(NamedTuple):
    """How a camera projects into its image as it is, px: u = fx X / Z + cx, v = fy Y / Z + cy."""

    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True)
class Calibration:
    """
    What turns a disparity of this pair into metres: Z = focal * baseline / (disparity - offset).

    focal: px of the image as it is, whatever was done to it before. baseline: metres; 0: unknown,
    there are no metres.
    offset: px, cx of the left image minus cx of the right one.
    left: the Projection of the left camera.
    remarks: sentences about a calibration that is usable but hardly right.
    """

    focal: float
    baseline: float
    offset: float
    left: Projection
    remarks: tuple = ()

    def cut(self, first_row, first_column):
        """Return the calibration of both images from a row and a column of theirs on."""
        left = self.left._replace(cx=self.left.cx - first_column, cy=self.left.cy - first_row)
        return replace(self, left=left)

    def scaled(self, scale):
        """Return the calibration of both images averaged over blocks of 1 / scale pixels."""
        fx, fy, cx, cy = self.left
        # Positions count from the centre of the first pixel, which is half a pixel inside.
        left = Projection(fx * scale, fy * scale,
                          (cx + 0.5) * scale - 0.5, (cy + 0.5) * scale - 0.5)
        return replace(self, focal=self.focal * scale, offset=self.offset * scale, left=left)


@dataclass(frozen=True)
class StereoPair:
    """
    Two rectified images of one moment.

    left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR, of one size and dtype, contiguous;
    one may have colour where the other has none.
    stamp: ns. frame_id: the left camera's, empty where there is none.
    missing: bool (R, C) of the left and of the right image, where a rectified pixel comes from
    outside the raw image; None where no pixel does.
    """

    left: np.ndarray
    right: np.ndarray
    calibration: Calibration
    stamp: int
    frame_id: str = ''
    missing: tuple | None = None
