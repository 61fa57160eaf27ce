# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Start disparity_node; its parameters are arguments, as are those of stereo_image_proc.launch.py.

Fast DDS gets our profile, without which it loses large images, unless the user has set one.
"""
from pathlib import Path

from fuzzy_stereo_ros.node.launching import arguments, declared, program
from fuzzy_stereo_ros.node.subscriptions import FAST_DDS_VARIABLES, has_fast_dds_profile
from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS, Parameter, ROS_PARAMETERS
from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument, LogInfo, OpaqueFunction, SetEnvironmentVariable)
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
import yaml

SHARE = Path(__file__).resolve().parents[1]
ROWS = (
    Parameter('node_name', 'disparity_node', 'name of the node'),
    Parameter('namespace', '', 'namespace of the node and of its topics'),
    Parameter('left_namespace', 'left', 'namespace of the left camera'),
    Parameter('right_namespace', 'right', 'namespace of the right camera'),
    Parameter('params_file', str(SHARE / 'config' / 'fuzzy_stereo.yaml'), 'file of parameters'),
    Parameter('launch_image_proc', False,
              'subscribe to image_raw of both cameras; the node itself rectifies the images'),
    Parameter('managed', False, 'start the managed node, for a lifecycle manager'),
    Parameter('container', '', 'accepted and ignored: a Python node is no component'),
    Parameter('output', 'screen', 'destination of what the node prints',
              choices=('screen', 'log', 'both', 'own_log', 'full')),
    Parameter('log_level', 'info', 'lowest level of messages that the node logs',
              choices=('debug', 'info', 'warn', 'error', 'fatal')))
NODE_ROWS = (*ROS_PARAMETERS, Parameter('use_sim_time', False, 'take the time from /clock'))


def generate_launch_description():
    """Return the arguments, the environment and the node."""
    ignored = [DeclareLaunchArgument(name, default_value='',
                                     description="of stereo_image_proc's matchers; ignored")
               for name in IGNORED_PARAMETERS]
    profile = [] if has_fast_dds_profile() else [
        SetEnvironmentVariable(FAST_DDS_VARIABLES[0], str(SHARE / 'config' / 'fastdds.xml'))]
    return LaunchDescription([
        *declared(ROWS), *declared(NODE_ROWS, left_out='as in params_file'), *ignored, *profile,
        OpaqueFunction(function=_node)])


def _node(context):
    """Return the node; parameters that are given as arguments override those of the file."""
    chosen, image, actions = arguments(context, ROWS), 'image_rect', []
    parameters = _given_parameters(context)
    if chosen['launch_image_proc']:
        parameters, image = {'rectify': True, **parameters}, 'image_raw'
    if chosen['container']:
        actions.append(LogInfo(msg=(
            f"container:={chosen['container']}: a Python node cannot be loaded into a container "
            f"of components; {chosen['node_name']} runs as a process of its own")))
    file = chosen['params_file']
    if file and not Path(file).is_file():
        raise ValueError(f"params_file is '{file}', which is no file; give the path of a file of "
                         'parameters, or nothing for the defaults')
    remappings = [(f'{side}/{topic}', f"{chosen[f'{side}_namespace'].rstrip('/')}/{name}")
                  for side in ('left', 'right')
                  for topic, name in (('image_rect', image), ('camera_info', 'camera_info'))]
    # launch_ros joins nested names.
    parameters = {name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
                  for name, value in parameters.items()}
    executable = 'managed_disparity_node' if chosen['managed'] else 'disparity_node'
    return [*actions, Node(
        **program(executable, '--ros-args', '--log-level', chosen['log_level']),
        parameters=[*filter(None, [file, parameters])], name=chosen['node_name'],
        namespace=chosen['namespace'], output=chosen['output'], remappings=remappings)]


def _given_parameters(context):
    """Return {name: value} of the node's parameters whose launch arguments are not empty."""
    texts = {name: LaunchConfiguration(name).perform(context)
             for name in (*IGNORED_PARAMETERS, *(row.name for row in NODE_ROWS))}
    return {**arguments(context, [row for row in NODE_ROWS if texts[row.name]]),
            **{name: yaml.safe_load(texts[name]) for name in IGNORED_PARAMETERS if texts[name]}}
