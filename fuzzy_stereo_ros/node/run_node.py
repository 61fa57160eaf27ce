# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The process of a node from its start to its end, whatever ends it.

Exit codes: 0 ended by a signal; 1 something does not work here; 2 arguments or parameters are not
allowed.
"""
import os
import signal
import sys
import tempfile

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logging_directory
from rclpy.utilities import remove_ros_args

BROKEN, REJECTED = 1, 2
NOT_ALLOWED = ValueError, RuntimeError, ParameterException     # by us, by ROS
SHUTDOWN_TIMEOUT = 4.0      # s to wait for a match or a compilation that still runs
LOOK_SECONDS = 0.5          # between two looks whether ROS shuts down
LEAST_ROOM = 2**16          # bytes for log files
NO_LOG_FILES = '--disable-external-lib-logs'


def run_node(node_type, arguments):
    """
    Spin a node until SIGINT or SIGTERM; return the exit code.

    node_type: called without arguments; its destroy_node() returns whether all threads have
    ended. arguments: of the process, its name first.
    """
    node, code, signals = None, 0, []
    # A signal shuts ROS down, which ends the spinning; it must not raise KeyboardInterrupt as
    # well, and a second one, as launch and a terminal send it, must not disturb the end.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: signals.append(number))
    try:
        unknown = remove_ros_args(arguments)[1:]
        if unknown:
            raise ValueError(f"unrecognized arguments: {' '.join(unknown)}")
        arguments, warning = log_arguments(arguments)
        rclpy.init(args=arguments)
    except (ValueError, RuntimeError) as error:
        return _reject(error)
    try:
        # Before the node, which takes its time: an executor that is made after a signal prints a
        # traceback. Not rclpy's EventsExecutor, which takes a millisecond less for a pair: with
        # rclpy 7.1 one process in a hundred that was interrupted as it started was aborted.
        executor = SingleThreadedExecutor()
        node = node_type()
        if warning:
            node.get_logger().warning(warning)
        # An executor that nothing else wakes may miss that a signal shut ROS down.
        node.create_timer(LOOK_SECONDS, lambda: None,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        executor.add_node(node)
        if not signals:
            executor.spin()
    except ExternalShutdownException:
        pass
    except Exception as error:      # noqa: B902  after a signal ROS fails in many ways
        if rclpy.ok():
            if node is not None or not isinstance(error, NOT_ALLOWED):
                raise
            code = _reject(error)
    ended = True
    if node is not None:
        code = max(code, node.exit_code)
        ended = node.destroy_node()
    rclpy.try_shutdown()
    if not ended:
        sys.stdout.flush()
        os._exit(code)      # a compilation cannot be interrupted, only left behind
    return code


def log_arguments(arguments):
    """
    Return (arguments, warning): those of a process with which ROS starts in any case.

    ROS does not start where it cannot write files of logs. warning: '' where it can.
    """
    reason = 'HOME is not set'
    if any(os.environ.get(name) for name in ('ROS_LOG_DIR', 'ROS_HOME', 'HOME')):
        folder = get_logging_directory()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(bytes(LEAST_ROOM))
            return arguments, ''
        except OSError as error:
            reason = f'{folder}: {error.strerror}'
    return [*arguments, '--ros-args', NO_LOG_FILES], (
        f'no folder for log files can be written to ({reason}): logs are only printed; set '
        'ROS_LOG_DIR to another folder')


def _reject(error):
    sys.stderr.write(f'disparity_node cannot start: {error}\n')
    return REJECTED
