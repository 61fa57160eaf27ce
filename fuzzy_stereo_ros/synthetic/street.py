# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A made street with exact truth, and two cameras that drive through it and turn.

Textured planes in metres: the road, a wall on each side and one at the end, and upright objects
beside the way. A ray meets a plane exactly, so that disparity and occlusion are known without any
rounding. Textures are sums of noise of doubling grain; grain finer than a pixel is left out.
"""
from typing import NamedTuple

import cv2
import numpy as np

SHAPES = 'box', 'ellipse'
NEAREST = 0.75      # of the disparities, what the road and the objects come to where a view ends
SIDE_WALL = 2.2     # distance of a side wall from the way, in least clearances of an object
WALL_HEIGHT = 6.0   # in heights of the cameras
DISTANT = 9.0       # distance of the wall at the end, in distances of the nearest road seen
PERIOD = 24, 17, 20, 14, 11     # frames of a swing: yaw, pitch, roll, sideways, up and down
SWINGS = 0.012, 0.02, 0.06, 0.04    # pitch, roll in radians; sideways, up in camera heights
GRAIN, OCTAVES = 256, 9     # cells of a side of a layer of noise, after which it repeats; layers
FINEST = 2.5        # pixels of the nearest road that a cell of the finest layer has
STRENGTH = 15       # grey levels of 8 bits, standard deviation of each layer's cells


class Plane(NamedTuple):
    """A rectangle or an ellipse, in metres; x to the right, y down, z ahead at the first frame."""

    shape: str
    centre: np.ndarray      # (3,), at the first frame
    axes: np.ndarray        # (2, 3), unit vectors in the plane, orthogonal
    half: tuple             # extents along the axes
    velocity: np.ndarray    # (3,), metres a frame
    layers: np.ndarray      # float32 (OCTAVES, GRAIN + margin, GRAIN + margin, 3 or 1)
    mean: np.ndarray        # (3 or 1,), grey levels
    grain: float            # metres of a cell of the finest layer


class Rig(NamedTuple):
    """Two cameras: focal length and centre in pixels, baseline and height above the road in m."""

    rows: int
    columns: int
    focal: float
    baseline: float
    height: float

    @property
    def centre(self):
        """Column and row of the principal point."""
        return (self.columns - 1) / 2, (self.rows - 1) / 2


def rig_of(rows, columns, disparities, focal, baseline):
    """Return the `Rig` whose nearest road has NEAREST of the disparities; focal: px."""
    return Rig(rows, columns, focal, baseline,
               baseline * rows / 2 / (NEAREST * max(disparities - 1, 1)))


def pose(rig, frame, drive, pan):
    """
    Return where the left camera is and looks in a frame: rotation (3, 3) and position (3,).

    X_camera = rotation @ (X - position). drive: metres ahead in each frame; pan: px by which it
    turns to the right in a frame at the most.
    """
    swings = np.sin(2 * np.pi * frame / np.array(PERIOD))
    yaw = pan / rig.focal * PERIOD[0] / (2 * np.pi) * swings[0]
    pitch, roll, aside, up = swings[1:] * SWINGS
    turned = np.eye(3)
    for angle, one, other in ((yaw, 0, 2), (pitch, 1, 2), (roll, 0, 1)):
        turn = np.eye(3)
        turn[one, one] = turn[other, other] = np.cos(angle)
        turn[one, other], turn[other, one] = -np.sin(angle), np.sin(angle)
        turned = turn @ turned
    return turned, np.array([aside * rig.height, up * rig.height, drive * frame])


def street(rig, disparities, frames, seed, options):
    """
    Return the planes of a street that is as long as the drive.

    options: `SceneOptions`; objects stand upright beside the way, motion is their largest speed,
    px a frame where they are seen first.
    """
    random = np.random.default_rng([seed, 4])
    nearest = 2 * rig.focal * rig.height / rig.rows     # m, where the road is seen first
    grain = FINEST * nearest / rig.focal
    clearance = rig.baseline * rig.columns / 2 / (NEAREST * max(disparities - 1, 1))
    end = DISTANT * nearest + options.drive * (frames - 1)
    wall = SIDE_WALL * clearance
    x, y, z = np.eye(3)

    def plane(shape, centre, axes, half, velocity=(0.0, 0.0, 0.0)):
        channels = 3 if options.colour else 1
        layers = random.standard_normal((OCTAVES, GRAIN, GRAIN, channels), np.float32)
        layers = np.pad(STRENGTH * options.contrast * layers,
                        ((0, 0), (2, 3), (2, 3), (0, 0)), 'wrap')
        return Plane(shape, np.array(centre), np.array(axes), half, np.array(velocity), layers,
                     random.uniform(70, 180, channels), grain)

    def standing_object(number):
        side = random.choice((-1, 1))
        half = random.uniform(0.15, 0.35) * wall, random.uniform(0.4, 0.9) * rig.height
        inner = clearance + half[0]
        turn = random.uniform(-0.6, 0.6)
        where = (side * random.uniform(inner, max(inner, wall - half[0])),
                 rig.height - half[1], random.uniform(1.2 * nearest, 0.8 * end))
        speed = random.uniform(-options.motion, options.motion) * where[2] / rig.focal
        return plane(SHAPES[number % 2], where, (np.cos(turn) * x + np.sin(turn) * z, y), half,
                     (0.0, 0.0, speed))

    far = 2 * end
    surfaces = [plane('box', (0, rig.height, 0), (x, z), (far, far)),
                plane('box', (0, 0, end), (x, y), (far, far))]
    surfaces += [plane('box', (side * wall, rig.height * (1 - WALL_HEIGHT / 2), 0), (z, y),
                       (far, WALL_HEIGHT / 2 * rig.height)) for side in (-1, 1)]
    return surfaces + [standing_object(number) for number in range(options.objects)]


def look(rig, surfaces, frame, seen_from, x, y, by_left):
    """
    Return what a camera sees at x, y, float64 (R, C), px: image, and disparity.

    seen_from: what `pose` returned. image: float32 (R, C, 3 or 1), grey levels of 8 bits;
    disparity: float64 (R, C), px, of the nearest surface.
    """
    turned, position = seen_from
    position = position if by_left else position + turned.T @ (rig.baseline, 0.0, 0.0)
    column, row = rig.centre
    rays = np.stack([(x - column) / rig.focal, (y - row) / rig.focal, np.ones_like(x)], -1)
    rays = rays @ turned        # of length 1 along the axis of the camera
    disparity = np.zeros(x.shape)
    image = np.zeros((*x.shape, surfaces[0].mean.size), np.float32)
    for surface in surfaces:
        along, there, nearer = _meet(surface, frame, position, rays)
        nearer = rig.focal * rig.baseline * nearer
        seen = there & (nearer > disparity)
        disparity[seen] = nearer[seen]
        image[seen] = _texture(surface, along, seen)
    return image, disparity


def _meet(surface, frame, position, rays):
    """Return where rays meet a plane, m along its axes, (R, C, 2); whether; and 1 / distance."""
    normal = np.cross(*surface.axes)
    away = surface.centre + frame * surface.velocity - position
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        nearness = rays @ normal / (away @ normal)
        points = rays / nearness[..., None] - away
        along = points @ surface.axes.T
        share = along / surface.half
        inside = (share**2).sum(-1) <= 1 if surface.shape == 'ellipse' else (
            abs(share) <= 1).all(-1)
    return along, (nearness > 0) & inside, nearness


def _texture(surface, along, seen):
    """Return the grey of the points that are seen: float32 (n, 3 or 1)."""
    steps = [np.hypot(*(np.gradient(along[..., axis], axis=side) for side in (0, 1)))
             if min(along.shape[:2]) > 1 else np.zeros(along.shape[:2]) for axis in (0, 1)]
    pixel = np.maximum(*steps)[seen]    # m
    total = np.zeros((pixel.size, surface.mean.size), np.float32) + surface.mean
    for octave, layer in enumerate(surface.layers):
        cell = surface.grain * 2**octave
        share = np.clip(cell / np.maximum(pixel, 1e-9) - 1, 0, 1)
        places = (along[seen] / cell % GRAIN + 2).astype(np.float32)
        # OpenCV's remap takes at most 32767 rows or columns
        for first in range(0, pixel.size, 32000):
            part = slice(first, first + 32000)
            grey = cv2.remap(layer, places[None, part, 0], places[None, part, 1],
                             cv2.INTER_CUBIC)
            total[part] += share[part, None] * grey.reshape(-1, total.shape[1])
    return total.astype(np.float32)
