# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Run the node on a simulated camera, print a table of figures and write a picture.

Exit codes: 0 success; 1 the node failed, or lost a pair without counting it; 2 bad input; 130
interrupted by the user.
"""
from collections import deque
from contextlib import closing, ExitStack
from functools import partial
import math
import os
from pathlib import Path
import sys
import time

from bench.demo.observed_node import (
    Listener, NODE, NodeFailed, ros_environment, ros_running, running_module)
from bench.demo.phase import (
    COLUMNS, floats, MotorcycleWindow, Phase, play, ROWS, STEP, table, TIMEOUT)
from bench.demo.picture import write_panel
from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.node.simulated_cameras import SimulatedCameras
from fuzzy_stereo_ros.pairs.image_files import check_suffix
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.stereo_pair import number_of
from fuzzy_stereo_ros.parameters.options import (
    add_matcher_options, matcher_changes, matcher_config)
from fuzzy_stereo_ros.parameters.table import ros_name
from fuzzy_stereo_ros.program import Parser, run_program
from fuzzy_stereo_ros.views.pictures import PANEL_SUFFIXES
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from sensor_msgs.msg import Image
from tqdm import tqdm

CAMERA_RATE, FRAMES = 30.0, 90
SLOW = 0.5              # s for a pair; the camera is slower for slower matchers
LONGEST_PHASE = 30.0    # s, with a slower camera
FAILED = 1              # exit code
PLAYED = (f'a window of {COLUMNS}x{ROWS} pixels that pans by {STEP} px a frame over one real '
          'pair, Motorcycle of Middlebury 2014')


def main(argv=None):
    """Run the demo with the arguments (None: those of the process) and return its exit code."""
    return run_program(_parser, argv)


def _parser():
    """Return the parser of the demo."""
    parser = Parser(prog='demo', description=(
        f'Run the node on {PLAYED}; print a table and write a picture.'))
    parser.add_argument('--frames', type=int, metavar='N',
                        help=f'pairs to publish, warm and cold each; default: {FRAMES}, or as '
                             f'many as fit into {LONGEST_PHASE:g} s')
    parser.add_argument('--rate', type=float, metavar='HZ',
                        help=f'pairs a second; default: {CAMERA_RATE:g}, or what a slow matcher '
                             'can follow')
    parser.add_argument('--picture', metavar='FILE', default='demo.png', help='default: demo.png')
    add_matcher_options(parser, left_out=('reference',))
    parser.set_defaults(run=run)
    return parser


def run(arguments):
    """Run the demo and return its exit code; ValueError for arguments that are not allowed."""
    changes = matcher_changes(arguments)
    config = matcher_config(arguments)
    check_suffix(arguments.picture, PANEL_SUFFIXES)
    if not Path(arguments.picture).resolve().parent.is_dir():
        raise ValueError(f'--picture is {arguments.picture}, but there is no such folder')
    for name in ('frames', 'rate'):
        value = getattr(arguments, name)
        if value is not None and not 0 < value < math.inf:
            raise ValueError(f'--{name} is {value}; allowed are numbers above 0')
    parameters = {'profile': arguments.profile,
                  **{ros_name(name): value for name, value in changes.items()}}
    sequence = MotorcycleWindow()
    print(f'playing {PLAYED}', flush=True)
    StereoMatcher(config).warm_up(*WARM_UP_SIZE)
    namespace = f'/demo_{os.getpid()}'      # demos that run at the same time are kept apart
    words = [word for name, value in parameters.items() for word in (
        '--param', f'{name}:={str(value).lower() if isinstance(value, bool) else value}')]
    try:
        with ExitStack() as stack:
            log = stack.enter_context(ros_environment())
            process = stack.enter_context(running_module(
                NODE, ['--ros-args', '--remap', f'__ns:={namespace}', *words], log))
            stack.enter_context(ros_running())
            listener = stack.enter_context(closing(Listener(process, namespace)))
            print('starting the node', flush=True)
            phases, last = _play(listener, sequence, config, arguments)
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
        print(f"demo: {number_of(lost, 'pair')} lost without being counted", file=sys.stderr)
    return FAILED if lost else 0


def _play(listener, sequence, config, arguments):
    """Return the phases, and (frame number, disparity, confidence) of the first one's end."""
    started, confidence = time.monotonic(), deque(maxlen=1)
    cameras = SimulatedCameras('demo_cameras', sequence.focal, sequence.baseline, sequence.offset,
                               namespace=listener.node.get_namespace())
    listener.executor.add_node(cameras)
    listener.subscribe()
    listener.node.create_subscription(
        Image, 'confidence', lambda image: confidence.append(image), 10)
    # The node subscribes once its kernels are warm.
    listener.spin(until=cameras.subscribed, otherwise='the node did not become ready')
    print(f'ready after {time.monotonic() - started:.1f} s')
    listener.next_counts()
    frames, rate = _pace(min(_probe(listener, cameras, sequence) for _ in range(2)), arguments)
    phases, last = [], None
    for name, warm in (('warm', True), ('cold', False)):
        if warm and not config.warm_start:
            continue
        _set_warm_start(listener, warm)
        phase = Phase(name)
        with tqdm(total=frames, desc=name, unit='pair', file=sys.stdout) as bar:
            received = play(listener, cameras, sequence, phase, frames, rate,
                            partial(_update_bar, bar, phase))
        if received and last is None:
            listener.spin(TIMEOUT, lambda: confidence and stamp_of(
                confidence[0].header) == listener.stamp, 'no confidence came with a disparity')
            last = (*received[-1], floats(confidence[0]))
        phase.add_scores(received, sequence)
        phases.append(phase)
    return phases, last


def _probe(listener, cameras, sequence):
    """Return the latency of a single pair in s; repeated, as discovery may lose the first."""
    for _ in range(3):
        phase = Phase('probe')
        if play(listener, cameras, sequence, phase, 1, CAMERA_RATE):
            return phase.latencies[0] / 1000
    raise NodeFailed('the node did not answer three single pairs')


def _set_warm_start(listener, warm):
    """Set the parameter warm_start of the node; NodeFailed if the node rejects it."""
    client = AsyncParameterClient(listener.node, 'disparity_node')
    answer = client.set_parameters([Parameter('warm_start', value=warm)])
    listener.spin(TIMEOUT, answer.done, 'the node did not set warm_start')
    result, = answer.result().results
    if not result.successful:
        raise NodeFailed(f'the node rejected warm_start: {result.reason}')


def _update_bar(bar, phase):
    """Show the progress of a phase in a bar."""
    bar.set_postfix(received=phase.received, refresh=False)
    bar.update(phase.published - bar.n)


def _pace(seconds, arguments):
    """Return the number of pairs and their rate, for a matcher that takes seconds for a pair."""
    rate = arguments.rate or CAMERA_RATE
    if arguments.rate is None and seconds > SLOW:
        rate = 0.8 / seconds
        print(f'a pair takes {seconds:.2f} s: the camera is slowed down to {rate:.2f} pairs/s')
    return arguments.frames or max(2, min(FRAMES, int(rate * LONGEST_PHASE))), rate


if __name__ == '__main__':
    sys.exit(main())
