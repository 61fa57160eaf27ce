# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Cost: how time and memory grow, what threads, compiling and a deadline do.

A cell is a pixel at a disparity. Scenes are made for their size, and fill their disparities.
"""
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from fuzzy_stereo_ros.benchmarks import cost_picture
from fuzzy_stereo_ros.benchmarks.compiling import compile_table
from fuzzy_stereo_ros.benchmarks.cost_tables import growth_table, race_table
from fuzzy_stereo_ros.benchmarks.deadline import deadline_table
from fuzzy_stereo_ros.benchmarks.memory import memory_row, memory_table
from fuzzy_stereo_ros.benchmarks.picture import as_svg
from fuzzy_stereo_ros.benchmarks.speed import Contestant
from fuzzy_stereo_ros.evaluation.baselines import grey, opencv_threads, tuned_rivals
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.synthetic.scenes import made_pair
import numpy as np

COLD, WARM, RIVAL = 'ours, cold', 'ours, warm', '3WAY'


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

    inside: those whose threads and memory are looked at. in_a_hurry: the one with deadlines.
    """

    pixels: tuple
    disparities: tuple
    both: tuple
    inside: tuple
    in_a_hurry: Size


_BOTH = (Size(240, 320, 32, 32), Size(480, 640, 64, 64), Size(720, 1280, 128, 128),
         Size(1080, 1920, 256, 256))
# Kernels take 32 disparities at once: those around a multiple share a scene.
FULL = Plan(
    tuple(Size(*shape, 64, 64) for shape in ((240, 320), (480, 640), (720, 1280), (1080, 1920))),
    tuple(Size(480, 640, *pair) for pair in (
        (16, 16), (31, 31), (32, 31), (33, 31), (48, 48), (63, 63), (64, 63), (65, 63), (96, 96),
        (97, 96), (128, 128), (192, 192), (256, 256))),
    _BOTH, _BOTH[1:], _BOTH[1])
QUICK = Plan(
    (Size(40, 72, 16, 16), Size(80, 144, 16, 16)),
    (Size(40, 72, 16, 16), Size(40, 72, 32, 31), Size(40, 72, 33, 31)),
    (Size(40, 72, 16, 16), Size(40, 72, 32, 31)), (Size(40, 72, 16, 16),), Size(40, 72, 16, 16))


class _Step(NamedTuple):
    path: str
    work: object


def run(request):
    """Return the `Report` of what a frame costs."""
    plan = QUICK if request.quick else FULL
    steps = [_Step('over pixels', partial(race, request, plan.pixels)),
             _Step('over disparities', partial(race, request, plan.disparities)),
             _Step('over both', partial(race, request, plan.both)),
             _Step('threads', lambda: [threads_row(request, *one) for one in
                                       ((size, warm) for size in plan.inside
                                        for warm in (False, True))]),
             _Step('memory', lambda: [memory_row(request, size) for size in plan.inside]),
             _Step('deadline', lambda: deadline_table(plan.in_a_hurry, request.repeats)),
             *([] if request.quick else [_Step('compiling', compile_table)])]
    pixels, disparities, both, threads, memory, *others = (
        step.work() for step in request.follow(steps, 'cost'))
    settings = {
        **environment('one each, unless said otherwise'),
        'ours': f'{request.subject}, filled; cold: the frame before is forgotten',
        'rival': f'{RIVAL}, tuned for Middlebury, with its own speckle filter, on grey images; '
                 'without padding, conversion, filling and median',
        'scenes': 'made for each size, coloured; their disparities fill those that are searched '
                  '(31, 32 and 33 disparities share the scene of 31, and so on)',
        'times': f'median of {request.repeats} turns, all sizes of a table in turns; on one '
                 'thread that of the processor, which does not run while other programs do',
    }
    found = [
        race_table(f'Over pixels, {plan.pixels[0].disparities} disparities', pixels),
        race_table(f'Over disparities, {plan.disparities[0].frame}', disparities),
        race_table('Over both', both),
        growth_table({'pixels': pixels, 'disparities': disparities, 'both': both}),
        Table('Two threads', ('', '1 thread [ms]', '2 threads [ms]', 'faster by', 'bits'), threads,
              'Bits: of disparity and confidence.'),
        memory_table(memory), *others]
    pictures, missing = as_svg('cost.svg', partial(cost_picture.draw, found))
    if request.quick:
        missing = [*missing, 'compiling: it takes a minute']
    return Report('cost', 'Cost', settings, found, missing, pictures)


def race(request, sizes):
    """
    Return {size: {contestant: median milliseconds of the processor}}; all take turns.

    With one thread that is the time that passes, but for what other programs take of it.
    """
    with opencv_threads(1):
        entered = {size: _contestants(request, size) for size in sizes}
        for turn in range(request.repeats):
            for contestants in entered.values():
                for contestant in contestants:
                    contestant.take_turn(turn)
    return {size: {one.name: float(np.median(one.processor_times)) for one in contestants}
            for size, contestants in entered.items()}


def _contestants(request, size):
    """Return the contestants, each having had a first turn that takes memory."""
    pair = size.pair()
    rival = next(one for one in tuned_rivals(MIDDLEBURY) if one.algorithm == RIVAL)
    theirs, greys = rival.matcher(size.disparities), [grey(image) for image in pair]

    def matching(warm):
        matcher = request.matcher(size.disparities, warm_start=warm)
        return lambda _: matcher.match(*pair).times

    def computing(_):
        theirs.compute(*greys)

    made = [Contestant(COLD, matching(False)), Contestant(WARM, matching(True)),
            Contestant(RIVAL, computing)]
    for contestant in made:
        contestant.work(0)
    return made


def threads_row(request, size, warm):
    """Return name, times on one and two threads, their ratio, and whether the bits are equal."""
    pair, found = size.pair(), {}

    def matching(count):
        matcher = request.matcher(size.disparities, warm_start=warm, threads=count)

        def match(_):
            found[count] = matcher.match(*pair)
        return match

    contestants = [Contestant(str(count), matching(count)) for count in (1, 2)]
    equal = True
    for turn in range(request.repeats + 1):     # the first takes memory
        for contestant in contestants:
            contestant.take_turn(turn)
        equal = equal and _bits(found[1]) == _bits(found[2])
    alone, together = (float(np.median(one.times[1:])) for one in contestants)
    return (f"{size.name}, {'warm' if warm else 'cold'}", alone, together, alone / together,
            'equal' if equal else 'DIFFERENT')


def _bits(match):
    return match.disparity.tobytes(), match.confidence.tobytes()
