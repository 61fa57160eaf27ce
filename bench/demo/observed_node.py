# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Run the node in a process and an environment of its own, and count its results."""
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
START_TIMEOUT = 600.0   # s; compiling takes up to 60 s, and longer on a busy machine
END_TIMEOUT = 10.0      # s
DOMAINS = range(215, 232)   # their ports are above Linux's ephemeral ports


class NodeFailed(Exception):
    """Raised when the observed node fails; the text says how, and quotes its log."""


class Listener:
    """
    Subscribes to the disparities and diagnostics of a node, and watches its process.

    process: the node's Popen. take(message): called with each disparity image. ages: list of ms
    from their stamps to their receipt. stamp: of the newest, ns. counts: {key: number} of the
    newest diagnostics, None before. node, executor: of the listener; nodes may be added.
    """

    def __init__(self, process, namespace='', take=lambda message: None):
        """Subscribe to the diagnostics only."""
        self.node = rclpy.create_node('listener', namespace=namespace)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.process, self.take = process, take
        self._hardware, self._counted = f'{namespace}/disparity_node', 0
        self._subscription = None
        self.ages, self.stamp, self.counts = [], None, None
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._count, 10)

    def subscribe(self):
        """Subscribe to the disparities."""
        self._subscription = self.node.create_subscription(
            DisparityImage, 'disparity', self._receive, 10)

    def leave(self):
        """End the subscription to the disparities."""
        self.node.destroy_subscription(self._subscription)

    def close(self):
        """Destroy the node, and with it the subscriptions."""
        self.executor.shutdown()
        self.node.destroy_node()

    def spin(self, seconds=START_TIMEOUT, until=None, otherwise='the node did not answer'):
        """
        Spin for a time in s, or until until() is true.

        Raises NodeFailed if it is not true in time (otherwise: its text), or the process ends.
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

    def next_counts(self):
        """Return the counts of diagnostics that are published after this call."""
        called = self.node.get_clock().now().nanoseconds
        self.spin(until=lambda: self._counted > called)
        return self.counts

    def _receive(self, message):
        now = self.node.get_clock().now().nanoseconds
        self.stamp = stamp_of(message.header)
        self.ages.append((now - self.stamp) / 1e6)
        self.take(message)

    def _count(self, message):
        entries = [entry for status in message.status if status.hardware_id == self._hardware
                   for entry in status.values]
        if entries:
            self._counted = stamp_of(message.header)
            self.counts = {entry.key: int(entry.value) for entry in entries
                           if entry.key.startswith('pairs ')}


@contextmanager
def ros_running():
    """Initialise rclpy for the with block, without its signal handlers."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


@contextmanager
def ros_environment():
    """
    Set the environment of this process and the node's for the with block; yield a log file's path.

    Both are isolated from other ROS nodes, and Fast DDS has a profile for large messages, unless
    the user has set one.
    Raises ValueError if this package is not installed.
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
    """Run a module of this package as a process; NodeFailed, with its log, if it fails."""
    command = [sys.executable, '-m', module, *arguments]
    with log.open('wb') as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
    try:
        yield process
        code = _ended(process)
        if code:
            raise NodeFailed(f'{module} ended with code {code}')
    except NodeFailed as failure:
        raise NodeFailed(f'{failure}; its log:\n{log.read_text()}') from None
    finally:
        _ended(process)


def _ended(process):
    """Terminate a process, wait for its end, and return its exit code."""
    process.terminate()
    try:
        return process.wait(END_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()
