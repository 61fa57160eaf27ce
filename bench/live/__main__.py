# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measure the node with a camera, and beside a plain node around OpenCV's 3WAY.

Latency, rate and processor time; camera, node and listener are processes.

`python -m bench.live --output docs/benchmarks.md` writes its section.
"""
from contextlib import closing, contextmanager
import sys
import time

from bench.demo.observed_node import (
    Listener, NODE, NodeFailed, ros_environment, ros_running, running_module)
from bench.page import check_page, write_section
from bench.request import measured
from fuzzy_stereo_ros.evaluation.report import markdown, Report, Table
from fuzzy_stereo_ros.program import Parser, run_program
import numpy as np
import psutil

RATE = 30.0                                         # pairs/s
COMPARED = RATE, 2 * RATE                           # pairs/s, beside the plain node
CASES = ((640, 480, 64), (1280, 720, 128))          # columns, rows, disparities
SETTLED = 3.0       # s at the most between the start of a node and a measurement
COUNTED = ('pairs synchronised', 'pairs matched', 'pairs dropped', 'pairs rejected')
RATED = ('live', 'pairs', 'matched', 'dropped', 'rejected', 'pairs/s', 'latency median [ms]',
         '95th percentile [ms]', 'of a core [%]')   # columns of rate_row
PLAIN = 'bench.live.nodes'                          # module of a node, as NODE
FAILED = 1


@contextmanager
def running(program, columns, rows, disparities, rate, log):
    """
    Yield a Listener and the psutil.Process of a node, with a camera that publishes to it.

    program: NODE or PLAIN. log: path of the node's log.
    """
    node = running_module(program, [
        '--ros-args', '--param', f'disparity_range:={disparities}'], log)
    camera = running_module('fuzzy_stereo_ros.node.simulated_cameras', [
        '--columns', str(columns), '--rows', str(rows), '--disparities', str(disparities),
        '--rate', str(rate), '--colour'], log.with_name('camera.log'))
    with ros_running(), node as process, camera, closing(Listener(process)) as listener:
        listener.subscribe()
        listener.spin(until=lambda: listener.ages)
        yield listener, psutil.Process(process.pid)


def seconds_of(process):
    """Return the processor time of all threads of a psutil.Process in s."""
    return sum(process.cpu_times()[:2])


def case_of(text):
    """Return the (columns, rows, disparities) of a text like 640x480x64; ValueError."""
    columns, rows, disparities = map(int, text.split('x'))
    return columns, rows, disparities


def measure(listener, process, seconds):
    """Return latencies of disparities in ms, processor time in s and time in s of a period."""
    used, started = seconds_of(process), time.monotonic()
    listener.ages.clear()
    listener.spin(seconds)
    listener.spin(until=lambda: listener.ages)
    return list(listener.ages), seconds_of(process) - used, time.monotonic() - started


def rate_row(case, seconds, log):
    """Return the row of a case in the table of rate and latency."""
    columns, rows, disparities = case
    with running(NODE, *case, RATE, log) as (listener, process):
        listener.spin(min(SETTLED, seconds))
        before, started = listener.next_counts(), time.monotonic()
        ages, used, passed = measure(listener, process, seconds)
        after, counted = listener.next_counts(), time.monotonic() - started
    counts = [after[name] - before[name] for name in COUNTED]
    return (f'{columns}x{rows}, {disparities} disparities', *counts, counts[1] / counted,
            *np.percentile(ages, (50, 95)).tolist(), 100 * used / passed)


def compared_rows(case, rate, seconds, runs, log):
    """Return the rows of our node, the plain node and their ratio: medians of runs of each."""
    figures = {NODE: [], PLAIN: []}
    for _ in range(runs):
        for program, turns in figures.items():
            with running(program, *case, rate, log) as (listener, process):
                listener.spin(min(SETTLED, seconds))
                ages, used, passed = measure(listener, process, seconds)
            turns.append((len(ages) / passed, *np.percentile(ages, (50, 95, 100)),
                          100 * used / passed, 1000 * used / len(ages)))
    node, plain = (np.median(turns, axis=0) for turns in figures.values())
    return [(f'{rate:g} pairs/s: {who}', *values.tolist()) for who, values in (
        ('disparity_node', node), ('plain node', plain), ('ratio', node / plain))]


def run(arguments):
    """Measure, print the tables, and return the exit code."""
    if arguments.output is not None:
        check_page(arguments.output)
    for name in ('seconds', 'repeats'):
        value = getattr(arguments, name)
        if value <= 0:
            raise ValueError(f'--{name} is {value}; allowed are numbers above 0')
    try:
        with ros_environment() as log:
            cases = arguments.case or CASES
            rows = [rate_row(case, arguments.seconds, log) for case in cases]
            compared = [row for rate in COMPARED
                        for row in compared_rows(
                            cases[0], rate, arguments.seconds, arguments.repeats, log)]
    except NodeFailed as failure:
        print(f'bench.live: {failure}', file=sys.stderr)
        return FAILED
    report = Report(
        'live', 'The node beside a camera',
        {**measured('all cores, shared by the camera, the node and the listener'),
         'camera': f'a made scene that moves, bgr8 with noise, {RATE:g} pairs/s, best effort; a '
                   'process of its own',
         'measured': f'{arguments.seconds:g} s each; latency is from the stamp to the callback of '
                     'a subscriber of disparity in a third process'},
        [Table('Rate and latency', RATED, rows),
         Table(f'Beside a plain node, at {cases[0][0]}x{cases[0][1]}, {cases[0][2]} disparities',
               ('beside', 'received/s', 'latency median [ms]', '95th percentile [ms]',
                'oldest [ms]', 'of a core [%]', 'processor time of a pair [ms]'), compared,
               "The plain node is rclpy and OpenCV's 3WAY on all cores, with the same QoS. The "
               f'two run in turns, {arguments.repeats} times each; medians of the turns.')])
    print(markdown(report))
    if arguments.output is not None:
        write_section(arguments.output, report)
    return 0


def main(argv=None):
    """Run the benchmark with the arguments (None: those of the process); return its exit code."""
    return run_program(_parser, argv)


def _parser():
    """Return the parser of the benchmark."""
    parser = Parser(prog='bench.live', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--seconds', type=float, default=20.0,
                        help='duration of each case; default: 20')
    parser.add_argument('--case', type=case_of, action='append', metavar='CxRxD',
                        help='columns, rows and disparities of a case; default: '
                             f"{' and '.join('x'.join(map(str, case)) for case in CASES)}")
    parser.add_argument('--repeats', type=int, default=3,
                        help='runs of each node beside the plain one; default: 3')
    parser.add_argument('--output', metavar='FILE.md',
                        help='also write the section of this page')
    parser.set_defaults(run=run)
    return parser


if __name__ == '__main__':
    sys.exit(main())
