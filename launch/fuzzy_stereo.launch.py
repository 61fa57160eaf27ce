# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Start disparity_node; every parameter of it is an argument.

Fast DDS gets the profile without which it loses images of camera size, unless one is set.
"""
import os
from pathlib import Path
import sys

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from fuzzy_stereo_ros.parameter_table import (
    matcher_parameters, NODE_PARAMETERS, profile_config)
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(__file__).resolve().parents[1]
SIDES = ('left', 'right')
PROFILES_FILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
ROWS = (*NODE_PARAMETERS, *matcher_parameters(profile_config('realtime')))
ARGUMENTS = {
    'node_name': ('disparity_node', 'name of the node'),
    'namespace': ('', 'namespace of the node and of its topics'),
    'left_namespace': ('left', 'namespace of the left camera'),
    'right_namespace': ('right', 'namespace of the right camera'),
    'params_file': (str(SHARE / 'config' / 'fuzzy_stereo.yaml'), 'file of parameters'),
    'use_sim_time': ('false', 'take the time from /clock'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
}


def generate_launch_description():
    """Return the arguments, the environment and the node."""
    arguments = [DeclareLaunchArgument(name, default_value=default, description=description)
                 for name, (default, description) in ARGUMENTS.items()]
    arguments += [DeclareLaunchArgument(row.name, default_value='',
                                        description=f'{row.described()}; empty: as in params_file')
                  for row in ROWS]
    environment = []
    if not os.environ.get(PROFILES_FILE):
        environment.append(SetEnvironmentVariable(
            PROFILES_FILE, str(SHARE / 'config' / 'fastdds.xml')))
    return LaunchDescription([*arguments, *environment, OpaqueFunction(function=_node)])


def _node(context):
    """Return the node with the parameters that were given as arguments over those of the file."""
    def value_of(name):
        return LaunchConfiguration(name).perform(context)

    given = {row.name: ParameterValue(LaunchConfiguration(row.name), value_type=type(row.default))
             for row in ROWS if value_of(row.name)}
    given['use_sim_time'] = ParameterValue(LaunchConfiguration('use_sim_time'), value_type=bool)
    try:
        get_package_prefix('fuzzy_stereo_ros')
        program = {'package': 'fuzzy_stereo_ros', 'executable': 'disparity_node'}
        arguments = []
    except PackageNotFoundError:    # a source folder that is only on the path of Python
        program = {'executable': sys.executable}
        arguments = ['-m', 'fuzzy_stereo_ros.stereo_node']
    return [Node(
        **program, name=value_of('node_name'), namespace=value_of('namespace'), output='screen',
        arguments=[*arguments, '--ros-args', '--log-level', value_of('log_level')],
        parameters=[value_of('params_file'), given],
        remappings=[(f'{side}/{topic}', f"{value_of(f'{side}_namespace')}/{topic}")
                    for side in SIDES for topic in ('image_rect', 'camera_info')])]
