# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From the start of the process to its end, whatever ends it.

Exit codes: 0 ended by a signal; 1 something does not work here; 2 arguments or parameters are not
allowed.
"""
import argparse
import os
import shlex
import signal
import sys

from fuzzy_stereo_ros.node.log_folder import startable
from fuzzy_stereo_ros.node.worker import Worker
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

BROKEN, REFUSED = 1, 2
NOT_ALLOWED = ValueError, RuntimeError, ParameterException     # by us, by ROS
PATIENCE = 4.0      # s to wait at the end for a match or a compilation that still runs


def live(node_type, arguments):
    """
    Spin a node, or one for each --rig, until SIGINT or SIGTERM; return the exit code.

    node_type: called with options of a Node. arguments: of the process, its name first.
    """
    nodes, code, signals = [], 0, []
    # A signal shuts ROS down, which ends the spinning; it must not raise KeyboardInterrupt as
    # well, and a second one, as launch and a terminal send it, must not disturb the end.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: signals.append(number))
    try:
        rigs = _rigs(remove_ros_args(arguments)[1:])
        arguments, remark = startable(arguments)
        rclpy.init(args=arguments)
    except (ValueError, RuntimeError) as error:
        return _refuse(error)
    try:
        executor = SingleThreadedExecutor()
        for options in rigs:
            nodes.append(node_type(**options))
            executor.add_node(nodes[-1])
        if remark:
            nodes[0].get_logger().warning(remark)
        if not signals:
            executor.spin()
    except ExternalShutdownException:
        pass
    except Exception as error:      # noqa: B902  after a signal ROS fails in many ways
        if rclpy.ok():
            if len(nodes) == len(rigs) or not isinstance(error, NOT_ALLOWED):
                raise
            code = _refuse(error)
    code = max([code, *(node.exit_code for node in nodes)])
    ended = sum(node.destroy_node() for node in nodes) == len(nodes)
    rclpy.try_shutdown()
    if not (ended and Worker.of_this_process().stop(PATIENCE)):
        sys.stdout.flush()
        os._exit(code)      # a compilation cannot be interrupted, only left behind
    return code


def _rigs(arguments):
    """Return options for each node that the arguments which are not ROS's own ask for."""
    parser = _Parser(prog='disparity_node', allow_abbrev=False, description='Dense stereo.')
    parser.add_argument(
        '--rig', action='append', default=[], metavar='ARGUMENTS',
        help='ROS arguments of one node, as "-r __ns:=/front -p scale:=0.5"; with several, all '
             'run in this process and take turns')
    rigs = parser.parse_args(arguments).rig
    return [{'cli_args': ['--ros-args', *shlex.split(rig)]} for rig in rigs] or [{}]


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are ValueErrors."""

    def error(self, message):
        raise ValueError(message)


def _refuse(error):
    sys.stderr.write(f'disparity_node cannot start: {error}\n')
    return REFUSED
