# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Functions of the launch files: arguments from the table of parameters, and the node."""
from contextlib import suppress
import os
import sys

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from fuzzy_stereo_ros.node.subscriptions import FAST_DDS_VARIABLES, has_fast_dds_profile
from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS, Parameter, ROS_PARAMETERS
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
import yaml

PACKAGE = 'fuzzy_stereo_ros'
MODULES = {'disparity_node': f'{PACKAGE}.node.disparity_node',
           'managed_disparity_node': f'{PACKAGE}.node.managed_node',
           'simulated_cameras': f'{PACKAGE}.node.simulated_cameras'}
TRUTH = {'true': True, '1': True, 'false': False, '0': False}
NODE_ROWS = (*ROS_PARAMETERS, Parameter('use_sim_time', False, 'take the time from /clock'))
PROCESS_ROWS = (
    Parameter('output', 'screen', 'destination of what the node prints',
              choices=('screen', 'log', 'both', 'own_log', 'full')),
    Parameter('log_level', 'info', 'lowest level of messages that the node logs',
              choices=('debug', 'info', 'warn', 'error', 'fatal')),
)


def declared(rows, left_out=''):
    """Return a DeclareLaunchArgument for each row; left_out: meaning of an empty one."""
    return [DeclareLaunchArgument(
        row.name, default_value='' if left_out else str(row.default),
        description=row.described() + (left_out and f'; empty: {left_out}')) for row in rows]


def ignored_arguments():
    """Return a DeclareLaunchArgument for each ignored parameter of stereo_image_proc."""
    return [DeclareLaunchArgument(name, default_value='',
                                  description="of stereo_image_proc's matchers; ignored")
            for name in IGNORED_PARAMETERS]


def arguments(context, rows):
    """Return {name: value} of the rows' launch arguments; ValueError if one is not allowed."""
    found = {}
    for row in rows:
        value = LaunchConfiguration(row.name).perform(context)
        if isinstance(row.default, bool):
            value = TRUTH.get(value.lower(), value)
        else:
            with suppress(ValueError):      # `checked` rejects it
                value = type(row.default)(value)
        found[row.name] = row.checked(value)
    return found


def given_parameters(context):
    """Return {name: value} of the node's parameters whose launch arguments are not empty."""
    texts = {name: LaunchConfiguration(name).perform(context)
             for name in (*IGNORED_PARAMETERS, *(row.name for row in NODE_ROWS))}
    return {**arguments(context, [row for row in NODE_ROWS if texts[row.name]]),
            **{name: yaml.safe_load(texts[name]) for name in IGNORED_PARAMETERS if texts[name]}}


def camera_remappings(left_namespace, right_namespace, image='image_rect'):
    """Return the remappings of the four inputs to two cameras; image: name of their topic."""
    return [(f'{side}/{topic}', f"{namespace.rstrip('/')}/{name}")
            for side, namespace in (('left', left_namespace), ('right', right_namespace))
            for topic, name in (('image_rect', image), ('camera_info', 'camera_info'))]


def dds_profile(share):
    """Return the actions that set our profile of Fast DDS; none if the user has set one."""
    if has_fast_dds_profile():
        return []
    return [SetEnvironmentVariable(FAST_DDS_VARIABLES[0], str(share / 'config' / 'fastdds.xml'))]


def installed(package):
    """Return whether ROS finds a package."""
    try:
        get_package_prefix(package)
    except (PackageNotFoundError, OSError):     # OSError without AMENT_PREFIX_PATH
        return False
    return True


def program(executable, *words):
    """Return the arguments of a launch_ros Node that runs one of our executables with words."""
    if installed(PACKAGE):
        return {'package': PACKAGE, 'executable': executable, 'arguments': list(words)}
    # The package is not installed, only on Python's path.
    return {'executable': sys.executable, 'arguments': ['-m', MODULES[executable], *words]}


def node_of(parameters, params_file, log_level, managed=False, **options):
    """
    Return the Node action of disparity_node; ValueError if params_file does not exist.

    parameters: {name: value}, which override the file; launch_ros joins nested names. params_file:
    path, '' for none. managed: whether the node has a life cycle. options: of launch_ros's Node.
    """
    if params_file and not os.path.isfile(params_file):
        raise ValueError(f"params_file is '{params_file}', which is no file; give the path of a "
                         'file of parameters, or nothing for the defaults')
    executable = 'managed_disparity_node' if managed else 'disparity_node'
    parameters = {name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
                  for name, value in parameters.items()}
    return Node(**program(executable, '--ros-args', '--log-level', log_level),
                parameters=[*filter(None, [params_file, parameters])], **options)
