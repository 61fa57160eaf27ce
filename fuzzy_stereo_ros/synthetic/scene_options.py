# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What can be asked of a made scene and of the cameras before it, declared once for all."""
import argparse
import inspect

from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.parameters.matcher_options import option_name
from fuzzy_stereo_ros.parameters.table import Parameter
from fuzzy_stereo_ros.synthetic.scenes import made_sequence

FOCAL = 0.9         # focal length in widths of the image
BASELINE = 0.12     # m
CAMERA = 'rate', 'offset'       # what made_sequence does not know


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


def add_scene_options(parser):
    """Add an option for each row, for `scene_values`."""
    group = parser.add_argument_group('the scene and the cameras')
    for row in SCENE_PARAMETERS.values():
        if isinstance(row.default, bool):
            kind = {'action': argparse.BooleanOptionalAction}
        else:
            kind = {'type': type(row.default),
                    'metavar': 'N' if isinstance(row.default, int) else 'NUMBER'}
        told = row.described() + ('' if row.default is False else f'; default: {row.default:g}')
        group.add_argument(option_name(row.name), default=row.default, help=told, **kind)


def scene_values(arguments):
    """Return {name: value} of parsed options; ValueError for one that is not allowed."""
    return {name: row.checked(getattr(arguments, name)) for name, row in SCENE_PARAMETERS.items()}


def scene_pairs(values):
    """Return an iterator over each `MadePair`; ValueError where the scene cannot be made."""
    return made_sequence(**{name: value for name, value in values.items() if name not in CAMERA})


def scene_calibration(values):
    """Return the Calibration of the two cameras."""
    return centred_calibration(FOCAL * values['columns'], BASELINE, values['offset'],
                               values['rows'], values['columns'])
