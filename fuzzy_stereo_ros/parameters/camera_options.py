# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options of the command line that say what the cameras of a pair are, and back."""
from dataclasses import replace
import math
from pathlib import Path

from fuzzy_stereo_ros.pairs.camera_files import (
    centred_calibration, read_calibration_files, YAML_SUFFIXES)
from fuzzy_stereo_ros.pairs.stereo_pair import Projection

ABOVE_ZERO = 'focal', 'baseline'
NUMBERS = (*ABOVE_ZERO, 'offset')
IN_CAMERA_INFO = (*NUMBERS, 'principal_point')
CAMERA = ('camera_info', *IN_CAMERA_INFO)     # all options, as parsed


def add_camera_options(parser):
    """Add the options, for `given_calibration`."""
    group = parser.add_argument_group('the cameras, where metres are needed')
    group.add_argument('--camera-info', metavar='FILE', nargs='+',
                       help='calib.txt of Middlebury 2014; or YAML as camera_calibration writes '
                            'it: RIGHT.yaml, or LEFT.yaml RIGHT.yaml')
    group.add_argument('--focal', type=float, metavar='PX', help='focal length')
    group.add_argument('--baseline', type=float, metavar='METRES',
                       help='how far the cameras are apart')
    group.add_argument('--offset', type=float, metavar='PX',
                       help='cx of the left camera minus that of the right one; default: 0')
    group.add_argument('--principal-point', type=float, metavar=('CX', 'CY'), nargs=2,
                       help='of the left camera; default: the middle of the image')


def given_calibration(arguments, shape, needed, purpose):
    """
    Return the Calibration that the options give.

    shape: (R, C) of the image. needed: those of focal and baseline that matter. purpose: what
    needs them, for the sentence where one is missing.
    Raises ValueError where an option is missing, wrong, or said twice, and as
    `read_calibration_files`; also for a file of cameras of another size.
    """
    for name in NUMBERS:
        value = getattr(arguments, name)
        if value is not None and not math.isfinite(value):
            raise ValueError(f'--{name} is {value:g}; allowed are finite numbers')
        if value is not None and name in ABOVE_ZERO and value <= 0:
            raise ValueError(f'--{name} is {value:g}; allowed are numbers above 0')
    if arguments.camera_info is not None:
        return _of_files(arguments, shape)
    missing = [f'--{name}' for name in needed if getattr(arguments, name) is None]
    if missing:
        raise ValueError(f"{purpose} needs the cameras: give {' and '.join(missing)}, or "
                         '--camera-info with a calib.txt or the YAML of the right camera')
    calibration = centred_calibration(arguments.focal, arguments.baseline or math.nan,
                                      arguments.offset or 0.0, *shape)
    if arguments.principal_point is None:
        return calibration
    focal = calibration.focal
    return replace(calibration, left=Projection(focal, focal, *arguments.principal_point))


def _of_files(arguments, shape):
    """Return the Calibration of --camera-info."""
    first, *others = arguments.camera_info
    one_camera = not others and Path(first).suffix.lower() in YAML_SUFFIXES
    for name in IN_CAMERA_INFO:
        if getattr(arguments, name) is not None and not (one_camera and name == 'offset'):
            raise ValueError(f"--{name.replace('_', '-')} stands in --camera-info already; leave "
                             'one of the two out')
    calibration, size = read_calibration_files(arguments.camera_info, arguments.offset or 0.0)
    if size not in (None, shape):
        raise ValueError(f'{arguments.camera_info[-1]} is of {size[1]}x{size[0]} pixels, but '
                         f'there are {shape[1]}x{shape[0]}')
    return calibration
