# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Cost: how time and memory grow, what threads and compiling do.

A cell is a pixel at a disparity. Scenes are made for their size, and fill their disparities.
"""
from dataclasses import dataclass
import os
import subprocess
import sys
import tempfile
import time
import tracemalloc
from typing import NamedTuple

from fuzzy_stereo_ros.benchmarks.pictures import draw_cost
from fuzzy_stereo_ros.benchmarks.request import report_of, take_turns, TimedMatcher
from fuzzy_stereo_ros.evaluation.baselines import grey, opencv_threads, tuned_3way
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.synthetic.scenes import made_pair
import numpy as np

COLD, WARM, BASELINE = 'ours, cold', 'ours, warm', '3WAY'
LANES = 32          # disparities that the kernels take at once
IMPORT = 'from fuzzy_stereo_ros.matching import StereoMatcher'
WARM_UP = f'{IMPORT}; StereoMatcher().warm_up(480, 640)'


class Size(NamedTuple):
    """The size of a pair, the disparities searched, and those that its scene has."""

    rows: int
    columns: int
    disparities: int
    filled: int

    @property
    def frame(self):
        """The size of the images as it is written in tables."""
        return f'{self.columns}x{self.rows}'

    @property
    def name(self):
        """The size as it is written in tables."""
        return f'{self.frame}x{self.disparities}'

    @property
    def pixels(self):
        """How many pixels there are."""
        return self.rows * self.columns

    @property
    def cells(self):
        """Pixels times disparities."""
        return self.pixels * self.disparities

    def pair(self):
        """Return (left, right), in colour; sizes that differ in `disparities` share a scene."""
        made = made_pair(self.rows, self.columns, self.filled, seed=1, objects=6, noise=1.5,
                         colour=True)
        return made.left, made.right


@dataclass(frozen=True)
class Plan:
    """
    The sizes that are measured.

    inside: those whose threads and memory are looked at.
    """

    pixels: tuple
    disparities: tuple
    both: tuple
    inside: tuple


_BOTH = (Size(240, 320, 32, 32), Size(480, 640, 64, 64), Size(720, 1280, 128, 128),
         Size(1080, 1920, 256, 256))
# Disparities around a multiple of LANES share a scene.
FULL = Plan(
    tuple(Size(*shape, 64, 64) for shape in ((240, 320), (480, 640), (720, 1280), (1080, 1920))),
    tuple(Size(480, 640, *pair) for pair in (
        (16, 16), (31, 31), (32, 31), (33, 31), (48, 48), (63, 63), (64, 63), (65, 63), (96, 96),
        (97, 96), (128, 128), (192, 192), (256, 256))),
    _BOTH, _BOTH[1:])
QUICK = Plan(
    (Size(40, 72, 16, 16), Size(80, 144, 16, 16)),
    (Size(40, 72, 16, 16), Size(40, 72, 32, 31), Size(40, 72, 33, 31)),
    (Size(40, 72, 16, 16), Size(40, 72, 32, 31)), (Size(40, 72, 16, 16),))


def run(request):
    """Return the `Report` of what a frame costs."""
    plan = QUICK if request.quick else FULL
    steps = {'over pixels': lambda: race(request, plan.pixels),
             'over disparities': lambda: race(request, plan.disparities),
             'over both': lambda: race(request, plan.both),
             'threads': lambda: [threads_row(request, size, warm) for size in plan.inside
                                 for warm in (False, True)],
             'memory': lambda: [memory_row(request, size) for size in plan.inside]}
    if not request.quick:
        steps['compiling'] = compile_table
    pixels, disparities, both, threads, memory, *others = (
        steps[name]() for name in request.follow(list(steps), 'cost'))
    tables = [
        race_table(f'Over pixels, {plan.pixels[0].disparities} disparities', pixels),
        race_table(f'Over disparities, {plan.disparities[0].frame}', disparities),
        race_table('Over both', both),
        growth_table({'pixels': pixels, 'disparities': disparities, 'both': both}),
        Table('Two threads', ('', '1 thread [ms]', '2 threads [ms]', 'faster by', 'bits'), threads,
              'Bits: of disparity and confidence.'),
        Table('Memory', ('', 'held [MB]', 'bytes a pixel', 'bytes a cell',
                         'more during a frame [MB]', 'bytes a pixel ',
                         'the pair itself, bytes a pixel'), memory,
              'Held: by a warm matcher between frames, its state among it. More: at the peak of a '
              'frame, what it returns and hands on among it.'), *others]
    return report_of('cost', 'Cost', {
        'ours': f'{request.subject}, filled; cold: the frame before is forgotten',
        'baseline': f'{BASELINE}, tuned for Middlebury, with its own speckle filter, on grey '
                    'images; without padding, conversion, filling and median',
        'scenes': 'made for each size, coloured; their disparities fill those that are searched '
                  '(31, 32 and 33 disparities share the scene of 31, and so on)',
        'times': f'median of {request.repeats} turns, all sizes of a table in turns; on one '
                 'thread that of the processor, which does not run while other programs do',
    }, tables, ['compiling: it takes a minute'] * request.quick, {'cost.svg': draw_cost},
        'one each, unless said otherwise')


def race(request, sizes):
    """
    Return {size: {matcher: median milliseconds of the processor}}; all take turns.

    With one thread that is the time that passes, but for what other programs take of it.
    """
    with opencv_threads(1):
        entered = {size: _matchers(request, size) for size in sizes}
        take_turns([one for matchers in entered.values() for one in matchers], request.repeats)
    return {size: {one.name: float(np.median(one.processor_times)) for one in matchers}
            for size, matchers in entered.items()}


def _matchers(request, size):
    """Return the matchers of a size."""
    pair = size.pair()
    baseline, greys = tuned_3way(MIDDLEBURY).matcher(size.disparities), [*map(grey, pair)]
    ours = {name: request.matcher(size.disparities, warm_start=name == WARM)
            for name in (COLD, WARM)}
    return [*(TimedMatcher(name, lambda _, matcher=matcher: matcher.match(*pair).times)
              for name, matcher in ours.items()),
            TimedMatcher(BASELINE, lambda _: baseline.compute(*greys) is None)]


def race_table(title, found):
    """Return the table of {size: {matcher: milliseconds}}; the last matcher is the baseline."""
    *ours, baseline = names = list(next(iter(found.values())))
    return Table(title, (
        '', *(f'{name} [ms]' for name in names), *(f'{name}, of {baseline}' for name in ours),
        *(f'{name} [ns a cell]' for name in names)),
        [(size.name, *times.values(), *(times[name] / times[baseline] for name in ours),
          *(1e6 * times[name] / size.cells for name in names))
         for size, times in found.items()], digits=3)


def growth_table(races):
    """
    Return the table of exponents and of steps at multiples of 32.

    races: {what grew: {size: {matcher: milliseconds}}}
    """
    names = list(next(iter(next(iter(races.values())).values())))
    rows = [(f'time over cells, exponent: {what} grow', *(
        exponent([(size.cells, times[name]) for size, times in found.items()])
        for name in names)) for what, found in races.items()]
    for found in races.values():
        rows += [(f'{after.disparities} disparities, to {before.disparities}',
                  *(found[after][name] / found[before][name] for name in names))
                 for before, after in steps_at_lanes(found)]
    return Table('Growth', ('', *names), rows,
                 'Exponent 1: as pixels x disparities, below 1: slower. The other lines are '
                 'ratios of times for one disparity more, on one scene.')


def exponent(points):
    """Return the slope of log time over log cells: float, NaN of fewer than two sizes."""
    if len(points) < 2:
        return float('nan')
    cells, times = np.log(np.transpose(points))
    return float(np.polyfit(cells, times, 1)[0])


def steps_at_lanes(sizes):
    """Return the pairs of sizes that differ by the one disparity behind a multiple of 32."""
    pairs = [(size._replace(disparities=size.disparities - 1), size) for size in sizes
             if size.disparities % LANES == 1]
    return [(before, after) for before, after in pairs if before in sizes]


def threads_row(request, size, warm):
    """Return name, times on one and two threads, their ratio, and whether the bits are equal."""
    pair, bits = size.pair(), {1: [], 2: []}

    def matching(count):
        matcher = request.matcher(size.disparities, warm_start=warm, threads=count)

        def work(_):
            match = matcher.match(*pair)
            bits[count].append((match.disparity.tobytes(), match.confidence.tobytes()))
        return TimedMatcher(str(count), work)

    matchers = [matching(count) for count in bits]
    take_turns(matchers, request.repeats)
    alone, together = (float(np.median(one.times)) for one in matchers)
    return (f"{size.name}, {'warm' if warm else 'cold'}", alone, together, alone / together,
            'equal' if bits[1] == bits[2] else 'DIFFERENT')


def memory_row(request, size):
    """Return name, bytes held by a matcher and more during a frame, by pixel and by cell."""
    pair = size.pair()
    images = sum(image.nbytes for image in pair)
    _match_twice(request, size, pair)       # what is loaded once for all is no part of it
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        matcher = _match_twice(request, size, pair)
        held = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        matcher.match(*pair)
        more = tracemalloc.get_traced_memory()[1] - held
        held -= before
    finally:
        tracemalloc.stop()
    return (size.name, held / 1e6, held / size.pixels, held / size.cells, more / 1e6,
            more / size.pixels, images / size.pixels)


def _match_twice(request, size, pair):
    """Return a matcher after a cold and a warm frame."""
    matcher = request.matcher(size.disparities, warm_start=True)
    for _ in range(2):
        matcher.match(*pair)
    return matcher


def compile_table():
    """Return the table of seconds until a new process could match its first frame."""
    with tempfile.TemporaryDirectory() as cache:
        rows = [('first ever: all kernels are compiled', process_seconds(WARM_UP, cache)),
                ('again: kernels come from the cache', process_seconds(WARM_UP, cache)),
                ('of these, Python and the import alone', process_seconds(IMPORT, cache))]
    return Table('Before the first frame, in a new process', ('', 'seconds'), rows,
                 'With profile realtime: grey and coloured images of 8 and of 16 bits.')


def process_seconds(program, cache):
    """Return how long a Python process takes for a program, its kernels kept in a folder."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, '-c', program], check=True,
                   env={**os.environ, 'NUMBA_CACHE_DIR': cache})
    return time.perf_counter() - begun
