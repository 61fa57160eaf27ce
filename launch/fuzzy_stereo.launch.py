# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Start disparity_node; every parameter of it is an argument, and so is what the peer's file has.

The peer is stereo_image_proc.launch.py. Fast DDS gets the profile without which it loses images
of camera size, unless one is set.
"""
from pathlib import Path

from fuzzy_stereo_ros.node.launching import (
    arguments, camera_remappings, dds_profile, declared, given_parameters, ignored_arguments,
    NODE_ROWS, process_of, PROCESS_ROWS, RigNode)
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
              'take image_raw of both cameras; the node itself rectifies them'),
    Parameter('managed', False, 'the node has a life cycle and waits for a lifecycle manager'),
    Parameter('container', '', 'of components; a Python node runs beside it'),
    *PROCESS_ROWS)


def generate_launch_description():
    """Return the arguments, the environment and the node."""
    return LaunchDescription([
        *declared(ROWS), *declared(NODE_ROWS, left_out='as in params_file'),
        *ignored_arguments(), *dds_profile(SHARE), OpaqueFunction(function=_node)])


def _node(context):
    """Return the node with the parameters that were given as arguments over those of the file."""
    chosen = arguments(context, ROWS)
    parameters, image, actions = given_parameters(context), 'image_rect', []
    if chosen['launch_image_proc']:
        parameters, image = {'rectify': True, **parameters}, 'image_raw'
    if chosen['container']:
        actions.append(LogInfo(msg=(
            f"container:={chosen['container']}: a Python node cannot be loaded into a container "
            f"of components; {chosen['node_name']} runs as a process of its own")))
    rig = RigNode(
        chosen['namespace'], chosen['node_name'],
        camera_remappings(chosen['left_namespace'], chosen['right_namespace'], image),
        chosen['params_file'], parameters)
    return [*actions, process_of(rig, chosen['output'], chosen['log_level'], chosen['managed'])]
