# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A camera with a real lens, a little turned: how it sees points, in plain NumPy."""
from dataclasses import dataclass
from functools import cache

import cv2
from made_messages import info
import numpy as np

ROWS, COLUMNS = 240, 320
LENSES = {
    'plumb_bob': [-0.25, 0.08, 0.001, -0.0005, 0.01],
    'rational_polynomial': [0.3, -0.05, 0.0004, 0.001, 0.02, 0.55, 0.02, 0.01],
    'equidistant': [0.05, -0.02, 0.003, -0.001],
    '': [],
    'fisheye': []}     # of angles proportional to radii
FOCAL, CENTRE = 290.0, (161.0, 118.0)      # of the rectified images


@dataclass(frozen=True)
class RawCamera:
    """
    One camera of a rig: lens, rotation as in CameraInfo, and its place to the right, in metres.

    Points and rays are arrays (3, ...), in the frame of the rectified left camera.
    """

    model: str = 'plumb_bob'
    turn: tuple = (0.0, 0.0, 0.0)
    right: float = 0.0
    focal: tuple = (300.0, 305.0)
    centre: tuple = (155.0, 122.0)

    @property
    def rotation(self):
        """Return R of the camera's CameraInfo."""
        return cv2.Rodrigues(np.array(self.turn))[0]

    def info(self, **changes):
        (fx, fy), (cx, cy) = self.focal, self.centre
        return info(**{
            'height': ROWS, 'width': COLUMNS, 'distortion_model': self.model,
            'd': LENSES[self.model], 'k': [fx, 0, cx, 0, fy, cy, 0, 0, 1],
            'r': list(self.rotation.ravel()),
            'p': [FOCAL, 0, CENTRE[0], -FOCAL * self.right, 0, FOCAL, CENTRE[1], 0, 0, 0, 1, 0],
            **changes})

    def sees(self, points):
        """Return x and y in the raw image of points."""
        place = np.reshape([self.right, 0, 0], (3,) + (1,) * (points.ndim - 1))
        turned = np.tensordot(self.rotation.T, points - place, 1)
        x, y = _bent(self.model, turned[0] / turned[2], turned[1] / turned[2])
        return self.focal[0] * x + self.centre[0], self.focal[1] * y + self.centre[1]

    def raw(self, image):
        """Return what the camera would see of a rectified image (R, C) or (R, C, 3)."""
        return cv2.remap(image, *_sources(self), cv2.INTER_LANCZOS4)


@cache
def _sources(camera):
    """Return the column and row of a rectified image that each raw pixel shows: float32 (R, C)."""
    down, across = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    goal = ((across - camera.centre[0]) / camera.focal[0],
            (down - camera.centre[1]) / camera.focal[1])
    x, y = goal
    for _ in range(20):
        bent = _bent(camera.model, x, y)
        x, y = x + goal[0] - bent[0], y + goal[1] - bent[1]
    assert np.abs(np.array(_bent(camera.model, x, y)) - goal).max() < 1e-9
    x, y, z = np.tensordot(camera.rotation, np.stack([x, y, np.ones_like(x)]), 1)
    return ((FOCAL * x / z + CENTRE[0]).astype(np.float32),
            (FOCAL * y / z + CENTRE[1]).astype(np.float32))


def _bent(model, x, y):
    """Return where a lens shows a point that an ideal one shows at x, y; the focal length is 1."""
    square = x**2 + y**2
    if model in ('equidistant', 'fisheye'):
        radius = np.sqrt(square)
        angle = np.arctan(radius)
        bent = angle * (1 + sum(k * angle**(2 * power + 2)
                                for power, k in enumerate(LENSES[model])))
        ratio = np.divide(bent, radius, out=np.ones_like(radius), where=radius > 0)
        return x * ratio, y * ratio
    k1, k2, p1, p2, k3, k4, k5, k6 = (LENSES[model] + [0.0] * 8)[:8]
    ratio = ((1 + k1 * square + k2 * square**2 + k3 * square**3)
             / (1 + k4 * square + k5 * square**2 + k6 * square**3))
    return (x * ratio + 2 * p1 * x * y + p2 * (square + 2 * x**2),
            y * ratio + p1 * (square + 2 * y**2) + 2 * p2 * x * y)
