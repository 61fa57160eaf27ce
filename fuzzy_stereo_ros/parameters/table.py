# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The one table of parameters: ROS, command line, YAML, launch files and README are made from it.

Rows that concern matching are made from the fields of `MatcherConfig`, which checks them; here is
what the node adds. Names and defaults are those of stereo_image_proc where it has the parameter.
"""
from contextlib import suppress
from dataclasses import dataclass, fields
from difflib import get_close_matches

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES
from fuzzy_stereo_ros.pairs.pair_reader import SCALES

ROS_NAMES = {'disparities': 'disparity_range'}      # the others are called as in MatcherConfig
REFERENCE = 'left'      # what stereo_msgs/DisparityImage wants: no parameter of the node
LONGEST_QUEUE = 1000000


@dataclass(frozen=True)
class Parameter:
    """
    A row of the table; low and high are None where no range is asked for.

    several: the value is a text of any number of the choices, as words. read_only: fixed at the
    start of the node. field: of MatcherConfig, '' for what the node adds.
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
    field: str = ''

    @property
    def allowed(self):
        """The choices or the range, as people write them; '' for any value."""
        if self.choices:
            return ', '.join(map(written, self.choices))
        if self.low is None:
            return ''
        return f'{written(self.low)} to {written(self.high)} {self.unit}'.strip()

    @property
    def preset(self):
        """Whether a profile sets it."""
        return any(self.field in preset for preset in PROFILES.values())

    def described(self):
        """Return the sentence with what is allowed."""
        return f'{self.sentence} [{self.allowed}]' if self.allowed else self.sentence

    def checked(self, value):
        """Return a value in the parameter's own type; raise ValueError where it is not allowed."""
        if isinstance(self.default, float) and type(value) is int:
            with suppress(OverflowError):
                value = float(value)
        if type(value) is not type(self.default):
            raise ValueError(f'{self.name} is {value!r}; allowed are values like {self.default!r}')
        words = value.split() if self.several else [value]
        if self.choices and not set(words) <= set(self.choices):
            raise ValueError(f"{self.name} is '{value}'; allowed are {self.allowed}")
        if self.low is not None and not self.low <= value <= self.high:
            raise ValueError(f'{self.name} is {value!r}; allowed are numbers from '
                             f'{written(self.low)} to {written(self.high)}')
        return value


def written(value):
    """Return a value as people write it: true, 54 instead of 54.0."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'{value:.10g}' if isinstance(value, float) else str(value)


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
)
MATCHER_PARAMETERS = tuple(
    Parameter(ROS_NAMES.get(field.name, field.name), field.default, field=field.name,
              **field.metadata)
    for field in fields(MatcherConfig))
ROS_PARAMETERS = (
    *NODE_PARAMETERS, *(row for row in MATCHER_PARAMETERS if row.field != 'reference'))
# Of stereo_image_proc's matchers; a launch file or parameter file that sets them still works.
IGNORED_PARAMETERS = (
    'P1', 'P2', 'correlation_window_size', 'disp12_max_diff', 'full_dp', 'prefilter_cap',
    'prefilter_size', 'sgbm_mode', 'stereo_algorithm', 'texture_threshold', 'uniqueness_ratio')


def sync_tolerance(settings):
    """Return the tolerance for a Synchroniser, ns, of settings by name; None: equal stamps."""
    if not settings['approximate_sync']:
        return None
    return round(settings['approximate_sync_tolerance_seconds'] * 1e9)


def ros_name(field_name):
    """Return what a field of MatcherConfig is called as a ROS parameter."""
    return ROS_NAMES.get(field_name, field_name)


def nearest(name, names=(), likeness=0.6):
    """
    Return ' (did you mean another_name?)' for a name that no parameter has, '' if none is near.

    names: those it may be; none are those of the table. likeness: at least, 0 to 1.
    """
    names = names or [row.name for row in ROS_PARAMETERS]
    near = [ROS_NAMES[name]] if name in ROS_NAMES else get_close_matches(
        name, names, 1, likeness)
    return ''.join(f' (did you mean {one}?)' for one in near)


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
