# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Synthetic stereo scenes with exact truth: slanted textured planes before a slanted background.

Disparity and occlusion are known without any rounding (see `surfaces.py`). Only the textures
are read to 1/32 px, the step of OpenCV's remap. Cameras that drive see a street: `street.py`.
"""
import inspect
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.parameters.table import Parameter
from fuzzy_stereo_ros.synthetic.street import look, pose, rig_of, street
from fuzzy_stereo_ros.synthetic.surfaces import (
    background, fence as made_fence, meet, place, SHAPES, standing_object, thin_pole, World)
import numpy as np

FOCAL = 0.9         # focal length in widths of the image
BASELINE = 0.12     # m
CAMERA = 'rate', 'offset'       # what made_sequence does not know
STANDING = 'min_disparity', 'poles', 'fence'    # what a street has not


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


def made_pair(rows, columns, disparities, seed=0, **options):
    """
    Return one `MadePair`; the options are those of `made_sequence`.

    Raises ValueError for a size or a number of disparities that cannot be made.
    """
    return next(made_sequence(rows, columns, disparities, 1, seed, **options))


def made_sequence(rows, columns, disparities, frames, seed=0, *, min_disparity=0, objects=4,
                  poles=0, fence=0, pan=0.0, drive=0.0, motion=0.0, noise=0.0, exposure=1.0,
                  flicker=0.0, contrast=1.0, colour=False, bits=8):
    """
    Return an iterator over `frames` pairs of one scene; the same arguments give the same bits.

    The true disparities lie between min_disparity and min_disparity + disparities - 1.
    objects: how many planes stand before the background; of three, one is a pole.
    poles: how many poles stand there besides, each 1 to 3 pixels wide.
    fence: of how many bars a fence is, each 2 pixels wide; it comes nearer from side to side.
    pan: pixels per frame by which the whole scene moves to the left (to the right if negative).
    drive: metres per frame by which the cameras drive ahead, through a street instead; they sway,
    tilt and roll on the way, and turn to both sides by pan pixels per frame at the most.
    motion: largest speed of an object or a pole, pixels per frame, in x and in y.
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
    gains = [1.0 + flicker * np.sin(2 * np.pi * frame / 8) for frame in range(frames)]

    def exposed(frame, left, right, truth, visible):
        chance = np.random.default_rng([seed, 1, frame])
        return MadePair(_expose(left, gains[frame], noise, chance, bits),
                        _expose(right, gains[frame] * exposure, noise, chance, bits),
                        truth.astype(np.float32), visible)

    if drive:
        for name, value in zip(STANDING, (min_disparity, poles, fence)):
            if value:
                raise ValueError(f'{name} is {value} and drive is {drive:g}; a street has no '
                                 f'{name}: give one of the two')
        rig = rig_of(rows, columns, disparities, FOCAL * columns, BASELINE)
        planes = street(rig, disparities, frames, drive, seed, objects=objects, motion=motion,
                        contrast=contrast, colour=colour)
        return (exposed(frame, *_drive_through(rig, planes, frame, pose(rig, frame, drive, pan)))
                for frame in range(frames))
    span = (min(0.0, pan * (frames - 1)), columns + max(0.0, pan * (frames - 1)))
    world = World(rows, columns, span, min_disparity, disparities, motion, contrast, colour)
    chance, chance_of_thin = (np.random.default_rng([seed, word]) for word in (0, 2))
    surfaces = [background(chance, world)]
    surfaces += [standing_object(chance, SHAPES[index % 3], world) for index in range(objects)]
    surfaces += [thin_pole(chance_of_thin, world) for _ in range(poles)]
    if fence:
        surfaces.append(made_fence(np.random.default_rng([seed, 3]), world, fence))
    return (exposed(frame, *_draw([place(surface, frame, world) for surface in surfaces], world,
                                  pan * frame)) for frame in range(frames))


def _of_the_scene(name, *facts, **more):
    """Return the row of an option of made_sequence, with the default that it has there."""
    return Parameter(name, inspect.signature(made_sequence).parameters[name].default, *facts,
                     **more)


