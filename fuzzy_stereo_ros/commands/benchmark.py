# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
`fuzzy-stereo benchmark`: latency, processor time and memory on this machine, beside OpenCV.

Other programs make times longer. Matchers that take turns are slowed down alike: ratios of their
medians hold even if the times do not.
"""
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
import re
import time

from fuzzy_stereo_ros.commands.evaluate import libraries_needed
from fuzzy_stereo_ros.commands.shared_options import as_json, UNTOUCHED
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads, TUNED
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.matching.bands import processors
from fuzzy_stereo_ros.parameters.options import (
    add_matcher_options, add_options, matcher_config, option_values)
from fuzzy_stereo_ros.program import give_back_memory
from fuzzy_stereo_ros.synthetic.scenes import make_sequence, SCENE_PARAMETERS
import numpy as np

REPEATS = 60
FRAMES, NOISE = 4, 1.5      # pictures; grey levels, fresh in every one
SIZE_OPTIONS = [SCENE_PARAMETERS[name] for name in ('columns', 'rows')]
FIGURES = ('latency, median [ms]', '95th percentile [ms]', 'processor time [ms]', 'memory [MB]')
STATUS = Path('/proc/self/status')
RESET = Path('/proc/self/clear_refs')

ON_INTERRUPT = UNTOUCHED
HELP = 'measure latency and memory on this machine'
DESCRIPTION = (
    'Measure on this machine, for a size of images: the latency of a pair, its processor time,\n'
    "and memory, of this matcher and of OpenCV's, tuned. They take turns on a synthetic scene in\n"
    'colour (OpenCV: in grey) that stands still, with fresh noise. cold: no previous frame;\n'
    'warm: with it, each frame is searched. memory: of a matcher and its frame, at the peak.\n'
    'For errors: fuzzy-stereo evaluate.')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo benchmark\n'
           '  fuzzy-stereo benchmark --columns 1280 --rows 720 --disparities 128 --threads 2')


def add_arguments(parser):
    add_options(parser.add_argument_group('the images'), SIZE_OPTIONS)
    parser.add_argument('--repeats', metavar='N', type=int, default=REPEATS,
                        help=f'frames of each matcher; default: {REPEATS}')
    parser.add_argument('--json', action='store_true', help='print JSON instead of Markdown')
    add_matcher_options(parser, left_out=('min_disparity', 'reference', 'warm_start',
                                          'still_interval'))


def run(arguments, stream):
    """Measure the matchers and print a table."""
    with libraries_needed():
        from fuzzy_stereo_ros.evaluation.report import environment, markdown, Report, Table
    size, config = option_values(arguments, SIZE_OPTIONS), matcher_config(arguments)
    if arguments.repeats < 1:
        raise ValueError(f'--repeats is {arguments.repeats}; allowed are 1 and more')
    frames = [(pair.left, pair.right) for pair in make_sequence(
        size['rows'], size['columns'], config.disparities, FRAMES, noise=NOISE, colour=True)]
    threads = config.threads or processors()
    with opencv_threads(threads):
        rows = measured(config, frames, arguments.repeats)
    title = f"{size['columns']}x{size['rows']}, {config.disparities} disparities"
    report = Report('benchmark', 'Latency and memory', {
        **environment(f'{threads} each'), 'profile': arguments.profile,
        'turns': str(arguments.repeats)}, [Table(title, ('', *FIGURES), rows)])
    stream.write(as_json(asdict(report)) + '\n' if arguments.json else markdown(report))


def measured(config, frames, repeats):
    """Return a row for each matcher: its name and FIGURES."""
    makers = {f'ours, {name}': partial(StereoMatcher, replace(
        config, warm_start=name == 'warm', still_interval=1)) for name in ('cold', 'warm')}
    makers.update((f'OpenCV {baseline.name}', partial(
        baseline.matcher, MIDDLEBURY, config.disparities)) for baseline in TUNED)
    makers = {name: partial(_work, make, frames) for name, make in makers.items()}
    StereoMatcher(config).warm_up(*frames[0][0].shape[:2])
    memory = {name: _memory_of(make) for name, make in makers.items()}
    turns = take_turns({name: make() for name, make in makers.items()}, repeats)
    rows = []
    for name in makers:
        latency, processor = ([turn[figure] for turn in turns if turn['matcher'] == name]
                              for figure in ('milliseconds', 'processor'))
        rows.append((name, *np.percentile(latency, (50, 95)).tolist(),
                     float(np.median(processor)), memory[name]))
    return rows


def _work(make, frames):
    matcher = make()

    def work(number):
        matcher.match(*frames[number])
    return work


def _memory_of(make):
    """Return by how many MB a matcher and two frames make the process grow; None if not Linux."""
    give_back_memory()
    try:
        RESET.write_text('5')       # sets VmHWM to VmRSS
    except OSError:
        return None
    before, work = _kilobytes('VmRSS'), make()
    for number in range(2):
        work(number)
    return (_kilobytes('VmHWM') - before) / 1000


def take_turns(works, turns):
    """Call functions of a frame number in turns; return a dict of times for each call."""
    for work in works.values():
        work(0)
    taken = []
    for turn in range(turns):
        for name, work in works.items():
            start, processor_start = time.perf_counter(), time.process_time()
            stages = work(turn % FRAMES) or {}
            processor = 1000 * (time.process_time() - processor_start)
            taken.append({'matcher': name, 'processor': processor,
                          'milliseconds': 1000 * (time.perf_counter() - start), **stages})
    return taken


def _kilobytes(name):
    return int(re.search(rf'^{name}:\s*(\d+)', STATUS.read_text(encoding='utf-8'),
                         re.MULTILINE)[1])
