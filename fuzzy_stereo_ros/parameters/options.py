# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options of the command line: for the parameters of the table, and for the calibration."""
import argparse
from dataclasses import dataclass, fields, replace
import math

from fuzzy_stereo_ros.matching.config import MatcherConfig, PROFILES, written
from fuzzy_stereo_ros.pairs.calibration import expected_size, read_calibration
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration, rectified_cameras
from fuzzy_stereo_ros.pairs.camera_formats import (
    FORMATS, is_of_one_camera, read_cameras, UNITS, UNKNOWN)
from fuzzy_stereo_ros.pairs.stereo_pair import Projection
from fuzzy_stereo_ros.parameters.table import MATCHER_PARAMETERS, NODE_PARAMETERS

USUAL_PROFILE, AUTO = 'realtime', 'auto'
SHORT = {'approximate_sync': '--approximate',
         'approximate_sync_tolerance_seconds': '--tolerance'}
CONFIGS = {name: MatcherConfig.from_profile(name) for name in PROFILES}
METAVARS = {int: 'N', float: 'NUMBER', str: 'WORD'}
ABOVE_ZERO = 'focal', 'baseline'


def option_name(name):
    """Return the option of a parameter: --min-disparity for `min_disparity`."""
    return '--' + name.replace('_', '-')


def add_options(group, rows, kinds=None):
    """Add an option for each row; kinds: {name: type} where it is another than that of the row."""
    for row in rows:
        name = row.field or row.name
        facts = [row.sentence]
        options = {'default': argparse.SUPPRESS if row.field else row.default}
        if isinstance(row.default, bool):
            options['action'] = argparse.BooleanOptionalAction
        elif isinstance(row.default, str) and row.field:
            options['choices'] = row.choices
        else:
            options.update(type=(kinds or {}).get(name, type(row.default)),
                           metavar=METAVARS[type(row.default)])
            facts.append(row.allowed)
        facts.append(f'default: {_default(row)}')
        group.add_argument(*filter(None, (option_name(name), SHORT.get(name))), dest=name,
                           help='; '.join(facts).replace('%', '%%'), **options)


def option_values(arguments, rows):
    """Return {name: value} of parsed options; ValueError for a value that is not allowed."""
    return {row.name: row.checked(getattr(arguments, row.name)) for row in rows}


def add_node_options(parser, title, names):
    """Add a group of options for parameters of the node, to be read by `option_values`."""
    add_options(parser.add_argument_group(
        title, 'as the parameters of the node with these names'), node_rows(names))


def node_rows(names):
    """Return the rows of parameters of the node, in the order of the table."""
    return [row for row in NODE_PARAMETERS if row.name in names]


def add_matcher_options(parser, left_out=(), automatic=False):
    """Add the options of `matcher_config`; automatic: allow --disparities auto."""
    group = parser.add_argument_group(
        'the matcher', 'a profile sets all parameters, an option changes one of them'
        + '; --disparities auto looks at the first pairs for the range' * automatic)
    group.add_argument('--profile', choices=tuple(PROFILES), default=USUAL_PROFILE,
                       help=f'default: {USUAL_PROFILE}')
    add_options(group, [row for row in MATCHER_PARAMETERS if row.field not in left_out],
                {'disparities': number_or_auto} if automatic else None)


def number_or_auto(word):
    """Return a whole number, or AUTO, of a word of the command line."""
    if word == AUTO:
        return word
    try:
        return int(word)
    except ValueError:
        raise argparse.ArgumentTypeError(f'{word!r} is no whole number, nor {AUTO}') from None


def is_automatic(arguments):
    """Return whether parsed arguments have --disparities auto, and take the option out of them."""
    automatic = getattr(arguments, 'disparities', None) == AUTO
    if automatic:
        if hasattr(arguments, 'min_disparity'):
            raise ValueError('--disparities auto finds the smallest disparity, too; leave out '
                             '--min-disparity')
        del arguments.disparities
    return automatic


def matcher_config(arguments, saved=None):
    """Return the MatcherConfig of parsed options, which change a saved one or a profile."""
    changes = matcher_changes(arguments)
    if saved is None:
        return MatcherConfig.from_profile(arguments.profile, **changes)
    if arguments.profile is not None:
        saved = MatcherConfig.from_profile(arguments.profile, disparities=saved.disparities,
                                           min_disparity=saved.min_disparity)
    return replace(saved, **changes)


def matcher_changes(arguments):
    """Return {field: value} of the matcher's parameters that were given as options."""
    return {row.field: getattr(arguments, row.field)
            for row in MATCHER_PARAMETERS if hasattr(arguments, row.field)}


