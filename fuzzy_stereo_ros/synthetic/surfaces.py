# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The surfaces of a synthetic scene: textured planes of several shapes, and their projections.

A surface is a plane of disparity d = a + b x + c y over left image coordinates. A right pixel x_r
shows the left coordinate x = (x_r + a + c y) / (1 - b). So both images are drawn directly, and
disparity and occlusion are computed without rounding.
"""
from typing import NamedTuple

import cv2
import numpy as np

SHAPES = ('pole', 'ellipse', 'box')
STEEPEST = 0.2      # largest change of disparity per pixel in x; at 1 the right image has no width
THIN = 0.5, 1.5     # smallest and largest half width of a thin pole, px


class Surface(NamedTuple):
    """A plane over world coordinates: disparity and gradient at its centre, shape, velocity."""

    shape: str
    centre: tuple  # x, y in pixels at frame 0
    half: tuple  # half width and half height in pixels
    tilt: float  # slope of the shape's own axis, dx per dy
    disparity: float
    slope: tuple  # b, c: change of disparity per pixel in x and in y
    velocity: tuple  # pixels per frame in x and y
    texture: np.ndarray


class World(NamedTuple):
    """The values that all surfaces of a scene share."""

    rows: int
    columns: int
    disparities: int
    span: tuple         # first and last x, px, that the left image shows in any frame
    options: tuple      # SceneOptions


def surfaces_of(world, seed):
    """Return the surfaces of a scene: background, objects, poles."""
    options = world.options
    random, random_of_thin = (np.random.default_rng([seed, word]) for word in (0, 2))
    return [background(random, world),
            *(standing_object(random, SHAPES[index % 3], world)
              for index in range(options.objects)),
            *(thin_pole(random_of_thin, world) for _ in range(options.poles))]


def background(random, world):
    """Return the plane behind all others, slanted over the lowest 40 % of the disparities."""
    last = world.options.min_disparity + world.disparities - 1
    reach = max(abs(world.options.min_disparity), abs(last))
    low, high = world.span[0] - reach, world.span[1] + reach
    half = ((high - low) / 2, world.rows / 2)
    spread = 0.4 * (world.disparities - 1) / 2
    share = random.uniform(0.3, 0.7)
    slope = (random.choice((-1, 1)) * share * spread / half[0],
             random.choice((-1, 1)) * (1 - share) * spread / half[1])
    return Surface('background', ((low + high) / 2, (world.rows - 1) / 2), half, 0.0,
                   world.options.min_disparity + spread, slope, (0.0, 0.0),
                   _texture(random, half, world))


def standing_object(random, shape, world):
    """Return a plane of one of the SHAPES in the highest 60 % of the disparities."""
    rows, columns = world.rows, world.columns
    half = {'pole': (max(1.5, 0.006 * columns), 0.45 * rows),
            'ellipse': (random.uniform(0.08, 0.2) * columns, random.uniform(0.12, 0.3) * rows),
            'box': (random.uniform(0.08, 0.2) * columns, random.uniform(0.12, 0.3) * rows)}[shape]
    return _upright(random, shape, half, world)


def thin_pole(random, world):
    """Return a pole of 1 to 3 pixels in the highest 60 % of the disparities."""
    return _upright(random, 'pole', (random.uniform(*THIN), 0.45 * world.rows), world)


def _upright(random, shape, half, world):
    """Return a plane of a shape and size at a random position."""
    slack = 0.1 * (world.disparities - 1)
    low = world.options.min_disparity + 0.4 * (world.disparities - 1)
    high = world.options.min_disparity + world.disparities - 1
    tilt = random.uniform(-0.15, 0.15)
    extent = half[0] + abs(tilt) * half[1]
    share = random.uniform(0.2, 0.8)
    slope = (random.choice((-1, 1)) * min(STEEPEST, share * slack / extent),
             random.choice((-1, 1)) * (1 - share) * slack / half[1])
    return Surface(shape, (random.uniform(*world.span), random.uniform(0.2, 0.8) * world.rows),
                   half, tilt, random.uniform(low + slack, high - slack), slope,
                   tuple(random.uniform(-world.options.motion, world.options.motion, 2)),
                   _texture(random, (extent, half[1]), world))


def _texture(random, half, world):
    """Return noise of five octaves, float32 (2 half + margin, 3 or 1), in 8-bit grey levels."""
    width, height = (int(np.ceil(2 * side)) + 16 for side in half)
    channels = 3 if world.options.colour else 1
    total = np.zeros((height, width, channels), np.float32)
    for octave in range(1, 6):
        coarse = random.standard_normal(
            (height // 2**octave + 2, width // 2**octave + 2, channels), np.float32)
        fine = cv2.resize(coarse, None, fx=2**octave, fy=2**octave,
                          interpolation=cv2.INTER_CUBIC)
        total += fine.reshape(*fine.shape[:2], channels)[:height, :width]
    return (random.uniform(70, 180, channels).astype(np.float32)
            + 15 * world.options.contrast * total)


def place(surface, frame, world):
    """Return the surface at its position in a frame; its motion reverses at the borders."""
    def position(start, speed, low, high):
        length = max(high - low, 1.0)
        phase = (start - low + speed * frame) % (2 * length)
        return low + min(phase, 2 * length - phase)

    if surface.velocity == (0.0, 0.0):
        return surface
    return surface._replace(centre=(
        position(surface.centre[0], surface.velocity[0], *world.span),
        position(surface.centre[1], surface.velocity[1], 0, world.rows - 1)))


def meet(surface, x, y, by_left):
    """
    Return left x, disparity and presence of a surface at pixels of one image: three (R, C).

    x, y: float64 (R, C), coordinates in the left image if by_left, else in the right image.
    """
    down = surface.disparity + surface.slope[1] * (y - surface.centre[1])
    if not by_left:
        x = (x + down - surface.slope[0] * surface.centre[0]) / (1 - surface.slope[0])
    disparity = down + surface.slope[0] * (x - surface.centre[0])
    across = (x - surface.centre[0] - surface.tilt * (y - surface.centre[1])) / surface.half[0]
    along = (y - surface.centre[1]) / surface.half[1]
    return x, disparity, _is_inside(surface, across, along)


def _is_inside(surface, across, along):
    """Return which coordinates lie in a shape: bool (R, C); its box is -1 to 1 in both."""
    if surface.shape == 'background':
        return np.ones(across.shape, bool)
    if surface.shape == 'ellipse':
        return across**2 + along**2 <= 1
    return (abs(across) <= 1) & (abs(along) <= 1)
