# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The node's parameters as one table, from which ROS declarations and config/*.yaml are made.

What concerns matching comes from `MatcherConfig`; here is only what the node adds. Names and
defaults are those of stereo_image_proc where it has the parameter.
"""
from contextlib import suppress
from dataclasses import dataclass, fields
from difflib import get_close_matches
import textwrap

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES
from fuzzy_stereo_ros.pairs.pair_reader import SCALES
from fuzzy_stereo_ros.saved_pairs.format_versions import PARAMETERS

ROS_NAMES = {'disparities': 'disparity_range'}      # the others are called as in MatcherConfig
REFERENCE = 'left'      # what stereo_msgs/DisparityImage wants: no parameter of the node
LONGEST_QUEUE = 1000000


@dataclass(frozen=True)
class Parameter:
    """
    A row of the table; low and high are None where no range is asked for.

    several: the value is a text of any number of the choices, as words.
    """

    name: str
    default: object
    sentence: str
    low: float | None = None
    high: float | None = None
    unit: str = ''
    choices: tuple = ()
    several: bool = False
    read_only: bool = False
    preset: bool = False

    def described(self):
        """Return the sentence with what is allowed."""
        if self.choices:
            allowed = listed(self.choices)
        elif self.low is not None:
            allowed = f'{self.low:.10g} to {self.high:.10g} {self.unit}'.strip()
        else:
            allowed = ''
        return f'{self.sentence} [{allowed}]' if allowed else self.sentence

    def checked(self, value):
        """Return a value in the parameter's own type; raise ValueError where it is not allowed."""
        if isinstance(self.default, float) and type(value) is int:
            with suppress(OverflowError):
                value = float(value)
        if type(value) is not type(self.default):
            raise ValueError(f'{self.name} is {value!r}; allowed are values like {self.default!r}')
        words = value.split() if self.several else [value]
        if self.choices and not set(words) <= set(self.choices):
            raise ValueError(f"{self.name} is '{value}'; allowed are {listed(self.choices)}")
        if self.low is not None and not self.low <= value <= self.high:
            raise ValueError(f'{self.name} is {value!r}; allowed are numbers from '
                             f'{self.low:.10g} to {self.high:.10g}')
        return value


VERSION = Parameter(
    'parameters_version', PARAMETERS,
    'of the names and meanings of parameters; a file made for another one is refused',
    read_only=True)
OUTPUTS = 'disparity', 'confidence', 'depth', 'points2', 'preview'
NODE_PARAMETERS = (
    Parameter('profile', 'realtime', 'preset of the matcher; single parameters override it',
              choices=tuple(PROFILES)),
    Parameter('image_transport', 'raw', 'how both images come in',
              choices=('raw', 'compressed'), read_only=True),
    Parameter('queue_size', 5,
              'messages of a topic that wait for the others; with approximate_sync two at least',
              1, LONGEST_QUEUE, read_only=True),
    Parameter('approximate_sync', False,
              'join messages with the nearest stamps, not only with equal ones; a pair then '
              'waits until the next message shows that it is the nearest', read_only=True),
    Parameter('approximate_sync_tolerance_seconds', 0.0,
              'with approximate_sync: largest difference of two stamps; 0 is no bound',
              0.0, 3600.0, 's', read_only=True),
    Parameter('cache_camera_info', False,
              'join the newest camera_info of each camera whatever its stamp: for calibrations '
              'that do not change, published once or seldom', read_only=True),
    Parameter('input_qos', 'sensor_data',
              'QoS of the subscriptions: best effort and the last 5, reliable and the last 5, '
              'what the publishers offer, later ones too, or that of the middleware; '
              'qos_overrides change single policies',
              choices=('sensor_data', 'reliable', 'best_available', 'system_default'),
              read_only=True),
    Parameter('use_system_default_qos', False,
              'the same as input_qos system_default', read_only=True),
    Parameter('output_qos', 'reliable',
              'QoS of what is published: reliable and the last 1, best effort and the last 5, '
              'reliable and kept for those who come later, or that of the middleware',
              choices=('reliable', 'sensor_data', 'latched', 'system_default'), read_only=True),
    Parameter('rectify', False,
              'the images come in raw and are rectified here from K, D, R and P of camera_info',
              read_only=True),
    Parameter('crop', False,
              'match only the rectangle in which both rectified images have pixels, by K, D, R '
              'and P of camera_info', read_only=True),
    Parameter('scale', 1.0,
              'match images reduced to this size: outputs have that size and its focal length; '
              'parameters in px stay those of the full image', choices=SCALES,
              read_only=True),
    Parameter('outputs', ' '.join(OUTPUTS),
              'what is advertised; without a subscriber none of it costs anything',
              choices=OUTPUTS, several=True, read_only=True),
    Parameter('depth_encoding', '32FC1',
              'of depth/image_rect: metres, NaN is invalid; or millimetres, 0 is invalid',
              choices=('32FC1', '16UC1'), read_only=True),
    Parameter('use_color', True, 'points2 has colours', read_only=True),
    Parameter('avoid_point_cloud_padding', True,
              'points2 has no bytes that mean nothing: half the bytes, and sooner there; false is '
              'the layout that stereo_image_proc has unless told so', read_only=True),
    Parameter('save_directory', '~/.ros/fuzzy_stereo_ros',
              'where the service ~/save makes a folder for each call', read_only=True),
    Parameter('no_pair_seconds', 5.0,
              'report what is missing when no pair has come for this long',
              0.1, 3600.0, 's', read_only=True),
    VERSION,
)
# Of stereo_image_proc's matchers; a launch file or parameter file that sets them still works.
IGNORED_PARAMETERS = (
    'P1', 'P2', 'correlation_window_size', 'disp12_max_diff', 'full_dp', 'prefilter_cap',
    'prefilter_size', 'sgbm_mode', 'stereo_algorithm', 'texture_threshold', 'uniqueness_ratio')


