# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node in a process and an environment of its own, and a listener that counts its results."""
from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
from diagnostic_msgs.msg import DiagnosticArray
from fuzzy_stereo_ros.node.subscriptions import FAST_DDS_VARIABLES
from fuzzy_stereo_ros.pairs.messages import stamp_of
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from stereo_msgs.msg import DisparityImage

NODE = 'fuzzy_stereo_ros.node.disparity_node'
LONGEST_START = 600.0  # s; compiling takes up to 30, and much longer on a machine that is busy
LONGEST_END = 10.0  # s
DOMAINS = range(215, 232)  # their ports lie above Linux's ephemeral ones


class NodeFailed(Exception):
    """The node under test did not do its part; the text says what and shows its log."""


class Listener:
    """
    Subscribes to the disparities of a node, whose process it watches, and counts.

    process: the node's Popen. take: called with each disparity that is received. ages: of these,
    ms from their stamps; stamp: of the newest, ns. counts: {key: number} of diagnostics, None
    before. node, executor: its own; other nodes may be added.
    """

    def __init__(self, process, namespace='', take=lambda message: None):
        """Listen to a node; nothing is subscribed to but its diagnostics."""
        self.node = rclpy.create_node('listener', namespace=namespace)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.process, self.take = process, take
        self._status, self._counted = f'{namespace}/disparity_node: stereo matching', 0
        self._subscription = None
        self.ages, self.stamp, self.counts = [], None, None
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._count, 10)

    def subscribe(self):
        """Want disparities."""
        self._subscription = self.node.create_subscription(
            DisparityImage, 'disparity', self._receive, 10)

    def leave(self):
        """Want nothing any more."""
        self.node.destroy_subscription(self._subscription)

    def close(self):
        """End; otherwise the middleware would go on listening."""
        self.executor.shutdown()
        self.node.destroy_node()

    def spin(self, seconds=LONGEST_START, until=None, otherwise='the node did not answer'):
        """
        Listen for a time in s, or until something is true.

        Raises NodeFailed where that is not so in time, and where the node ends.
        """
        end = time.monotonic() + seconds
        while not (until and until()):
            left = end - time.monotonic()
            if left <= 0 and until:
                raise NodeFailed(f'{otherwise} within {seconds:g} s')
            if left <= 0:
                return
            if self.process.poll() is not None:
                raise NodeFailed(f'the node ended with code {self.process.returncode}')
            self.executor.spin_once(timeout_sec=min(0.1, left))

    def news(self):
        """Return {key: number} of diagnostics that are newer than this call."""
        asked = self.node.get_clock().now().nanoseconds
        self.spin(until=lambda: self._counted > asked)
        return self.counts

    def _receive(self, message):
        now = self.node.get_clock().now().nanoseconds
        self.stamp = stamp_of(message.header)
        self.ages.append((now - self.stamp) / 1e6)
        self.take(message)

    def _count(self, message):
        for status in message.status:
            if status.name == self._status:
                self._counted = stamp_of(message.header)
                self.counts = {entry.key: int(entry.value) for entry in status.values
                               if entry.key.startswith('pairs ')}


@contextmanager
def ros_running():
    """Let rclpy be there inside the with block, signals left to Python."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


@contextmanager
def ros_environment():
    """
    Set the environment for this process and the node's: apart from a robot, large messages pass.

    The path of a log file comes out. A Fast DDS profile that the user has set stays.
    Raises ValueError where this package is not installed.
    """
    prefixes = [sys.prefix, *filter(None, [os.environ.get('AMENT_PREFIX_PATH')])]
    os.environ['AMENT_PREFIX_PATH'] = os.pathsep.join(prefixes)
    os.environ['ROS_DOMAIN_ID'] = str(DOMAINS[os.getpid() % len(DOMAINS)])
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    try:
        share = Path(get_package_share_directory('fuzzy_stereo_ros'))
    except PackageNotFoundError:
        raise ValueError('the package fuzzy_stereo_ros is not installed for this Python; '
                         '`make demo` installs it, and so does `pip install .`') from None
    os.environ.setdefault(FAST_DDS_VARIABLES[0], str(share / 'config' / 'fastdds.xml'))
    with tempfile.TemporaryDirectory() as folder:
        os.environ['ROS_LOG_DIR'] = folder
        yield Path(folder) / 'node.log'


@contextmanager
def running_module(module, arguments, log):
    """Run a module of this package as a process; its end must be clean."""
    command = [sys.executable, '-m', module, *arguments]
    with log.open('wb') as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
    try:
        yield process
        code = _ended(process)
        if code:
            raise NodeFailed(f'{module} ended with code {code}')
    except NodeFailed as failure:
        raise NodeFailed(f'{failure}; it said:\n{log.read_text()}') from None
    finally:
        _ended(process)


def _ended(process):
    """Ask a process to end, wait until it has, and return its exit code."""
    process.terminate()
    try:
        return process.wait(LONGEST_END)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()
