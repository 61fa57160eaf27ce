# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the launch files share: arguments from rows of the table, rigs, and their processes."""
from contextlib import suppress
from dataclasses import dataclass, field
import json
import os
import shlex
import sys

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from fuzzy_stereo_ros.node.watchdog import FAST_DDS_VARIABLES, large_messages_pass
from fuzzy_stereo_ros.parameters.table import (
    IGNORED_PARAMETERS, matcher_parameters, NODE_PARAMETERS, Parameter, profile_config)
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.utilities.namespace_utils import make_namespace_absolute, prefix_namespace
import yaml

PACKAGE = 'fuzzy_stereo_ros'
MODULES = {'disparity_node': f'{PACKAGE}.stereo_node', 'fake_rig': f'{PACKAGE}.fake_rig'}
SIDES = ('left', 'right')
TRUTH = {'true': True, '1': True, 'false': False, '0': False}
TIME = Parameter('use_sim_time', False, 'take the time from /clock')
NODE_ROWS = (*NODE_PARAMETERS, *matcher_parameters(profile_config('realtime')), TIME)
PROCESS_ROWS = (
    Parameter('output', 'screen', 'where what the node prints goes',
              choices=('screen', 'log', 'both', 'own_log', 'full')),
    Parameter('log_level', 'info', 'from which level on the node logs',
              choices=('debug', 'info', 'warn', 'error', 'fatal')),
)


@dataclass(frozen=True)
class RigNode:
    """
    One node and the two cameras it listens to.

    remappings: list of (from, to); the first that fits a topic is taken.
    params_file: path, empty for none. parameters: values by name, over those of the file.
    """

    namespace: str
    node_name: str
    remappings: list
    params_file: str = ''
    parameters: dict = field(default_factory=dict)


def declared(rows, left_out=None):
    """
    Return a DeclareLaunchArgument for each row of a table.

    left_out: what an empty argument means; it is the default then. None: the row's own default.
    """
    if left_out is None:
        return [DeclareLaunchArgument(row.name, default_value=str(row.default),
                                      description=row.described()) for row in rows]
    return [DeclareLaunchArgument(row.name, default_value='',
                                  description=f'{row.described()}; empty: {left_out}')
            for row in rows]


def ignored_arguments():
    """Return a DeclareLaunchArgument for each parameter of stereo_image_proc without meaning."""
    return [DeclareLaunchArgument(name, default_value='',
                                  description="of stereo_image_proc's matchers; ignored")
            for name in IGNORED_PARAMETERS]


def argument(context, row):
    """Return the value of a row's launch argument; ValueError where it is not allowed."""
    text = LaunchConfiguration(row.name).perform(context)
    value = text
    if isinstance(row.default, bool):
        value = TRUTH.get(text.lower(), text)
    elif isinstance(row.default, (int, float)):
        with suppress(ValueError):      # the check refuses it with its sentence
            value = type(row.default)(text)
    elif not isinstance(row.default, str):
        value = yaml.safe_load(text)
    return row.checked(value)


def arguments(context, rows):
    """Return {name: value} of the rows' launch arguments; ValueError for what is not allowed."""
    return {row.name: argument(context, row) for row in rows}


def given_parameters(context):
    """Return {name: value} of the node's parameters whose launch arguments are not empty."""
    def text_of(name):
        return LaunchConfiguration(name).perform(context)

    given = arguments(context, [row for row in NODE_ROWS if text_of(row.name)])
    return given | {name: yaml.safe_load(text_of(name))
                    for name in IGNORED_PARAMETERS if text_of(name)}


def camera_remappings(left_namespace, right_namespace, image='image_rect'):
    """Return the remappings of the four inputs to two cameras; image: name of their images."""
    return [(f'{side}/{topic}', f"{namespace.rstrip('/')}/{there}")
            for side, namespace in zip(SIDES, (left_namespace, right_namespace))
            for topic, there in (('image_rect', image), ('camera_info', 'camera_info'))]


def dds_profile(share):
    """Return the actions by which Fast DDS carries large images, unless it has a profile."""
    if large_messages_pass():
        return []
    return [SetEnvironmentVariable(FAST_DDS_VARIABLES[0], str(share / 'config' / 'fastdds.xml'))]


def installed(package):
    """Return whether ROS finds a package."""
    try:
        get_package_prefix(package)
    except (PackageNotFoundError, OSError):     # the second: AMENT_PREFIX_PATH is not set
        return False
    return True


def program(executable, *words):
    """Return the arguments of a launch_ros Node that say which of our executables it runs."""
    if installed(PACKAGE):
        return {'package': PACKAGE, 'executable': executable, 'arguments': list(words)}
    # A source folder that is only on the path of Python.
    return {'executable': sys.executable, 'arguments': ['-m', MODULES[executable], *words]}


def process_of(rig, output, log_level):
    """Return the Node action for one rig; ValueError where its params_file does not exist."""
    parameters = {name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
                  for name, value in rig.parameters.items()}
    return Node(
        **program('disparity_node', '--ros-args', '--log-level', log_level), output=output,
        name=rig.node_name, namespace=rig.namespace, remappings=rig.remappings,
        parameters=[*filter(None, [existing(rig.params_file), parameters])])


def process_of_all(context, rigs, output, log_level):
    """Return the Node action for the one process of all rigs; ValueError as `process_of`."""
    base = context.launch_configurations.get('ros_namespace')
    words = [word for rig in rigs for word in ('--rig', shlex.join(ros_arguments(rig, base)))]
    return Node(
        **program('disparity_node', *words, '--ros-args', '--log-level', log_level),
        output=output)


def ros_arguments(rig, base=None):
    """Return the words after --ros-args that make a node that of a rig; base: its namespace's."""
    namespace = make_namespace_absolute(prefix_namespace(base, rig.namespace)) or '/'
    rules = [('__ns', namespace), ('__node', rig.node_name), *rig.remappings]
    words = [word for name, value in rules for word in ('-r', f'{name}:={value}')]
    if existing(rig.params_file):
        words += ['--params-file', rig.params_file]
    return words + [word for name, value in rig.parameters.items()
                    for word in ('-p', f'{name}:={json.dumps(value)}')]


def existing(params_file):
    """Return the path of a parameter file; ValueError where it is given and does not exist."""
    if params_file and not os.path.isfile(params_file):
        raise ValueError(f"params_file is '{params_file}', which is no file; give the path of a "
                         'file of parameters, or nothing for the defaults')
    return params_file
