# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Start disparity_node and simulated cameras, and show the disparities."""
from pathlib import Path

from fuzzy_stereo_ros.node.launching import arguments, declared, installed, program
from fuzzy_stereo_ros.parameters.table import Parameter
from fuzzy_stereo_ros.synthetic.scenes import SCENE_PARAMETERS
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription, LogInfo, OpaqueFunction, Shutdown
from launch_ros.actions import Node

NODE = Path(__file__).resolve().with_name('fuzzy_stereo.launch.py')
VIEWER = 'rqt_image_view'
CAMERA_OPTIONS = 'columns', 'rows', 'disparities', 'rate'
ROWS = (
    *(SCENE_PARAMETERS[name] for name in CAMERA_OPTIONS),
    Parameter('viewer', True, f'show the topic preview in {VIEWER}, if that is installed'))


def generate_launch_description():
    """Return the arguments, and the actions that they determine."""
    return LaunchDescription([*declared(ROWS), OpaqueFunction(function=_demo)])


def _demo(context):
    """Return the node by its own launch file, the cameras, and a viewer or a hint."""
    chosen = arguments(context, ROWS)
    if chosen['disparities'] > chosen['columns']:
        raise ValueError(f"disparities is {chosen['disparities']}; allowed are 1 to the "
                         f"{chosen['columns']} columns")
    options = [f'--{name}={chosen[name]}' for name in CAMERA_OPTIONS]
    return [
        IncludeLaunchDescription(str(NODE), launch_arguments={
            'disparity_range': str(chosen['disparities'])}.items()),
        Node(**program('simulated_cameras', *options), output='screen', on_exit=Shutdown()),
        *(_viewer() if chosen['viewer'] else [])]


def _viewer():
    if installed(VIEWER):
        return [Node(package=VIEWER, executable=VIEWER, arguments=['/preview'])]
    return [LogInfo(msg=f'{VIEWER} is not installed: open the topic /preview in RViz or Foxglove; '
                        'the node matches only while an output has a subscriber')]
