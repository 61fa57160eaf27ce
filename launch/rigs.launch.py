# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Start a disparity_node in its own process for each rig of a YAML file."""
from pathlib import Path

from fuzzy_stereo_ros.node.launching import (
    argument, arguments, dds_profile, declared, process_of, PROCESS_ROWS, read_rigs)
from fuzzy_stereo_ros.parameters.table import Parameter
from launch import LaunchDescription
from launch.actions import OpaqueFunction

SHARE = Path(__file__).resolve().parents[1]
RIGS_FILE = Parameter('rigs_file', str(SHARE / 'config' / 'rigs.yaml'), 'YAML file of the rigs')


def generate_launch_description():
    """Return the arguments, the environment and the nodes."""
    return LaunchDescription([
        *declared([RIGS_FILE, *PROCESS_ROWS]), *dds_profile(SHARE),
        OpaqueFunction(function=_nodes)])


def _nodes(context):
    process = arguments(context, PROCESS_ROWS)
    return [process_of(rig, **process) for rig in read_rigs(argument(context, RIGS_FILE))]
