# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Start disparity_node; its parameters are arguments, as are those of stereo_image_proc.launch.py.

Fast DDS gets our profile, without which it loses large images, unless the user has set one.
"""
from pathlib import Path

from fuzzy_stereo_ros.node.launching import (
    arguments, camera_remappings, dds_profile, declared, given_parameters, ignored_arguments,
    node_of, NODE_ROWS, PROCESS_ROWS)
from fuzzy_stereo_ros.parameters.table import Parameter
from launch import LaunchDescription
from launch.actions import LogInfo, OpaqueFunction

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
    *PROCESS_ROWS)


def generate_launch_description():
    """Return the arguments, the environment and the node."""
    return LaunchDescription([
        *declared(ROWS), *declared(NODE_ROWS, left_out='as in params_file'),
        *ignored_arguments(), *dds_profile(SHARE), OpaqueFunction(function=_node)])


def _node(context):
    """Return the node; parameters that are given as arguments override those of the file."""
    chosen = arguments(context, ROWS)
    parameters, image, actions = given_parameters(context), 'image_rect', []
    if chosen['launch_image_proc']:
        parameters, image = {'rectify': True, **parameters}, 'image_raw'
    if chosen['container']:
        actions.append(LogInfo(msg=(
            f"container:={chosen['container']}: a Python node cannot be loaded into a container "
            f"of components; {chosen['node_name']} runs as a process of its own")))
    return [*actions, node_of(
        parameters, chosen['params_file'], chosen['log_level'], chosen['managed'],
        name=chosen['node_name'], namespace=chosen['namespace'], output=chosen['output'],
        remappings=camera_remappings(chosen['left_namespace'], chosen['right_namespace'], image))]