SCENE_PARAMETERS = {row.name: row for row in (
    Parameter('columns', 640, 'width of the images', 1, 4096, 'px'),
    Parameter('rows', 480, 'height of the images', 1, 4096, 'px'),
    Parameter('disparities', 64, 'number of disparities that the scene has', 1, 4096, 'px'),
    _of_the_scene('min_disparity', 'smallest of them', -2048, 2048, 'px'),
    Parameter('frames', 12, 'number of pairs', 1, 100000),
    _of_the_scene('seed', 'another scene for every number', 0, 2**31 - 1),
    _of_the_scene('objects', 'slanted planes before a slanted background: of three, one is a '
                  'pole, one an ellipse, one a box', 0, 1000),
    _of_the_scene('poles', 'poles of 1 to 3 px besides', 0, 1000),
    _of_the_scene('fence', 'bars of a fence that comes nearer from side to side; 0 is no fence',
                  0, 1000),
    Parameter('pan', 2.0, 'by how much the cameras turn to the right in each frame', -1000.0,
              1000.0, 'px'),
    _of_the_scene('drive', 'how far the cameras drive ahead in each frame, through a street; they '
                  'turn to both sides by pan at the most, tilt and roll; 0 is the scene of planes',
                  0.0, 100.0, 'm'),
    _of_the_scene('motion', 'largest speed of objects and poles, in each frame', 0.0, 1000.0,
                  'px'),
    Parameter('noise', 2.0, 'standard deviation of the noise of the sensors', 0.0, 255.0,
              'grey levels of 8 bits'),
    _of_the_scene('exposure', 'gain of the right image relative to the left one', 0.01, 100.0),
    _of_the_scene('flicker', 'amplitude of a gain of both images that swings within 8 frames',
                  0.0, 1.0),
    _of_the_scene('contrast', 'of the textures, relative', 0.0, 10.0),
    _of_the_scene('colour', 'images in colour, not grey'),
    _of_the_scene('bits', 'of a grey level; above 8 the images have 16 and fill the low ones', 8,
                  16),
    Parameter('rate', 30.0, 'pairs a second', 0.1, 1000.0),
    Parameter('offset', 0.0, 'cx of the left camera minus that of the right one', -4096.0, 4096.0,
              'px'),
)}


def scene_pairs(values):
    """Return an iterator over each `MadePair`; ValueError where the scene cannot be made."""
    return made_sequence(**{name: value for name, value in values.items() if name not in CAMERA})


def scene_calibration(values):
    """Return the Calibration of the two cameras."""
    return centred_calibration(FOCAL * values['columns'], BASELINE, values['offset'],
                               values['rows'], values['columns'])


def _draw(surfaces, world, panned):
    """Return what a `MadePair` is made of; panned: pixels by which the cameras have moved."""
    y, x = np.mgrid[0:world.rows, 0:world.columns].astype(np.float64)
    x += panned
    left, truth = _view(surfaces, x, y, by_left=True)
    right, _ = _view(surfaces, x, y, by_left=False)
    nearest = _nearest(surfaces, x - truth, y)
    inside = (x - truth >= panned) & (x - truth <= panned + world.columns - 1)
    return left, right, truth, inside & (nearest <= truth + 1e-6)


def _drive_through(rig, planes, frame, seen_from):
    """Return the same of a street, seen from a pose."""
    y, x = np.mgrid[0:rig.rows, 0:rig.columns].astype(np.float64)
    left, truth = look(rig, planes, frame, seen_from, x, y, by_left=True)
    right, _ = look(rig, planes, frame, seen_from, x, y, by_left=False)
    _, nearest = look(rig, planes, frame, seen_from, x - truth, y, by_left=False)
    return left, right, truth, (x - truth >= 0) & (nearest <= truth + 1e-6)


def _expose(image, gain, noise, chance, bits):
    """Return an image of grey levels of 8 bits as a camera takes it: uint8 or uint16."""
    top, depth = 2**bits - 1, np.uint8 if bits == 8 else np.uint16
    image = gain * image + noise * chance.standard_normal(image.shape, np.float32)
    image = np.clip(np.rint(image * (top / 255)), 0, top).astype(depth)
    return image[:, :, 0] if image.shape[2] == 1 else image


def _nearest(surfaces, x, y):
    """Return the largest disparity that the right image meets at x, y: float64 (R, C)."""
    met = [meet(surface, x, y, by_left=False) for surface in surfaces]
    return np.max([np.where(there, disparity, -np.inf) for _, disparity, there in met], axis=0)


def _view(surfaces, x, y, by_left):
    """Return image float32 (R, C, 1 or 3) and disparity float64 (R, C) of one camera."""
    image = np.zeros((*x.shape, surfaces[0].texture.shape[2]), np.float32)
    nearest = np.full(x.shape, -np.inf)
    for surface in surfaces:
        left_x, disparity, there = meet(surface, x, y, by_left)
        seen = there & (disparity > nearest)
        height, width = surface.texture.shape[:2]
        colours = cv2.remap(surface.texture,
                            (left_x - surface.centre[0] + width / 2).astype(np.float32),
                            (y - surface.centre[1] + height / 2).astype(np.float32),
                            cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
        image[seen] = colours.reshape(image.shape)[seen]
        nearest[seen] = disparity[seen]
    return image, nearest


def misaligned(image, tilt=0.0, roll=0.0, zoom=0.0):
    """
    Return an image, uint8 or uint16 (R, C, ...), of a camera that has moved.

    tilt: px by which all comes to stand lower. roll: degrees by which it is turned clockwise
    about its middle. zoom: percent by which it is larger.
    """
    rows, columns = image.shape[:2]
    middle = np.array([(columns - 1) / 2, (rows - 1) / 2])
    angle = np.deg2rad(roll)
    turn = (1 + zoom / 100) * np.array([[np.cos(angle), -np.sin(angle)],
                                        [np.sin(angle), np.cos(angle)]])
    moved = np.column_stack([turn, middle + (0, tilt) - turn @ middle])
    return cv2.warpAffine(image, moved, (columns, rows), flags=cv2.INTER_CUBIC,
                          borderMode=cv2.BORDER_REFLECT_101)
