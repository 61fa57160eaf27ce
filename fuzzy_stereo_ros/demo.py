# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The demo: the real node in its own process, a rig without cameras, a table and a picture.

Exit codes: 0 done; 1 a pair was lost without being counted, or the node failed; 2 bad input;
130 interrupted by the user.
"""
from contextlib import contextmanager, ExitStack
from functools import partial
import math
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

from ament_index_python.packages import get_package_share_directory
from fuzzy_stereo_ros.command_line import (
    add_matcher_options, matcher_changes, Parser, run_cleanly)
from fuzzy_stereo_ros.demo_listener import DemoListener
from fuzzy_stereo_ros.demo_sequence import MotorcycleWindow
from fuzzy_stereo_ros.demo_table import table
from fuzzy_stereo_ros.fake_rig import FakeRig
from fuzzy_stereo_ros.parameter_table import profile_config, ros_name
from fuzzy_stereo_ros.pictures import check_panel_suffix, write_panel
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from tqdm import tqdm

CAMERA_RATE, FRAMES = 30.0, 90
SLOW = 0.5  # s; a matcher that takes longer for a pair gets a slower camera
LONGEST_PHASE = 30.0  # s, with a slower camera
LONGEST_START = 120.0  # s; compiling the kernels takes up to 30
LONGEST_END = 10.0  # s
PATIENCE = 5.0  # s without news after which a pair is lost
NODE = 'fuzzy_stereo_ros.stereo_node'
DOMAINS = range(215, 232)  # their ports lie above Linux's ephemeral ones
FAILED = 1


class NodeFailed(Exception):
    """The node under test did not do its part; the text says what and shows its log."""


def main(argv=None):
    """Run the demo with the arguments (None: those of the process) and return its exit code."""
    parser = Parser(prog='demo', description=(
        'Run the node on a real stereo sequence, print a table and write a picture.'))
    parser.add_argument('--frames', type=int, metavar='N',
                        help=f'pairs to publish, warm and cold each; default: {FRAMES}, or as '
                             f'many as fit into {LONGEST_PHASE:g} s')
    parser.add_argument('--rate', type=float, metavar='HZ',
                        help=f'pairs a second; default: {CAMERA_RATE:g}, or what a slow matcher '
                             'can follow')
    parser.add_argument('--picture', metavar='FILE', default='demo.png', help='default: demo.png')
    add_matcher_options(parser, left_out=('reference',))
    parser.set_defaults(run=run)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    return run_cleanly(parser, argv)


def run(arguments):
    """Run the demo and return its exit code; ValueError for arguments that are not allowed."""
    changes = matcher_changes(arguments)
    config = profile_config(arguments.profile, **changes)
    check_panel_suffix(arguments.picture)
    for name in ('frames', 'rate'):
        value = getattr(arguments, name)
        if value is not None and not 0 < value < math.inf:
            raise ValueError(f'--{name} is {value}; allowed are numbers above 0')
    parameters = {'profile': arguments.profile,
                  **{ros_name(name): value for name, value in changes.items()}}
    sequence = MotorcycleWindow()
    try:
        with ExitStack() as stack:
            log = stack.enter_context(_ros_environment())
            process = stack.enter_context(_running_node(parameters, log))
            stage = stack.enter_context(_stage(sequence, process))
            phases, last = _play(stage, sequence, config, arguments)
    except NodeFailed as failure:
        print(f'demo: {failure}', file=sys.stderr)
        return FAILED
    print(f'\n{table(phases)}\n')
    if last is not None:
        number, disparity, confidence = last
        shown = sequence.frame(number)
        write_panel(arguments.picture, shown.left, disparity, confidence, shown.truth,
                    low=config.min_disparity, high=config.min_disparity + config.disparities - 1,
                    title=f'profile {arguments.profile}, {phases[0].name}, pair {number + 1}')
        print(f'picture: {Path(arguments.picture).resolve()}')
    lost = sum(phase.lost for phase in phases)
    if lost:
        print(f'demo: {lost} pairs were lost without being counted', file=sys.stderr)
    return FAILED if lost else 0


def _play(stage, sequence, config, arguments):
    """Return the phases, judged, and the last of the first: frame, disparity, confidence."""
    seconds = min(stage.probe() for _ in range(2))
    frames, rate = _pace(seconds, arguments)
    patience = PATIENCE + 4 * seconds
    phases, last = [], None
    for name, warm in (('warm', True), ('cold', False)):
        if warm and not config.warm_start:
            continue
        stage.set_parameter('warm_start', warm)
        with tqdm(total=frames, desc=name, unit='pair', file=sys.stdout) as bar:
            phase, received = stage.play(name, frames, rate, patience, partial(_show, bar))
        if received and last is None:
            last = (*received[-1], stage.listener.confidence)
        phase.judge(received, sequence)
        phases.append(phase)
    return phases, last


def _show(bar, phase):
    """Bring a progress bar up to date with a phase."""
    bar.set_postfix(received=phase.received, refresh=False)
    bar.update(phase.published - bar.n)


def _pace(seconds, arguments):
    """Return how many pairs to publish and how many a second, by what one pair takes."""
    rate = arguments.rate or CAMERA_RATE
    if arguments.rate is None and seconds > SLOW:
        rate = 0.8 / seconds
        print(f'a pair takes {seconds:.2f} s: the camera is slowed down to {rate:.2f} pairs/s')
    return arguments.frames or max(2, min(FRAMES, int(rate * LONGEST_PHASE))), rate


class _Stage:
    """The rig and the listener, and what turns them: waits for one thing after the other."""

    def __init__(self, sequence, process):
        self._process, self._executor = process, SingleThreadedExecutor()
        self._rig = FakeRig('demo_rig', _namespace(), [], sequence.focal, sequence.baseline,
                            CAMERA_RATE, offset=sequence.offset)
        self.listener = DemoListener(self._rig, sequence, _namespace())
        for node in (self._rig, self.listener):
            self._executor.add_node(node)

    def wait_until_ready(self):
        """Return when the node has subscribed to the rig, which it does with warm kernels."""
        self._wait(self._rig.subscribed, LONGEST_START, 'the node did not become ready')

    def play(self, name, frames, rate, patience=LONGEST_START, progress=lambda phase: None):
        done = self.listener.play(name, frames, rate, progress)
        while not done.done():
            self._turn()
            if time.monotonic() - self.listener.news > max(patience, 2 / rate):
                self.listener.end()
        return done.result()

    def probe(self):
        """Return the latency of a single pair in s."""
        phase, _ = self.play('probe', 1, CAMERA_RATE)
        if not phase.received:
            raise NodeFailed('the node took a pair and did not answer')
        return phase.latencies[0]

    def set_parameter(self, name, value):
        answer = self.listener.change_parameter(name, value)
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
def _stage(sequence, process):
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        stage = _Stage(sequence, process)
        print('starting the node; the first start on a machine compiles its kernels, which '
              'takes up to 30 s', flush=True)
        stage.wait_until_ready()
        yield stage
    finally:
        rclpy.try_shutdown()


@contextmanager
def _ros_environment():
    """
    Set the environment for this process and the node's: apart from a robot, large messages pass.

    The path of a log file comes out. A Fast DDS profile that the user has set stays.
    """
    prefixes = [sys.prefix, *filter(None, [os.environ.get('AMENT_PREFIX_PATH')])]
    os.environ['AMENT_PREFIX_PATH'] = os.pathsep.join(prefixes)
    os.environ['ROS_DOMAIN_ID'] = str(DOMAINS[os.getpid() % len(DOMAINS)])
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    share = Path(get_package_share_directory('fuzzy_stereo_ros'))
    os.environ.setdefault('FASTRTPS_DEFAULT_PROFILES_FILE', str(share / 'config' / 'fastdds.xml'))
    with tempfile.TemporaryDirectory() as folder:
        os.environ['ROS_LOG_DIR'] = folder
        yield Path(folder) / 'node.log'


@contextmanager
def _running_node(parameters, log):
    """Run the node with parameters {ROS name: value}; its end must be clean."""
    words = [word for name, value in parameters.items() for word in (
        '--param', f'{name}:={str(value).lower() if isinstance(value, bool) else value}')]
    command = [sys.executable, '-m', NODE, '--ros-args',
               '--remap', f'__ns:={_namespace()}', *words]
    with log.open('wb') as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
    try:
        yield process
        code = _ended(process)
        if code:
            raise NodeFailed(f'the node ended with code {code}')
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


if __name__ == '__main__':
    sys.exit(main())
