# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Made stereo scenes with exact ground truth: slanted textured planes before a slanted background.

A surface is a plane of disparity d = a + b x + c y over left image coordinates, cut out by a
shape. A right pixel x_r shows the left coordinate x = (x_r + a + c y) / (1 - b), so that both
images are drawn directly and disparity and occlusion are known without any rounding. Only the
textures are read to 1/32 px, the step of OpenCV's remap.
"""
from typing import NamedTuple

import cv2
import numpy as np

SHAPES = ('pole', 'ellipse', 'box')


class MadePair(NamedTuple):
    """
    One made pair, left-referenced.

    left, right: uint8 or uint16 (R, C), or (R, C, 3) BGR.
    truth: float32 (R, C), pixels, valid everywhere.
    visible: bool (R, C), true where the right image shows the same point.
    """

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray
    visible: np.ndarray


class _Surface(NamedTuple):
    """A plane over world coordinates: disparity and gradient at its centre, shape, velocity."""

    shape: str
    centre: tuple  # x, y in pixels at frame 0
    half: tuple  # half width and half height in pixels
    tilt: float  # slope of the shape's own axis, dx per dy
    disparity: float
    slope: tuple  # b, c: change of disparity per pixel in x and in y
    velocity: tuple  # pixels per frame in x and y
    texture: np.ndarray


def made_pair(rows, columns, disparities, seed=0, **options):
    """
    Return one `MadePair`; the options are those of `made_sequence`.

    Raises ValueError for a size or a number of disparities that cannot be made.
    """
    return next(made_sequence(rows, columns, disparities, 1, seed, **options))


def made_sequence(rows, columns, disparities, frames, seed=0, *, min_disparity=0, objects=4,
                  pan=0.0, motion=0.0, noise=0.0, exposure=1.0, flicker=0.0, contrast=1.0,
                  colour=False, bits=8):
    """
    Return an iterator over `frames` pairs of one scene; the same arguments give the same bits.

    The true disparities lie between min_disparity and min_disparity + disparities - 1.
    objects: how many planes stand before the background; of three, one is a thin pole.
    pan: pixels per frame by which the whole scene moves to the left (to the right if negative).
    motion: largest speed of an object of its own, pixels per frame, in x and in y.
    noise: standard deviation of the sensor noise, in 8-bit grey levels, fresh in every image.
    exposure: gain of the right image relative to the left one.
    flicker: relative amplitude of a gain of both images that swings with a period of 8 frames.
    contrast: of the textures; 1 is a standard deviation of about 30 grey levels of 8 bits.
    colour: BGR instead of grey.
    bits: 8 gives uint8; 9 to 16 give uint16 that fills the low bits.

    Raises ValueError for a size, a count or a number of bits that cannot be made.
    """
    if rows < 1 or columns < 1 or frames < 1:
        raise ValueError(f'rows, columns and frames are {rows}, {columns} and {frames}; '
                         'each must be at least 1')
    if not 1 <= disparities <= columns:
        raise ValueError(f'disparities is {disparities}; allowed are 1 to the {columns} columns')
    if not 8 <= bits <= 16:
        raise ValueError(f'bits is {bits}; allowed are 8 to 16')
    chance = np.random.default_rng([seed, 0])
    world = (min(0.0, pan * (frames - 1)), columns + max(0.0, pan * (frames - 1)))
    reach = max(abs(min_disparity), abs(min_disparity + disparities - 1))
    surfaces = [_background(chance, rows, (world[0] - reach, world[1] + reach),
                            min_disparity, disparities, contrast, colour)]
    surfaces += [_object(chance, SHAPES[index % 3], rows, columns, world,
                         min_disparity, disparities, motion, contrast, colour)
                 for index in range(objects)]
    return (_draw(surfaces, rows, columns, frame, pan, world,
                  np.random.default_rng([seed, 1, frame]), noise,
                  1.0 + flicker * np.sin(2 * np.pi * frame / 8), exposure, bits)
            for frame in range(frames))


def _background(chance, rows, reach, min_disparity, disparities, contrast, colour):
    """Return the plane behind everything: the lowest 40 % of the range, slanted over all of it."""
    half = ((reach[1] - reach[0]) / 2, rows / 2)
    spread = 0.4 * (disparities - 1) / 2
    share = chance.uniform(0.3, 0.7)
    slope = (chance.choice((-1, 1)) * share * spread / half[0],
             chance.choice((-1, 1)) * (1 - share) * spread / half[1])
    return _Surface('background', ((reach[0] + reach[1]) / 2, (rows - 1) / 2), half, 0.0,
                    min_disparity + spread, slope, (0.0, 0.0),
                    _texture(chance, half, contrast, colour))


def _object(chance, shape, rows, columns, world, min_disparity, disparities, motion, contrast,
            colour):
    """Return a plane of the given shape in the highest 60 % of the range."""
    half = {'pole': (max(1.5, 0.006 * columns), 0.45 * rows),
            'ellipse': (chance.uniform(0.08, 0.2) * columns, chance.uniform(0.12, 0.3) * rows),
            'box': (chance.uniform(0.08, 0.2) * columns, chance.uniform(0.12, 0.3) * rows)}[shape]
    slack = 0.1 * (disparities - 1)
    low, high = min_disparity + 0.4 * (disparities - 1), min_disparity + disparities - 1
    tilt = chance.uniform(-0.15, 0.15)
    extent = half[0] + abs(tilt) * half[1]
    share = chance.uniform(0.2, 0.8)
    slope = (chance.choice((-1, 1)) * min(0.2, share * slack / extent),
             chance.choice((-1, 1)) * (1 - share) * slack / half[1])
    return _Surface(shape, (chance.uniform(*world), chance.uniform(0.2, 0.8) * rows), half, tilt,
                    chance.uniform(low + slack, high - slack), slope,
                    tuple(chance.uniform(-motion, motion, 2)),
                    _texture(chance, (extent, half[1]), contrast, colour))


def _texture(chance, half, contrast, colour):
    """Return noise of five octaves, float32 (2 half + margin, 3 or 1), in 8-bit grey levels."""
    width, height = (int(np.ceil(2 * side)) + 16 for side in half)
    channels = 3 if colour else 1
    total = np.zeros((height, width, channels), np.float32)
    for octave in range(1, 6):
        coarse = chance.standard_normal(
            (height // 2**octave + 2, width // 2**octave + 2, channels), np.float32)
        fine = cv2.resize(coarse, None, fx=2**octave, fy=2**octave,
                          interpolation=cv2.INTER_CUBIC)
        total += fine.reshape(*fine.shape[:2], channels)[:height, :width]
    return chance.uniform(70, 180, channels).astype(np.float32) + 15 * contrast * total


def _draw(surfaces, rows, columns, frame, pan, world, chance, noise, gain, exposure, bits):
    """Return the `MadePair` of one frame."""
    y, x = np.mgrid[0:rows, 0:columns].astype(np.float64)
    x += pan * frame
    placed = [_place(surface, frame, world, rows) for surface in surfaces]
    left, truth = _view(placed, x, y, by_left=True)
    right, _ = _view(placed, x, y, by_left=False)
    nearest = _nearest(placed, x - truth, y)
    inside = (x - truth >= pan * frame) & (x - truth <= pan * frame + columns - 1)
    visible = inside & (nearest <= truth + 1e-6)
    top, depth = 2**bits - 1, np.uint8 if bits == 8 else np.uint16

    def expose(image, factor):
        image = factor * image + noise * chance.standard_normal(image.shape, np.float32)
        image = np.clip(np.rint(image * (top / 255)), 0, top).astype(depth)
        return image[:, :, 0] if image.shape[2] == 1 else image

    return MadePair(expose(left, gain), expose(right, gain * exposure),
                    truth.astype(np.float32), visible)


def _place(surface, frame, world, rows):
    """Return the surface moved to where it is in a frame; it turns round at the borders."""
    def turn(start, speed, low, high):
        length = max(high - low, 1.0)
        phase = (start - low + speed * frame) % (2 * length)
        return low + min(phase, 2 * length - phase)

    if surface.velocity == (0.0, 0.0):
        return surface
    return surface._replace(centre=(turn(surface.centre[0], surface.velocity[0], *world),
                                    turn(surface.centre[1], surface.velocity[1], 0, rows - 1)))


def _meet(surface, x, y, by_left):
    """
    Return left x, disparity and presence of a surface where the left or right image looks.

    x, y: float64 (R, C), coordinates in the image that looks; three arrays (R, C) come out.
    """
    down = surface.disparity + surface.slope[1] * (y - surface.centre[1])
    if not by_left:
        x = (x + down - surface.slope[0] * surface.centre[0]) / (1 - surface.slope[0])
    disparity = down + surface.slope[0] * (x - surface.centre[0])
    across = (x - surface.centre[0] - surface.tilt * (y - surface.centre[1])) / surface.half[0]
    along = (y - surface.centre[1]) / surface.half[1]
    if surface.shape == 'background':
        return x, disparity, np.ones(x.shape, bool)
    if surface.shape == 'ellipse':
        return x, disparity, across**2 + along**2 <= 1
    return x, disparity, (abs(across) <= 1) & (abs(along) <= 1)


def _nearest(surfaces, x, y):
    """Return the largest disparity that the right image meets at x, y: float64 (R, C)."""
    met = [_meet(surface, x, y, by_left=False) for surface in surfaces]
    return np.max([np.where(there, disparity, -np.inf) for _, disparity, there in met], axis=0)


def _view(surfaces, x, y, by_left):
    """Return image float32 (R, C, 1 or 3) and disparity float64 (R, C) of one camera."""
    image = np.zeros((*x.shape, surfaces[0].texture.shape[2]), np.float32)
    nearest = np.full(x.shape, -np.inf)
    for surface in surfaces:
        left_x, disparity, there = _meet(surface, x, y, by_left)
        seen = there & (disparity > nearest)
        height, width = surface.texture.shape[:2]
        colours = cv2.remap(surface.texture,
                            (left_x - surface.centre[0] + width / 2).astype(np.float32),
                            (y - surface.centre[1] + height / 2).astype(np.float32),
                            cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
        image[seen] = colours.reshape(image.shape)[seen]
        nearest[seen] = disparity[seen]
    return image, nearest
