# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Synthetic stereo scenes with exact ground truth: slanted textured planes, or a street.

Disparity and occlusion are computed without rounding (see `surfaces.py`, and `street.py` for
cameras that drive). Only the textures are sampled at steps of 1/32 px, those of OpenCV's remap.
"""
from functools import partial
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.parameters.table import Parameter
from fuzzy_stereo_ros.synthetic.street import look, pose, rig_of, street
from fuzzy_stereo_ros.synthetic.surfaces import meet, place, surfaces_of, World
import numpy as np

FOCAL = 0.9         # focal length in widths of the image
BASELINE = 0.12     # m
CAMERA = 'rate', 'offset'       # parameters that are no options of make_sequence
NOT_IN_STREET = 'min_disparity', 'poles'     # options that need a scene of planes


class SceneOptions(NamedTuple):
    """The options of a scene and its images; SCENE_PARAMETERS has their meanings and units."""

    min_disparity: int = 0
    objects: int = 4
    poles: int = 0
    pan: float = 0.0
    drive: float = 0.0
    motion: float = 0.0
    noise: float = 0.0
    exposure: float = 1.0
    flicker: float = 0.0
    contrast: float = 1.0
    colour: bool = False
    bits: int = 8


class ScenePair(NamedTuple):
    """A synthetic pair with its ground truth."""

    left: np.ndarray        # uint8 or uint16 (R, C), or (R, C, 3) BGR
    right: np.ndarray
    truth: np.ndarray       # float32 (R, C), px, of the left image, valid everywhere
    visible: np.ndarray     # bool (R, C), where the right image shows the same point


def make_pair(rows, columns, disparities, seed=0, **options):
    """Return one `ScenePair`; options and errors: `make_sequence`."""
    return next(make_sequence(rows, columns, disparities, 1, seed, **options))


def make_sequence(rows, columns, disparities, frames, seed=0, **options):
    """
    Return an iterator over `frames` pairs of one scene; the same arguments give the same bits.

    options: fields of `SceneOptions`. The true disparities lie between min_disparity and
    min_disparity + disparities - 1. With pan the scene moves to the left. Raises
    ValueError for a size, a count or a number of bits that is not allowed.
    """
    options = SceneOptions(**options)
    if rows < 1 or columns < 1 or frames < 1:
        raise ValueError(f'rows, columns and frames are {rows}, {columns} and {frames}; '
                         'each must be at least 1')
    if not 1 <= disparities <= columns:
        raise ValueError(f'disparities is {disparities}; allowed are 1 to the {columns} columns')
    if not 8 <= options.bits <= 16:
        raise ValueError(f'bits is {options.bits}; allowed are 8 to 16')
    if options.drive:
        for name in NOT_IN_STREET:
            if getattr(options, name):
                raise ValueError(f'{name} is {getattr(options, name)} and drive is '
                                 f'{options.drive:g}; a street has no {name}: give one of the two')
        rig = rig_of(rows, columns, disparities, FOCAL * columns, BASELINE)
        return drive_through(rig, street(rig, disparities, frames, seed, options), frames, seed,
                             options)
    y, x = np.mgrid[0:rows, 0:columns].astype(np.float64)
    pan = options.pan
    span = (min(0.0, pan * (frames - 1)), columns + max(0.0, pan * (frames - 1)))
    world = World(rows, columns, disparities, span, options)
    surfaces = surfaces_of(world, seed)
    return (_pair(partial(_view, [place(surface, frame, world) for surface in surfaces]),
                  x + pan * frame, y, frame, seed, options) for frame in range(frames))


def drive_through(rig, planes, frames, seed, options):
    """Return an iterator over each `ScenePair` of a drive; planes: of `street`, which see."""
    y, x = np.mgrid[0:rig.rows, 0:rig.columns].astype(np.float64)
    return (_pair(partial(look, rig, planes, frame, pose(rig, frame, options.drive, options.pan)),
                  x, y, frame, seed, options) for frame in range(frames))


def _pair(view, x, y, frame, seed, options):
    """Return the `ScenePair` of a frame, exposed and noisy; view, x, y: of `_drawn`."""
    left, right, truth, visible = _drawn(view, x, y)
    random = np.random.default_rng([seed, 1, frame])
    gain = 1.0 + options.flicker * np.sin(2 * np.pi * frame / 8)
    return ScenePair(_expose(left, gain, options, random),
                     _expose(right, gain * options.exposure, options, random),
                     truth.astype(np.float32), visible)


def _scene_option(name, *facts, **more):
    """Return the Parameter of a field of SceneOptions, with the field's default."""
    return Parameter(name, SceneOptions._field_defaults[name], *facts, **more)


