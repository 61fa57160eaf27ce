# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a camera projects, as far as matching asks: in pixels, without metres."""
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
