# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What matching one pair takes besides its images, a camera, and what it gives."""
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

MIRROR = np.diag((-1.0, 1.0, 1.0))
ASIDE = np.array((1.0, 0.0, 0.0))       # from the left camera to the right one, baselines


class Camera(NamedTuple):
    """
    The left camera of a rectified pair, px: u = fx X / Z + cx, v = fy Y / Z + cy.

    offset: cx of the left image minus that of the right one; Z is fx * baseline over the
    disparity less the offset
    moved: rotation (3, 3) and shift (3,), baselines, P' = rotation @ P + shift of a point from the
    last frame to this one, where that is known; None: the images tell
    """

    fx: float
    fy: float
    cx: float
    cy: float
    offset: float = 0.0
    moved: tuple | None = None

    def mirrored_right(self, columns):
        """Return the right camera as the left one of the mirrored pair, of so many columns."""
        moved = self.moved
        if moved is not None:
            rotation, shift = moved
            moved = MIRROR @ rotation @ MIRROR, MIRROR @ (rotation @ ASIDE + shift - ASIDE)
        return self._replace(cx=columns - 1 - (self.cx - self.offset), moved=moved)


@dataclass(frozen=True)
class Match:
    """
    The result of matching one pair.

    disparity: float32 (R, C), pixels of the reference image, NaN = invalid.
    confidence: float32 (R, C), 0 to 1, from possibility; 0 where inconsistent or filled.
    history: a `Generation` for each that ran; times: milliseconds by stage, and `total`.
    warm: whether the previous best took part: as a prior, or as a parent.
    motion: how the camera moved, or why that is not known; '' where no camera was given.
    generations: how many ran; gains: by how much each operator raised the fitness.
    """

    disparity: np.ndarray
    confidence: np.ndarray
    history: list
    times: dict
    warm: bool
    motion: str = ''

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
