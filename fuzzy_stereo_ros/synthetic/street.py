# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A synthetic street with exact ground truth, and two cameras that drive through it and turn.

The street consists of textured planes in metres: the road, a wall on each side and one at the
end, and upright objects beside the lane. Rays are intersected with planes exactly, so disparity
and occlusion are computed without rounding. A texture is a sum of noise octaves; octaves finer
than a pixel are left out.
"""
from typing import NamedTuple

import cv2
import numpy as np

SHAPES = 'box', 'ellipse'
NEAREST = 0.75      # share of the disparities that the road and objects reach at the image border
SIDE_WALL = 2.2     # distance of a side wall from the lane's centre, in least object distances
WALL_HEIGHT = 6.0   # in camera heights
DISTANT = 9.0       # distance of the wall at the end, in distances of the nearest visible road
PERIOD = 24, 17, 20, 14, 11     # frames of an oscillation: yaw, pitch, roll, sideways, up
SWINGS = 0.012, 0.02, 0.06, 0.04    # amplitudes: pitch, roll in radians; sideways, up in heights
GRAIN, OCTAVES = 256, 9     # cells along the side of a layer, which repeats; layers
LAYER_MARGIN = 2, 3  # cells before and after a layer
FINEST = 2.5        # size of a cell of the finest layer, in pixels of the nearest visible road
STRENGTH = 15       # grey levels of 8 bits, standard deviation of the cells of a layer


class Plane(NamedTuple):
    """A rectangle or ellipse in metres: x right, y down, z ahead, of the first frame's camera."""

    shape: str
    centre: np.ndarray      # (3,), at the first frame
    axes: np.ndarray        # (2, 3), unit vectors in the plane, orthogonal
    half: tuple             # half the extents along the axes
    velocity: np.ndarray    # (3,), metres per frame
    layers: np.ndarray      # float32 (OCTAVES, GRAIN + margin, GRAIN + margin, 3 or 1)
    mean: np.ndarray        # (3 or 1,), grey levels
    grain: float            # metres, size of a cell of the finest layer


class Rig(NamedTuple):
    """Two cameras: focal length in px, baseline and height above the road in metres."""

    rows: int
    columns: int
    focal: float
    baseline: float
    height: float


def rig_of(rows, columns, disparities, focal, baseline):
    """Return the `Rig` at the height that gives the nearest road NEAREST of the disparities."""
    return Rig(rows, columns, focal, baseline,
               baseline * rows / 2 / (NEAREST * max(disparities - 1, 1)))


def pose(rig, frame, drive, pan):
    """Return rotation and position of the left camera: X_camera = rotation @ (X - position)."""
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


def street(rig, options):
    """Return the Planes of a street as long as the drive; motion: speed of objects, px."""
    random = np.random.default_rng([options.seed, 4])
    nearest = 2 * rig.focal * rig.height / rig.rows     # m, distance of the nearest visible road
    grain = FINEST * nearest / rig.focal
    clearance = rig.baseline * rig.columns / 2 / (NEAREST * max(options.disparities - 1, 1))
    end = DISTANT * nearest + options.drive * (options.frames - 1)
    wall = SIDE_WALL * clearance
    x, y, z = np.eye(3)

    def plane(shape, centre, axes, half, velocity=(0.0, 0.0, 0.0)):
        channels = 3 if options.colour else 1
        layers = random.standard_normal((OCTAVES, GRAIN, GRAIN, channels), np.float32)
        layers = np.pad(STRENGTH * options.contrast * layers,
                        ((0, 0), LAYER_MARGIN, LAYER_MARGIN, (0, 0)), 'wrap')
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
    """Return image, float32 (R, C, 3 or 1), and disparity, float64 (R, C), px."""
    turned, position = seen_from
    position = position if by_left else position + turned.T @ (rig.baseline, 0.0, 0.0)
    column, row = (rig.columns - 1) / 2, (rig.rows - 1) / 2     # of the principal point
    rays = np.stack([(x - column) / rig.focal, (y - row) / rig.focal, np.ones_like(x)], -1)
    rays = rays @ turned        # of length 1 along the axis of the camera
    disparity = np.zeros(x.shape)
    image = np.zeros((*x.shape, surfaces[0].mean.size), np.float32)
    for surface in surfaces:
        along, inside, inverse_depth = _intersect(surface, frame, position, rays)
        new = rig.focal * rig.baseline * inverse_depth
        seen = inside & (new > disparity)
        disparity[seen] = new[seen]
        image[seen] = _texture(surface, along, seen)
    return image, disparity


def _intersect(surface, frame, position, rays):
    """Return intersections in m along a plane's axes (R, C, 2), whether inside, and 1 / depth."""
    normal = np.cross(*surface.axes)
    away = surface.centre + frame * surface.velocity - position
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        inverse_depth = rays @ normal / (away @ normal)
        points = rays / inverse_depth[..., None] - away
        along = points @ surface.axes.T
        share = along / surface.half
        inside = (share**2).sum(-1) <= 1 if surface.shape == 'ellipse' else (
            abs(share) <= 1).all(-1)
    return along, (inverse_depth > 0) & inside, inverse_depth


def _texture(surface, along, seen):
    steps = [np.hypot(*(np.gradient(along[..., axis], axis=side) for side in (0, 1)))
             if min(along.shape[:2]) > 1 else np.zeros(along.shape[:2]) for axis in (0, 1)]
    pixel = np.maximum(*steps)[seen]    # m
    total = np.zeros((pixel.size, surface.mean.size), np.float32) + surface.mean
    for octave, layer in enumerate(surface.layers):
        cell = surface.grain * 2**octave
        share = np.clip(cell / np.maximum(pixel, 1e-9) - 1, 0, 1)
        cells = (along[seen] / cell % GRAIN + LAYER_MARGIN[0]).astype(np.float32)
        # OpenCV's remap allows at most 32767 rows or columns.
        for first in range(0, pixel.size, 32000):
            part = slice(first, first + 32000)
            grey = cv2.remap(layer, cells[None, part, 0], cells[None, part, 1],
                             cv2.INTER_CUBIC)
            total[part] += share[part, None] * grey.reshape(-1, total.shape[1])
    return total.astype(np.float32)
