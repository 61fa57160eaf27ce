# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The camera that took a pair, the result of matching it, and how it is shown in colours."""
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.row_offsets import Misalignment
import numpy as np

MIRROR = np.diag((-1.0, 1.0, 1.0))
BASELINE = np.array((1.0, 0.0, 0.0))    # from the left camera to the right one
# Of invalid pixels in pictures: grey levels of the stripes, which no colour map has, and width.
HATCH, STRIPE = (255, 150), 3


class Camera(NamedTuple):
    """
    The left camera of a rectified pair, px: u = fx X / Z + cx, v = fy Y / Z + cy.

    offset: cx of the left image minus that of the right one; Z is fx * baseline over the
    disparity less the offset
    moved: rotation (3, 3) and shift (3,), in baselines, of a point from the previous frame to this
    one, P' = rotation @ P + shift; None where it has to be estimated from the images
    """

    fx: float
    fy: float
    cx: float
    cy: float
    offset: float = 0.0
    moved: tuple | None = None

    def mirrored_right(self, columns):
        """Return the right camera as the left one of the mirrored pair, an image of `columns`."""
        moved = self.moved
        if moved is not None:
            rotation, shift = moved
            moved = MIRROR @ rotation @ MIRROR, (
                MIRROR @ (rotation @ BASELINE + shift - BASELINE))
        return self._replace(cx=columns - 1 - (self.cx - self.offset), moved=moved)


@dataclass(frozen=True)
class Match:
    """
    The result of matching one pair of R rows and C columns.

    disparity: float32 (R, C), pixels of the reference image, NaN = invalid.
    confidence: float32 (R, C), 0 to 1, from possibility; 0 where inconsistent or filled.
    history: a `Generation` for each that ran; times: milliseconds by stage, and `total`.
    warm: whether the previous frame was used: its chromosomes, as a prior or as a parent.
    motion: how the camera moved, or why that is unknown; '' where no camera was given.
    reused: whether it is the result of an earlier frame of a static scene.
    beyond: share of the matches, 0 to 1, that were rejected since they lie beyond the range:
    nearer than its largest disparity. 0 in the profile `paper`, which does not look there.
    needed_disparities: how many would include them, at least; 0 where it is not known.
    misalignment: by how much the rows of the pairs so far differ; None where it is unknown.
    generations: how many ran; gains: by how much each operator raised the fitness.
    """

    disparity: np.ndarray
    confidence: np.ndarray
    history: list
    times: dict
    warm: bool
    motion: str = ''
    reused: bool = False
    beyond: float = 0.0
    needed_disparities: int = 0
    misalignment: Misalignment | None = None

    def __repr__(self):
        """Return the size and the figures that tell most, in one line."""
        rows, columns = self.disparity.shape
        return (f'Match({columns}x{rows}, {100 * np.isfinite(self.disparity).mean():.1f} % valid, '
                f'mean confidence {self.confidence.mean():.2f}, '
                f"{self.times.get('total', 0.0):.1f} ms, {'warm' if self.warm else 'cold'})")

    def _repr_png_(self):
        """Return the bytes of a PNG for notebooks: the disparities in colours from end to end."""
        ends = self.disparity[np.isfinite(self.disparity)]
        low, high = (ends.min(), ends.max()) if ends.size else (0, 0)
        return cv2.imencode('.png', colour_disparity(self.disparity, low, high))[1].tobytes()

    def depth(self, camera):
        """Return depth by a Calibration: float32 (R, C), m, NaN = invalid, infinite = too far."""
        return camera.depth(self.disparity)

    def points(self, camera):
        """Return the points of all pixels of the left image: float32 (R, C, 3), see `depth`."""
        return camera.points(self.disparity)

    @property
    def generations(self):
        """How many generations ran."""
        return len(self.history)

    @property
    def gains(self):
        """By how much each operator raised the fitness of its population: {name: gain}."""
        gains = {}
        for generation in self.history:
            for name, gain in generation.gains.items():
                gains[name] = gains.get(name, 0.0) + gain
        return gains


def mirrored(image):
    """Return an image, (R, C) or (R, C, 3), mirrored left to right, contiguous."""
    return np.ascontiguousarray(image[:, ::-1])


def colour_disparity(disparity, low, high):
    """
    Return disparities in the colour map Turbo, far blue and near red: uint8 (R, C, 3) BGR.

    disparity: float (R, C), pixels, NaN or infinite = invalid, hatched in light grey.
    low, high: pixels, the disparities at the two ends of the colour map; others are clipped.
    """
    span = max(high - low, 1e-6)
    levels = cv2.convertScaleAbs(np.clip(disparity - low, 0, span), alpha=255 / span)
    picture = cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)
    invalid = ~np.isfinite(disparity)
    return cv2.copyTo(hatched(*invalid.shape), invalid.view(np.uint8), picture)


@lru_cache(2)
def hatched(rows, columns):
    """Return what stands for invalid pixels in pictures: grey stripes, uint8 (R, C, 3)."""
    stripes = np.add.outer(np.arange(rows), np.arange(columns)) // STRIPE % 2
    return np.repeat(np.take(np.array(HATCH, np.uint8), stripes)[:, :, None], 3, axis=2)
