# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A stereo pair with its calibration, and the exception for a pair that cannot be matched."""
from dataclasses import dataclass, replace
import math
import re
from typing import NamedTuple

import numpy as np

SIDES = 'left', 'right'
TOLD_APART = 1 / 3  # largest share of its depth by which one pixel of disparity moves a point
NUMBERS = re.compile(r'\d[\d.]*')


class BadPair(ValueError):
    """A pair that cannot be matched: a sentence, and the reason in a word or two."""

    def __init__(self, reason, sentence):
        super().__init__(sentence)
        self.reason = reason


def kind_of(sentence):
    """Return the kind of a sentence: the sentence with # for each of its numbers."""
    return NUMBERS.sub('#', sentence)


def width_by_height(image):
    """Return the size of an image, any array (R, C, ...), as in 640x480."""
    return f'{image.shape[1]}x{image.shape[0]}'


def number_of(count, noun, plural=''):
    """Return a number with its noun, in the plural unless it is 1; plural: '' for noun + s."""
    return f'{count} {noun if count == 1 else plural or noun + "s"}'


class Projection(NamedTuple):
    """The pinhole projection of a camera, px: u = fx X / Z + cx, v = fy Y / Z + cy."""

    fx: float
    fy: float
    cx: float
    cy: float

    def points(self, depth, out=None):
        """
        Return the points of all pixels in the optical frame: x right, y down, z forward, metres.

        depth: float32 (R, C), m; where NaN or infinite the point is NaN. out: float32 (R, C, 3 or
        more) to be written, None = a new (R, C, 3).
        """
        rows, columns = depth.shape
        out = np.empty((rows, columns, 3), np.float32) if out is None else out
        x, y, z = (out[:, :, axis] for axis in range(3))
        np.copyto(z, depth)
        np.copyto(z, np.nan, where=np.isinf(depth))
        across = (np.arange(columns) - self.cx) / self.fx
        down = (np.arange(rows) - self.cy) / self.fy
        with np.errstate(over='ignore'):    # x and y may become infinite
            np.multiply(z, across.astype(np.float32), out=x)
            np.multiply(z, down.astype(np.float32)[:, np.newaxis], out=y)
        return out


@dataclass(frozen=True)
class Calibration:
    """The calibration of a rectified pair: depth = focal * baseline / (disparity - offset)."""

    focal: float            # px of the images as the matcher gets them; 0 if nothing is known
    baseline: float         # m; 0 if unknown, the pair then has no depth
    offset: float           # px, cx of the left image minus cx of the right one
    left: Projection
    remarks: tuple = ()     # sentences about one that can be used but is probably wrong

    def depth(self, disparity):
        """
        Return the depth of disparities, as REP 118 defines it: float32 (R, C), metres.

        disparity: float32 (R, C), px, NaN = invalid. Invalid pixels stay NaN; where the disparity
        is not above the offset, the depth is infinite. Without a baseline all is NaN.
        """
        if not self.baseline:
            return np.full_like(disparity, np.nan)
        depth = disparity - np.float32(self.offset)
        with np.errstate(divide='ignore', over='ignore'):
            np.divide(np.float32(self.focal * self.baseline), depth, out=depth)
        np.copyto(depth, np.inf, where=depth < 0)       # also the -inf of a disparity of -0.0
        return depth

    def points_limit(self, farthest):
        """Return how far points go, m; farthest: m, the parameter points_max_depth."""
        limit = self.focal * self.baseline * TOLD_APART if farthest < 0 else farthest
        return limit if limit > 0 else math.inf     # NaN and 0: without a baseline, or a limit

    def points(self, disparity):
        """Return the points of disparities of the left image, as `Projection.points`."""
        return self.left.points(self.depth(disparity))

    def cut(self, first_row, first_column):
        """Return the calibration after both images are cut above a row and left of a column."""
        left = self.left._replace(cx=self.left.cx - first_column, cy=self.left.cy - first_row)
        return replace(self, left=left)

    def scaled(self, scale):
        """Return the calibration of both images averaged over blocks of 1 / scale pixels."""
        fx, fy, cx, cy = self.left
        # The origin is the centre of the first pixel, half a pixel inside the image.
        left = Projection(fx * scale, fy * scale,
                          (cx + 0.5) * scale - 0.5, (cy + 0.5) * scale - 0.5)
        return replace(self, focal=self.focal * scale, offset=self.offset * scale, left=left)


# Of rectified cameras of which nothing is known: without metres, and without a moving camera.
UNCALIBRATED = Calibration(0.0, 0.0, 0.0, Projection(0.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class StereoPair:
    """Two rectified images taken at the same time, of one size and dtype, contiguous."""

    left: np.ndarray                # uint8 or uint16, (R, C) or (R, C, 3) BGR
    right: np.ndarray
    calibration: Calibration
    stamp: int                      # ns
    frame_id: str = ''              # of the left camera
    missing: tuple | None = None    # bool (R, C) of both: the pixel lies outside the raw image


def takes_part(disparity, missing, matched=True, reference='left'):
    """
    Return where missing pixels take part: bool (R, C), of a map of the reference image.

    disparity: float32 (R, C), px, NaN = invalid; missing: as in a StereoPair; matched: bool
    (R, C), where a disparity is of a match, not filled; True for all
    """
    (own, other), sign = (missing, -1) if reference == 'left' else (missing[::-1], 1)
    columns, matched = np.arange(own.shape[1]), matched & np.isfinite(disparity)
    partners = columns + sign * np.rint(np.where(matched, disparity, 0)).astype(np.intp)
    return own | (matched & np.take_along_axis(
        other, np.clip(partners, 0, columns[-1]), axis=1))
