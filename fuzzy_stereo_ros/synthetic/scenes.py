# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Synthetic stereo scenes with exact ground truth: slanted textured planes, or a street.

A surface is a plane of disparity d = a + b x + c y over left image coordinates. A right pixel x_r
shows the left coordinate x = (x_r + a + c y) / (1 - b). So both images are drawn directly, and
disparity and occlusion are computed without rounding (see `street.py` for cameras that drive).
Only the textures are sampled at steps of 1/32 px, those of OpenCV's remap.
"""
from collections import namedtuple
from functools import partial
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.parameters.table import Parameter
from fuzzy_stereo_ros.synthetic.street import look, pose, rig_of, street
import numpy as np

SHAPES = ('pole', 'ellipse', 'box')
STEEPEST = 0.2      # largest change of disparity per pixel in x; at 1 the right image has no width
THIN = 0.5, 1.5     # smallest and largest half width of a thin pole, px
FOCAL = 0.9         # focal length in widths of the image
BASELINE = 0.12     # m
NOT_IN_STREET = 'min_disparity', 'poles', 'offset'   # options that need a scene of planes
SCENE_PARAMETERS = {row.name: row for row in (
    Parameter('columns', 640, 'width of the images', 1, 4096, 'px'),
    Parameter('rows', 480, 'height of the images', 1, 4096, 'px'),
    Parameter('disparities', 64, 'number of disparities in the scene', 1, 4096, 'px'),
    Parameter('min_disparity', 0, 'smallest disparity in the scene', -2048, 2048, 'px'),
    Parameter('frames', 12, 'number of pairs', 1, 100000),
    Parameter('seed', 0, 'another scene for every number', 0, 2**31 - 1),
    Parameter('objects', 4, 'number of slanted planes before a slanted background: poles, '
              'ellipses and boxes in turn', 0, 1000),
    Parameter('poles', 0, 'number of additional poles of 1 to 3 px', 0, 1000),
    Parameter('pan', 2.0, 'rotation of the cameras to the right in each frame', -1000.0, 1000.0,
              'px'),
    Parameter('drive', 0.0, 'distance that the cameras move ahead in each frame, through a '
              'street; they turn to both sides by pan at most, tilt and roll; 0 is the planar '
              'scene', 0.0, 100.0, 'm'),
    Parameter('motion', 0.0, 'largest motion of objects and poles in each frame', 0.0, 1000.0,
              'px'),
    Parameter('noise', 2.0, 'standard deviation of the noise of the sensors', 0.0, 255.0,
              'grey levels of 8 bits'),
    Parameter('exposure', 1.0, 'gain of the right image relative to the left one', 0.01, 100.0),
    Parameter('flicker', 0.0, 'amplitude of a gain of both images with a period of 8 frames', 0.0,
              1.0),
    Parameter('contrast', 1.0, 'of the textures, relative', 0.0, 10.0),
    Parameter('colour', False, 'images in colour instead of grey'),
    Parameter('bits', 8, 'of a grey level; above 8 the images have 16 bits and use the low ones',
              8, 16),
    Parameter('rate', 30.0, 'pairs per second', 0.1, 1000.0),
    Parameter('offset', 0.0, 'cx of the left camera minus that of the right one', -4096.0, 4096.0,
              'px'),
)}
GIVEN = 'rows', 'columns', 'disparities', 'frames', 'seed'
# Of make_sequence, where nothing moves by itself and there is no noise.
USUAL = {name: row.default for name, row in SCENE_PARAMETERS.items()
         if name not in (*GIVEN, 'rate')} | {'pan': 0.0, 'noise': 0.0}
SceneOptions = namedtuple('SceneOptions', (*GIVEN, *USUAL), defaults=USUAL.values())


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
    options = SceneOptions(rows, columns, disparities, frames, seed, **options)
    for name, value in options._asdict().items():
        SCENE_PARAMETERS[name].checked(value)
    if disparities > columns:
        raise ValueError(f'disparities is {disparities}; allowed are 1 to the {columns} columns')
    if options.drive:
        for name in NOT_IN_STREET:
            if getattr(options, name):
                raise ValueError(f'{name} is {getattr(options, name)} and drive is '
                                 f'{options.drive:g}; a street has no {name}: give one of the two')
        rig = rig_of(rows, columns, disparities, FOCAL * columns, BASELINE)
        return drive_through(rig, street(rig, options), options)
    y, x = np.mgrid[0:rows, 0:columns].astype(np.float64)
    surfaces = surfaces_of(options)
    return (_pair(partial(_view, [place(surface, frame, options) for surface in surfaces]),
                  x + options.pan * frame, y, frame, options) for frame in range(frames))


def drive_through(rig, planes, options):
    """Return an iterator over each `ScenePair` of a drive; planes: of `street`, which see."""
    y, x = np.mgrid[0:rig.rows, 0:rig.columns].astype(np.float64)
    return (_pair(partial(look, rig, planes, frame, pose(rig, frame, options.drive, options.pan)),
                  x, y, frame, options) for frame in range(options.frames))


def _pair(view, x, y, frame, options):
    """Return the `ScenePair` of a frame; view(x, y, by_left): returns image and disparity."""
    left, truth = view(x, y, by_left=True)
    right, _ = view(x, y, by_left=False)
    _, nearest = view(x - truth, y, by_left=False)
    inside = (x - truth >= x[0, 0]) & (x - truth <= x[0, -1])
    random = np.random.default_rng([options.seed, 1, frame])
    gain = 1.0 + options.flicker * np.sin(2 * np.pi * frame / 8)
    return ScenePair(_expose(left, gain, options, random),
                     _expose(right, gain * options.exposure, options, random),
                     truth.astype(np.float32), inside & (nearest <= truth + 1e-6))


def scene_pairs(values):
    """Return an iterator over each `ScenePair`; ValueError if the scene is not allowed."""
    return make_sequence(**{name: value for name, value in values.items() if name != 'rate'})


def scene_calibration(values):
    """Return the Calibration of the cameras of values by name."""
    return centred_calibration(FOCAL * values['columns'], BASELINE, values['offset'],
                               values['rows'], values['columns'])


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


def span_of(options):
    """Return the first and last x, px, that the left image shows in any frame."""
    moved = options.pan * (options.frames - 1)
    return min(0.0, moved), options.columns + max(0.0, moved)


def surfaces_of(options):
    """Return the surfaces of a scene: background, objects, poles."""
    random, random_of_thin = (np.random.default_rng([options.seed, word]) for word in (0, 2))
    return [background(random, options),
            *(standing_object(random, SHAPES[index % 3], options)
              for index in range(options.objects)),
            *(_upright(random_of_thin, 'pole', (random_of_thin.uniform(*THIN),
                                                0.45 * options.rows), options)
              for _ in range(options.poles))]


def background(random, options):
    """Return the plane behind all others, slanted over the lowest 40 % of the disparities."""
    last = options.min_disparity + options.disparities - 1
    reach = max(abs(options.min_disparity), abs(last))
    first, end = span_of(options)
    low, high = first - reach, end + reach
    half = ((high - low) / 2, options.rows / 2)
    spread = 0.4 * (options.disparities - 1) / 2
    share = random.uniform(0.3, 0.7)
    slope = (random.choice((-1, 1)) * share * spread / half[0],
             random.choice((-1, 1)) * (1 - share) * spread / half[1])
    return Surface('background', ((low + high) / 2, (options.rows - 1) / 2), half, 0.0,
                   options.min_disparity + spread, slope, (0.0, 0.0),
                   _texture(random, half, options))


def standing_object(random, shape, options):
    """Return a plane of one of the SHAPES in the highest 60 % of the disparities."""
    rows, columns = options.rows, options.columns
    half = {'pole': (max(1.5, 0.006 * columns), 0.45 * rows),
            'ellipse': (random.uniform(0.08, 0.2) * columns, random.uniform(0.12, 0.3) * rows),
            'box': (random.uniform(0.08, 0.2) * columns, random.uniform(0.12, 0.3) * rows)}[shape]
    return _upright(random, shape, half, options)


def _upright(random, shape, half, options):
    slack = 0.1 * (options.disparities - 1)
    low = options.min_disparity + 0.4 * (options.disparities - 1)
    high = options.min_disparity + options.disparities - 1
    tilt = random.uniform(-0.15, 0.15)
    extent = half[0] + abs(tilt) * half[1]
    share = random.uniform(0.2, 0.8)
    slope = (random.choice((-1, 1)) * min(STEEPEST, share * slack / extent),
             random.choice((-1, 1)) * (1 - share) * slack / half[1])
    centre = random.uniform(*span_of(options)), random.uniform(0.2, 0.8) * options.rows
    return Surface(shape, centre, half, tilt, random.uniform(low + slack, high - slack),
                   slope, tuple(random.uniform(-options.motion, options.motion, 2)),
                   _texture(random, (extent, half[1]), options))


def _texture(random, half, options):
    """Return noise of five octaves, float32 (2 half + margin, 3 or 1), in 8-bit grey levels."""
    width, height = (int(np.ceil(2 * side)) + 16 for side in half)
    channels = 3 if options.colour else 1
    total = np.zeros((height, width, channels), np.float32)
    for octave in range(1, 6):
        coarse = random.standard_normal(
            (height // 2**octave + 2, width // 2**octave + 2, channels), np.float32)
        fine = cv2.resize(coarse, None, fx=2**octave, fy=2**octave,
                          interpolation=cv2.INTER_CUBIC)
        total += fine.reshape(*fine.shape[:2], channels)[:height, :width]
    return (random.uniform(70, 180, channels).astype(np.float32)
            + 15 * options.contrast * total)


def place(surface, frame, options):
    """Return the surface at its position in a frame; its motion reverses at the borders."""
    def position(start, speed, low, high):
        length = max(high - low, 1.0)
        phase = (start - low + speed * frame) % (2 * length)
        return low + min(phase, 2 * length - phase)

    if surface.velocity == (0.0, 0.0):
        return surface
    return surface._replace(centre=(
        position(surface.centre[0], surface.velocity[0], *span_of(options)),
        position(surface.centre[1], surface.velocity[1], 0, options.rows - 1)))


def meet(surface, x, y, by_left):
    """Return left x, disparity and presence of a surface at pixels of one image: three (R, C)."""
    down = surface.disparity + surface.slope[1] * (y - surface.centre[1])
    if not by_left:
        x = (x + down - surface.slope[0] * surface.centre[0]) / (1 - surface.slope[0])
    disparity = down + surface.slope[0] * (x - surface.centre[0])
    across = (x - surface.centre[0] - surface.tilt * (y - surface.centre[1])) / surface.half[0]
    along = (y - surface.centre[1]) / surface.half[1]
    if surface.shape == 'background':
        return x, disparity, np.ones(across.shape, bool)
    if surface.shape == 'ellipse':
        return x, disparity, across**2 + along**2 <= 1
    return x, disparity, (abs(across) <= 1) & (abs(along) <= 1)
