# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed: our matcher, cold and warm, against OpenCV's, taken in turns in one run.

Other programs make times longer, never shorter: the minimum counts, and as all contestants take
turns, ratios hold where times do not.
"""
from collections.abc import Callable
from dataclasses import dataclass, field
import os
import time

import cv2
from fuzzy_stereo_ros.evaluation.baselines import grey, opencv_threads, tuned_rivals
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
import numpy as np

SIZES = ((480, 640, 64), (720, 1280, 128))
QUICK_SIZES = ((48, 80, 16), (72, 128, 32))
THREADS = (1, 2)
FRAMES = 4
NOISE = 1.5  # grey levels, fresh in every frame
COLD, WARM, YARDSTICK = 'ours, cold', 'ours, warm', '3WAY tuned'
PREFERRED = ('midd2014', 'midd2006_half', 'middv2', 'made')


@dataclass
class Contestant:
    """
    Someone whose time is taken.

    work: called with a frame's number; may return {stage: milliseconds}.
    times: milliseconds of each turn; processor_times: the same, of all threads together, not
    counting while other programs ran; stages: the minimum of each stage that was returned.
    """

    name: str
    work: Callable
    times: list = field(default_factory=list)
    processor_times: list = field(default_factory=list)
    stages: dict = field(default_factory=dict)

    def take_turn(self, frame):
        """Take the time of one frame."""
        start, processor_start = time.perf_counter(), time.process_time()
        stages = self.work(frame)
        self.processor_times.append(1000 * (time.process_time() - processor_start))
        self.times.append(1000 * (time.perf_counter() - start))
        for stage, milliseconds in (stages or {}).items():
            self.stages[stage] = min(milliseconds, self.stages.get(stage, milliseconds))

    @property
    def best(self):
        """The fastest turn, in milliseconds."""
        return min(self.times)

    @property
    def cores(self):
        """How many cores worked on average in the fastest turn."""
        return self.processor_times[int(np.argmin(self.times))] / self.best


def run(request):
    """Return the `Report` of times at each size, with one and with two threads."""
    sizes = QUICK_SIZES if request.quick else SIZES
    scenes, skipped = request.scenes()
    scene = min(scenes, key=lambda one: [*PREFERRED, one.group].index(one.group))
    known = scene.read()
    possible = [count for count in THREADS if count <= (os.cpu_count() or 1)]
    skipped = [f'{count} threads: there is one core' for count in THREADS
               if count not in possible]
    settings = environment('OpenCV and ours as in the tables')
    rounds = [(size, threads) for size in sizes for threads in possible]
    found = {}
    for size, threads in request.follow(rounds, 'speed'):
        found[size, threads] = race(request, known, size, threads)
    settings.update({
        'ours': f'{request.subject}, filled: colour images in; disparity to sub-pixels, filled '
                'and filtered, and confidence out',
        'rivals': 'tuned for Middlebury, with their own speckle filter, on grey images of the '
                  'size as it is; without padding, conversion, filling and median',
        'pair': f'{scene.path}, resized, with fresh noise of {NOISE} grey levels in each frame',
        'times': f'minimum of {request.repeats} turns; cold: the frame before is forgotten; '
                 'warm: the frame before is of the same scene',
    })
    return Report('speed', 'Speed', settings, tables(found), skipped)


def race(request, known, size, threads):
    """Return the `Contestant`s after all their turns."""
    rows, columns, disparities = size
    frames = noisy_frames(known, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    with opencv_threads(threads):
        contestants = [_ours(request, frames, disparities, threads, name)
                       for name in (COLD, WARM)]
        contestants += [_rival(rival, greys, disparities)
                        for rival in reversed(tuned_rivals(MIDDLEBURY))]
        for contestant in contestants:
            contestant.work(0)
        for turn in range(request.repeats):
            for contestant in contestants:
                contestant.take_turn(turn % len(frames))
    return contestants


def noisy_frames(known, rows, columns):
    """Return (left, right) of a size, FRAMES times with fresh noise: uint8 (R, C, 3)."""
    chance = np.random.default_rng(0)
    pair = [cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
            for image in (known.left, known.right)]
    return [tuple(with_noise(image, NOISE, chance) for image in pair) for _ in range(FRAMES)]


def with_noise(image, sigma, chance):
    """Return an image uint8 with normal noise of sigma grey levels, alike in its channels."""
    if not sigma:
        return np.ascontiguousarray(image)
    noise = sigma * chance.standard_normal(image.shape[:2], np.float32)
    noise = noise if image.ndim == 2 else noise[:, :, None]
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


def _ours(request, frames, disparities, threads, name):
    matcher = request.matcher(disparities, threads=threads, warm_start=True)
    matcher.warm_up(*frames[0][0].shape[:2])

    def work(frame):
        if name == COLD:
            matcher.reset()
        return matcher.match(*frames[frame]).times
    return Contestant(name, work)


def _rival(rival, greys, disparities):
    matcher = rival.matcher(disparities)

    def work(frame):
        matcher.compute(*greys[frame])
    return Contestant(rival.name, work)


def tables(found):
    """Return the tables of {(size, threads): contestants}."""
    made = []
    for size in dict.fromkeys(size for size, _ in found):
        by_threads = {threads: {one.name: one for one in contestants}
                      for (other, threads), contestants in found.items() if other == size}
        made.append(_race_table(size, by_threads))
    made.append(_stage_table(found))
    return made


def _race_table(size, by_threads):
    """Return the table of one size: milliseconds and ratios to 3WAY for each contestant."""
    rows, columns, disparities = size
    alone, together = by_threads[1], by_threads.get(2)
    headings = ['', '1 thread [ms]', 'of 3WAY', 'median / minimum', 'processor time [ms]',
                'of that of 3WAY']
    if together:
        headings += ['2 threads [ms]', '2 threads, of 3WAY', '2 threads, median / minimum',
                     '2 threads, faster by', '2 threads, cores used']
    lines = []
    for name, one in alone.items():
        line = [name, one.best, one.best / alone[YARDSTICK].best, _unrest(one),
                min(one.processor_times),
                min(one.processor_times) / min(alone[YARDSTICK].processor_times)]
        if together:
            two = together[name]
            line += [two.best, two.best / together[YARDSTICK].best, _unrest(two),
                     one.best / two.best, two.cores]
        lines.append(tuple(line))
    return Table(f'{columns}x{rows}, {disparities} disparities', tuple(headings), lines,
                 'Processor time does not run while other programs do. Median over minimum tells '
                 'how noisy the machine was: 1.00 is quiet. Cores used far below 2 with two '
                 'threads, for all contestants alike, means that other programs had the second.')


def _unrest(contestant):
    return float(np.median(contestant.times)) / contestant.best


def _stage_table(found):
    """Return the table of our stages, each at its fastest."""
    chosen = {(size, threads, one.name): one for (size, threads), contestants in found.items()
              for one in contestants if one.name in (COLD, WARM)}
    stages = dict.fromkeys(stage for one in chosen.values() for stage in one.stages)
    columns = [f'{size[1]}x{size[0]}, {name.split()[-1]}, {threads} thread' + 's' * (threads > 1)
               for size, threads, name in chosen]
    return Table('Stages of our matcher, milliseconds', ('', *columns),
                 [(stage, *(one.stages.get(stage) for one in chosen.values()))
                  for stage in stages], 'The minimum of each stage over the turns.')