def sync_tolerance(settings):
    """Return the tolerance for a Synchroniser, ns, of settings by name; None: equal stamps."""
    if not settings['approximate_sync']:
        return None
    return round(settings['approximate_sync_tolerance_seconds'] * 1e9)


def listed(choices):
    """Return choices as people write them."""
    return ', '.join(f'{choice:g}' if isinstance(choice, float) else choice for choice in choices)


def matcher_parameters(config):
    """Return the rows of the matcher's parameters, with the values of a MatcherConfig."""
    presets = {name for preset in PROFILES.values() for name in preset}
    return tuple(
        Parameter(ros_name(field.name), getattr(config, field.name), preset=field.name in presets,
                  **field.metadata)
        for field in fields(MatcherConfig) if field.name != 'reference')


def ros_name(field_name):
    """Return what a field of MatcherConfig is called as a ROS parameter."""
    return ROS_NAMES.get(field_name, field_name)


def field_names():
    """Return a dict: the field of MatcherConfig by the name of its ROS parameter."""
    return {ros_name(field.name): field.name
            for field in fields(MatcherConfig) if field.name != 'reference'}


def nearest(name, names=(), likeness=0.6):
    """
    Return ' (is another_name meant?)' for a name that no parameter has, '' if none is near.

    names: those it may be; none are those of the table. likeness: at least, 0 to 1.
    """
    if name in ROS_NAMES:
        return f' (is {ROS_NAMES[name]} meant?)'
    names = names or [row.name for row in NODE_PARAMETERS] + list(field_names())
    return ''.join(f' (is {near} meant?)' for near in get_close_matches(name, names, 1, likeness))


def in_ros_words(sentence):
    """Return a sentence about a field of MatcherConfig with the name of its ROS parameter."""
    name, rest = sentence.split(' ', 1) if ' ' in sentence else (sentence, '')
    return f'{ROS_NAMES[name]} {rest}' if name in ROS_NAMES else sentence


def profile_config(profile, **changes):
    """Return the MatcherConfig of a profile as the node uses it; ValueError where unknown."""
    return MatcherConfig.from_profile(profile, **{**changes, 'reference': REFERENCE})


def preset_changes(old, new):
    """Return {field: value} for what changes from a profile to another; ValueError if unknown."""
    config = profile_config(new)
    names = {*PROFILES.get(old, {}), *PROFILES[new]} - {'reference'}
    return {name: getattr(config, name) for name in names}


def parameter_file():
    """
    Return the text of config/fuzzy_stereo.yaml: every parameter, its sentence and its default.

    What a profile presets stands there as a comment, so that the file leaves profiles their say.
    """
    lines = ['# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers',
             '# SPDX-License-Identifier: Apache-2.0',
             '# Made from the declaration of the parameters; a test holds the two equal.',
             '# A name behind # is preset by the profile; without the # it overrides the profile.',
             '/**:', '  ros__parameters:']
    for row in (*NODE_PARAMETERS, *matcher_parameters(profile_config('realtime'))):
        comment = row.described() + ('; fixed at start' if row.read_only else '')
        lines += textwrap.wrap(comment, 99, initial_indent='    # ', subsequent_indent='    # ')
        value = str(row.default).lower() if isinstance(row.default, bool) else row.default
        lines.append(f"    {'# ' if row.preset else ''}{row.name}: {value}")
    return '\n'.join(lines) + '\n'
