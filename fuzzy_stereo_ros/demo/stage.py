# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the demo plays: the environment, the node's process, and who waits for what."""
from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
from fuzzy_stereo_ros.demo.listener import DemoListener
from fuzzy_stereo_ros.node.subscriptions import FAST_DDS_VARIABLES
from fuzzy_stereo_ros.synthetic.simulated_cameras import SimulatedCameras
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

LONGEST_START = 600.0  # s; compiling takes up to 30, and much longer on a machine that is busy
LONGEST_END = 10.0  # s
PATIENCE = 5.0  # s after which a pair that is not at work is lost
NODE = 'fuzzy_stereo_ros.node.disparity_node'
DOMAINS = range(215, 232)  # their ports lie above Linux's ephemeral ones
PROBE_RATE = 30.0  # pairs/s, of single pairs


class NodeFailed(Exception):
    """The node under test did not do its part; the text says what and shows its log."""


class Stage:
    """The rig and the listener, and what turns them: waits for one thing after the other."""

    def __init__(self, sequence, process):
        self._process, self._executor = process, SingleThreadedExecutor()
        self._rig = SimulatedCameras(
            'demo_cameras', _namespace(), [], sequence.focal, sequence.baseline, PROBE_RATE,
            offset=sequence.offset)
        self._listener = DemoListener(self._rig, sequence, _namespace())
        for node in (self._rig, self._listener):
            self._executor.add_node(node)

    def wait_until_ready(self):
        """Return when the node has subscribed to the rig, which it does with warm kernels."""
        self._wait(self._rig.subscribed, LONGEST_START, 'the node did not become ready')

    def play(self, name, frames, rate, progress=lambda phase: None):
        """Return what the listener's future of the same call brings; pairs may be lost."""
        done = self._listener.play(name, frames, rate, progress)
        while not done.done():
            self._turn()
            if time.monotonic() - self._listener.news > PATIENCE + 1 / rate:
                self._listener.end()
        return done.result()

    def probe(self):
        """Return the latency of a single pair in s; the very first may be lost in discovery."""
        for _ in range(3):
            phase, _ = self.play('probe', 1, PROBE_RATE)
            if phase.received:
                return phase.latencies[0]
        raise NodeFailed('the node did not answer three single pairs')

    def confidence(self):
        """Return the confidence of the pair whose disparity came last: float32 (R, C)."""
        self._wait(self._listener.has_both, PATIENCE, 'no confidence came with a disparity')
        return self._listener.confidence

    def set_parameter(self, name, value):
        """Change a parameter of the node; NodeFailed where it refuses."""
        answer = self._listener.change_parameter(name, value)
        self._wait(answer.done, PATIENCE, f'the node did not take {name}')
        for result in answer.result().results:
            if not result.successful:
                raise NodeFailed(f'the node refused {name}: {result.reason}')

    def _wait(self, what, seconds, otherwise):
        end = time.monotonic() + seconds
        while not what():
            self._turn()
            if time.monotonic() > end:
                raise NodeFailed(f'{otherwise} within {seconds:g} s')

    def _turn(self):
        self._executor.spin_once(timeout_sec=0.1)
        if self._process.poll() is not None:
            raise NodeFailed(f'the node ended with code {self._process.returncode}')


def _namespace():
    """Return the namespace of this run, so that two demos do not hear one another."""
    return f'/demo_{os.getpid()}'


@contextmanager
def open_stage(sequence, process):
    """Give a Stage for a sequence and the node's process."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield Stage(sequence, process)
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


def running_node(parameters, log):
    """Run the node with parameters {ROS name: value}; its end must be clean."""
    words = [word for name, value in parameters.items() for word in (
        '--param', f'{name}:={str(value).lower() if isinstance(value, bool) else value}')]
    return running_module(NODE, ['--ros-args', '--remap', f'__ns:={_namespace()}', *words], log)


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