SCENE_PARAMETERS = {row.name: row for row in (
    Parameter('columns', 640, 'width of the images', 1, 4096, 'px'),
    Parameter('rows', 480, 'height of the images', 1, 4096, 'px'),
    Parameter('disparities', 64, 'number of disparities in the scene', 1, 4096, 'px'),
    _scene_option('min_disparity', 'smallest disparity in the scene', -2048, 2048, 'px'),
    Parameter('frames', 12, 'number of pairs', 1, 100000),
    Parameter('seed', 0, 'another scene for every number', 0, 2**31 - 1),
    _scene_option('objects', 'number of slanted planes before a slanted background: poles, '
                  'ellipses and boxes in turn', 0, 1000),
    _scene_option('poles', 'number of additional poles of 1 to 3 px', 0, 1000),
    Parameter('pan', 2.0, 'rotation of the cameras to the right in each frame', -1000.0, 1000.0,
              'px'),
    _scene_option('drive', 'distance that the cameras move ahead in each frame, through a street; '
                  'they turn to both sides by pan at most, tilt and roll; 0 is the planar scene',
                  0.0, 100.0, 'm'),
    _scene_option('motion', 'largest motion of objects and poles in each frame', 0.0, 1000.0,
                  'px'),
    Parameter('noise', 2.0, 'standard deviation of the noise of the sensors', 0.0, 255.0,
              'grey levels of 8 bits'),
    _scene_option('exposure', 'gain of the right image relative to the left one', 0.01, 100.0),
    _scene_option('flicker', 'amplitude of a gain of both images with a period of 8 frames', 0.0,
                  1.0),
    _scene_option('contrast', 'of the textures, relative', 0.0, 10.0),
    _scene_option('colour', 'images in colour instead of grey'),
    _scene_option('bits', 'of a grey level; above 8 the images have 16 bits and use the low ones',
                  8, 16),
    Parameter('rate', 30.0, 'pairs per second', 0.1, 1000.0),
    Parameter('offset', 0.0, 'cx of the left camera minus that of the right one', -4096.0, 4096.0,
              'px'),
)}


def scene_pairs(values):
    """Return an iterator over each `ScenePair`; ValueError if the scene is not allowed."""
    return make_sequence(**{name: value for name, value in values.items() if name not in CAMERA})


def scene_calibration(values):
    """Return the Calibration of the cameras of values by name."""
    return centred_calibration(FOCAL * values['columns'], BASELINE, values['offset'],
                               values['rows'], values['columns'])


def _drawn(view, x, y):
    """
    Return left image, right image, truth and visibility of a pair, before exposure.

    view(x, y, by_left): returns image and disparity of one camera at x, y, float64 (R, C), px.
    """
    left, truth = view(x, y, by_left=True)
    right, _ = view(x, y, by_left=False)
    _, nearest = view(x - truth, y, by_left=False)
    inside = (x - truth >= x[0, 0]) & (x - truth <= x[0, -1])
    return left, right, truth, inside & (nearest <= truth + 1e-6)


def _expose(image, gain, options, random):
    """Return the exposed and noisy image of grey levels of 8 bits: uint8 or uint16."""
    top, depth = 2**options.bits - 1, np.uint8 if options.bits == 8 else np.uint16
    image = gain * image + options.noise * random.standard_normal(image.shape, np.float32)
    image = np.clip(np.rint(image * (top / 255)), 0, top).astype(depth)
    return image[:, :, 0] if image.shape[2] == 1 else image


def _view(surfaces, x, y, by_left):
    """Return image float32 (R, C, 1 or 3) and disparity float64 (R, C) of one camera."""
    image = np.zeros((*x.shape, surfaces[0].texture.shape[2]), np.float32)
    nearest = np.full(x.shape, -np.inf)
    for surface in surfaces:
        left_x, disparity, inside = meet(surface, x, y, by_left)
        seen = inside & (disparity > nearest)
        height, width = surface.texture.shape[:2]
        colours = cv2.remap(surface.texture,
                            (left_x - surface.centre[0] + width / 2).astype(np.float32),
                            (y - surface.centre[1] + height / 2).astype(np.float32),
                            cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
        image[seen] = colours.reshape(image.shape)[seen]
        nearest[seen] = disparity[seen]
    return image, nearest
