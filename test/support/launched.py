# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What tests with the real launch share; importing it skips where there is no launch."""
import atexit
from contextlib import ExitStack
import os
from pathlib import Path
import shutil
import tempfile

from made_messages import shows
from made_scenes import shifted_pair
from node_process import own_domain, ros_environment
import pytest
from repository import ROOT

WHY = 'launch, launch_ros and launch_testing are not importable: they come with ROS 2, not PyPI'
launch = pytest.importorskip('launch', reason=WHY)
launch_ros = pytest.importorskip('launch_ros.actions', reason=WHY)
launch_testing = pytest.importorskip('launch_testing', reason=WHY)
actions = pytest.importorskip('launch.actions', reason=WHY)
asserts = pytest.importorskip('launch_testing.asserts', reason=WHY)

FOLDER = ROOT / 'launch'
PROFILES_FILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
SHIFT = 7
PAIR = shifted_pair(SHIFT)
# What may be given to the launch file of stereo_image_proc.
PEER = {
    'approximate_sync': 'True', 'use_color': 'False', 'avoid_point_cloud_padding': 'False',
    'launch_image_proc': 'True', 'namespace': 'rig', 'left_namespace': 'one',
    'right_namespace': 'two', 'container': 'stereo_container', 'stereo_algorithm': '1',
    'prefilter_size': '9', 'prefilter_cap': '31', 'correlation_window_size': '15',
    'min_disparity': '0', 'disparity_range': '16', 'texture_threshold': '10',
    'speckle_size': '50', 'speckle_range': '4', 'disp12_max_diff': '0',
    'uniqueness_ratio': '15.0', 'P1': '200.0', 'P2': '400.0', 'sgbm_mode': '0'}
held = ExitStack()      # what a launch test holds on to from its start to its end
# Launch opens its own log before a test can say where.
launch.logging.launch_config.log_dir = tempfile.mkdtemp()
atexit.register(shutil.rmtree, launch.logging.launch_config.log_dir)


def included(file, **arguments):
    """Return the action that includes one of our launch files, or any by its path."""
    return actions.IncludeLaunchDescription(
        str(FOLDER / file), launch_arguments=arguments.items())


def written(name, text):
    """Return the path of a file with this text, which is there until `held` is closed."""
    path = Path(held.enter_context(tempfile.TemporaryDirectory())) / name
    path.write_text(text, encoding='utf-8')
    return str(path)


def description(*entities):
    """Return the LaunchDescription of a launch test in a domain of its own."""
    patch = held.enter_context(pytest.MonkeyPatch.context())
    for name, value in ros_environment(
            held.enter_context(tempfile.TemporaryDirectory())).items():
        patch.setenv(name, value)
    patch.setenv('ROS_DOMAIN_ID', str(held.enter_context(own_domain())))
    patch.delenv(PROFILES_FILE)     # the launch files set it
    patience = actions.SetLaunchConfiguration('sigterm_timeout', '60')  # s to end; 5 is launch's
    return launch.LaunchDescription([
        patience, *entities, launch_testing.actions.ReadyToTest()])


def surroundings(**rig):
    """Return `ros_bench.Surroundings` in the domain of the launch; rig: as there."""
    from ros_bench import Surroundings
    return Surroundings(int(os.environ['ROS_DOMAIN_ID']), reliable=True, **rig)


def check_disparity(message, shift=SHIFT, disparities=16):
    """See that a DisparityImage is that of a shifted pair, within half a pixel."""
    assert message.max_disparity - message.min_disparity == disparities - 1
    assert shows(message, shift, disparities - 1)


def visited(file, **arguments):
    """Return (context, actions) of a launch file: what it comes to, with nothing started."""
    # Raises what a wrong argument raises.
    context = launch.LaunchContext()
    context.launch_configurations.update(arguments)

    def visit(entity):
        yield entity
        if not isinstance(entity, launch_ros.Node):
            for below in entity.visit(context) or []:
                yield from visit(below)

    return context, list(visit(included(file)))
