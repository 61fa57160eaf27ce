# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Run a node in this process until a signal or an error ends it.

Exit codes: 0 ended by a signal, or after the help; 1 the node failed; 2 arguments or parameters
are not allowed.
"""
import os
from pathlib import Path
import signal
import sys
import tempfile

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logging_directory
from rclpy.utilities import remove_ros_args

FAILED, BAD_INPUT = 1, 2    # exit codes
REJECTIONS = ValueError, RuntimeError, ParameterException   # of parameters, by us and by ROS
SHUTDOWN_TIMEOUT = 4.0      # s to wait for a match or a compilation that still runs
POLL_PERIOD = 0.5           # s between two checks whether ROS shuts down
LOG_SPACE = 2**16           # bytes that must be free for log files
NO_LOG_FILES = '--disable-external-lib-logs'
HELP = """\
usage: {name} [-h] [--ros-args [-p NAME:=VALUE] [--params-file FILE.yaml] [-r FROM:=TO] ...]

Match rectified pairs of images and publish disparities, with the topics and parameters of
stereo_image_proc's disparity_node and more. SIGINT or SIGTERM ends it.

  -h, --help                     this text; no node is started
  --ros-args                     what follows is for ROS, as of every node
  -p NAME:=VALUE                 a parameter, for example -p disparity_range:=128
  --params-file FILE.yaml        parameters, for example config/fuzzy_stereo.yaml, which has all
  -r FROM:=TO                    another name, for example -r left/image_rect:=/camera/left
  -r __ns:=/NAMESPACE            namespace of the node and its topics

`ros2 launch fuzzy_stereo_ros fuzzy_stereo.launch.py --show-args` lists all parameters,
docs/node.md and docs/parameters.md describe them.
"""


def run_node(node_type, arguments):
    """Spin a node as `spin_until_signal` does, or print the help; return the exit code."""
    try:
        unknown = remove_ros_args(arguments)[1:]
    except (ValueError, RuntimeError) as error:
        return _reject(arguments, error)
    if {'-h', '--help'} & set(unknown):
        sys.stdout.write(HELP.format(name=Path(arguments[0]).stem))
        return 0
    if unknown:
        return _reject(arguments, f"unrecognized arguments: {' '.join(unknown)}; a parameter is "
                       'given by --ros-args -p NAME:=VALUE, and --help says more')
    return spin_until_signal(node_type, arguments)


def spin_until_signal(node_type, arguments):
    """Spin node_type() until SIGINT or SIGTERM; return the exit code, that of the node or ours."""
    node, code, signals = None, 0, []
    # A signal shuts ROS down, which ends the spinning; it must not raise KeyboardInterrupt as
    # well. Launch and a terminal send a second one, which must not disturb the shutdown.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: signals.append(number))
    try:
        ros_arguments, warning = log_arguments(arguments)
        rclpy.init(args=ros_arguments)
    except (ValueError, RuntimeError) as error:
        return _reject(arguments, error)
    try:
        # Before the node, which takes a while: an executor made after a signal prints a
        # traceback. rclpy's EventsExecutor saves a millisecond a pair, but with rclpy 7.1 one
        # process in a hundred aborts if it is interrupted while it starts.
        executor = SingleThreadedExecutor()
        node = node_type()
        if warning:
            node.get_logger().warning(warning)
        # An executor without events may miss that a signal shut ROS down.
        node.create_timer(POLL_PERIOD, lambda: None,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        executor.add_node(node)
        if not signals:
            executor.spin()
    except ExternalShutdownException:
        pass
    except Exception as error:      # noqa: B902  after a signal ROS fails in many ways
        if rclpy.ok():
            if node is not None or not isinstance(error, REJECTIONS):
                raise
            code = _reject(arguments, error)
    ended = True
    if node is not None:
        code = max(code, node.exit_code)
        ended = node.destroy_node()
    rclpy.try_shutdown()
    if not ended:
        sys.stdout.flush()
        os._exit(code)      # a thread that compiles cannot be interrupted
    return code


def log_arguments(arguments):
    """
    Return (arguments, warning): the arguments of a process, changed so that ROS can start.

    ROS does not start unless it can write log files; where it cannot, they are disabled.
    warning: says why, '' if log files can be written.
    """
    reason = 'HOME is not set'
    if any(os.environ.get(name) for name in ('ROS_LOG_DIR', 'ROS_HOME', 'HOME')):
        folder = get_logging_directory()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(bytes(LOG_SPACE))
            return arguments, ''
        except OSError as error:
            reason = f'{folder}: {error.strerror}'
    return [*arguments, '--ros-args', NO_LOG_FILES], (
        f'no folder for log files can be written to ({reason}): logs are only printed; set '
        'ROS_LOG_DIR to another folder')


def _reject(arguments, error):
    sys.stderr.write(f'{Path(arguments[0]).stem} cannot start: {error}\n')
    return BAD_INPUT