def add_camera_options(parser):
    """Add the options of the calibration, to be read by `CameraOptions.of`."""
    group = parser.add_argument_group('the calibration, for depth and points')
    group.add_argument('--calibration', metavar='FILE', nargs='+',
                       help='; or '.join(one.name for one in FORMATS))
    group.add_argument('--unit', choices=UNITS,
                       help='of the lengths in --calibration; default: m, but of Middlebury mm '
                            'and of DepthAI cm')
    group.add_argument('--focal', type=float, metavar='PX', help='focal length')
    group.add_argument('--baseline', type=float, metavar='METRES',
                       help='distance between the cameras')
    group.add_argument('--offset', type=float, metavar='PX',
                       help='cx of the left camera minus that of the right one; default: 0')
    group.add_argument('--principal-point', type=float, metavar=('CX', 'CY'), nargs=2,
                       help='of the left camera; default: the centre of the image')


@dataclass(frozen=True)
class CameraOptions:
    """Options of the calibration; ValueError if one is not allowed, or contradicts another."""

    calibration: tuple[str, ...] | None = None      # paths of files
    unit: str | None = None         # of the lengths in these
    focal: float | None = None      # px
    baseline: float | None = None   # m
    offset: float | None = None     # px
    principal_point: tuple[float, float] | None = None      # px, of the left camera

    @classmethod
    def of(cls, arguments):
        given = (getattr(arguments, field.name) for field in fields(cls))
        return cls(*(tuple(value) if isinstance(value, list) else value for value in given))

    def __post_init__(self):
        for name in (*ABOVE_ZERO, 'offset'):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ValueError(f'--{name} is {value:g}; allowed are finite numbers')
            if value is not None and name in ABOVE_ZERO and value <= 0:
                raise ValueError(f'--{name} is {value:g}; allowed are numbers above 0')
        if self.unit is not None and self.calibration is None:
            raise ValueError('--unit is that of the lengths in --calibration; give both')
        for name in self.given if self.calibration is not None else ():
            if name not in ('calibration', 'unit') and not (
                    name == 'offset' and is_of_one_camera(self.calibration)):
                raise ValueError(f'{option_name(name)} is part of --calibration already; leave '
                                 'one of the two out')

    @property
    def given(self):
        return [field.name for field in fields(self) if getattr(self, field.name) is not None]

    def cameras(self, shape, purpose, raw=False, images=(), needed=ABOVE_ZERO):
        """
        Return (left, right), each a `Camera`, and where they are from, in words.

        shape: (R, C) of the images; purpose: what needs cameras, for the error; raw: whether the
        images have to be rectified; images: their paths, see `read_cameras`; needed: options that
        cannot be left out. Raises ValueError if the cameras are missing, cannot rectify, or are of
        images of another size, and as `read_cameras`.
        """
        files = self.calibration
        found = files and read_cameras(files, shape, self.offset or 0.0, self.unit, images)
        if raw and (not found or is_of_one_camera(files) or found[0].r == UNKNOWN):
            raise ValueError('--rectify and --crop need the calibration of both raw cameras: '
                             'those of a bag, or --calibration with files of both')
        if found:
            size = expected_size(found[1])
            if size not in (None, shape):
                raise ValueError(f'{files[-1]} is of {size[1]}x{size[0]} pixels, but the images '
                                 f'have {shape[1]}x{shape[0]}; give the calibration of these')
            return found, ' and '.join(files)
        missing = [f'--{name}' for name in needed if getattr(self, name) is None]
        if missing:
            raise ValueError(f"{purpose} needs the cameras: give {' and '.join(missing)}, or "
                             '--calibration with a calibration file')
        calibration = centred_calibration(self.focal, self.baseline or 0.0, self.offset or 0.0,
                                          *shape)
        if self.principal_point is not None:
            calibration = replace(calibration, left=Projection(
                self.focal, self.focal, *self.principal_point))
        found = tuple(rectified_cameras(calibration, *shape).values())
        read_calibration(*found)
        return found, (
            f'focal length {self.focal:g} px, baseline {self.baseline or 0.0:g} m and the centre '
            + ('assumed in the middle of the image' if self.principal_point is None else
               'at {:g}, {:g}'.format(*self.principal_point)))


def _default(row):
    """Return the default of a row as text, with those of all profiles if they differ."""
    def text(value):
        return ('off', 'on')[value] if isinstance(value, bool) else written(value)

    if not row.field:
        return text(row.default)
    values = {name: text(getattr(config, row.field)) for name, config in CONFIGS.items()}
    if len(set(values.values())) == 1:
        return values[USUAL_PROFILE]
    return ', '.join(f'{value} ({name})' for name, value in values.items())
