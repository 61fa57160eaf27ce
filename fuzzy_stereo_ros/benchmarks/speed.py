# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed: our matcher, cold and warm, against OpenCV's, taken in turns in one run.

Other programs make times longer, never shorter: the minimum counts, and as all matchers take
turns, ratios hold where times do not.
"""
import os

import cv2
from fuzzy_stereo_ros.benchmarks.datasets import with_noise
from fuzzy_stereo_ros.benchmarks.request import report_of, take_turns, TimedMatcher
from fuzzy_stereo_ros.evaluation.baselines import grey, opencv_threads, tuned_baselines
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np

SIZES = ((480, 640, 64), (720, 1280, 128))      # rows, columns, disparities
QUICK_SIZES = ((48, 80, 16), (72, 128, 32))
THREADS = (1, 2)
FRAMES = 4
NOISE = 1.5  # grey levels, fresh in every frame
COLD, WARM, REFERENCE = 'ours, cold', 'ours, warm', '3WAY tuned'
ALONE = 'of the total, what one thread does alone'
PREFERRED = ('midd2014', 'midd2006_half', 'middv2', 'made')


def run(request):
    """Return the `Report` of times at each size, with one and with two threads."""
    scenes, _ = request.scenes()
    scene = min(scenes, key=lambda one: [*PREFERRED, one.group].index(one.group))
    pair = scene.read()
    threads = [count for count in THREADS if count <= (os.cpu_count() or 1)]
    skipped = [f'{count} threads: there is one core' for count in THREADS
               if count not in threads]
    rounds = [(size, count) for size in (QUICK_SIZES if request.quick else SIZES)
              for count in threads]
    timed = {(size, count): race(request, pair, size, count)
             for size, count in request.follow(rounds, 'speed')}
    return report_of('speed', 'Speed', {
        'ours': f'{request.subject}, filled: colour images in; disparity to sub-pixels, filled '
                'and filtered, and confidence out',
        'baselines': 'tuned for Middlebury, with their own speckle filter, on grey images of the '
                     'size as it is; without padding, conversion, filling and median',
        'pair': f'{scene.path}, resized, with fresh noise of {NOISE} grey levels in each frame',
        'times': f'minimum of {request.repeats} turns; cold: the frame before is forgotten; '
                 'warm: the frame before is of the same scene',
    }, tables(timed), skipped, threads='OpenCV and ours as in the tables')


def race(request, pair, size, threads):
    """Return the `TimedMatcher`s after all their turns."""
    rows, columns, disparities = size
    frames = noisy_frames(pair, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    with opencv_threads(threads):
        matchers = [_ours(request, frames, disparities, threads, name) for name in (COLD, WARM)]
        matchers += [_baseline(baseline, greys, disparities)
                     for baseline in reversed(tuned_baselines(MIDDLEBURY))]
        take_turns(matchers, request.repeats, FRAMES)
    return matchers


def noisy_frames(pair, rows, columns):
    """Return (left, right) of a size, FRAMES times with fresh noise: uint8 (R, C, 3)."""
    random = np.random.default_rng(0)
    images = [cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
              for image in (pair.left, pair.right)]
    return [tuple(with_noise(image, NOISE, random) for image in images) for _ in range(FRAMES)]


def _ours(request, frames, disparities, threads, name):
    matcher = request.matcher(disparities, threads=threads, warm_start=True)
    matcher.warm_up(*frames[0][0].shape[:2])

    def work(frame):
        if name == COLD:
            matcher.reset()
        pool, before = matcher.algorithm.pool, matcher.algorithm.pool.shared
        times = matcher.match(*frames[frame]).times
        return {**times, ALONE: times['total'] - (pool.shared - before)}
    return TimedMatcher(name, work)


def _baseline(baseline, greys, disparities):
    matcher = baseline.matcher(disparities)

    def work(frame):
        matcher.compute(*greys[frame])
    return TimedMatcher(baseline.name, work)


def tables(timed):
    """Return the tables of {(size, threads): `TimedMatcher`s}."""
    return [*(_race_table(size, {count: {one.name: one for one in matchers} for (
        other, count), matchers in timed.items() if other == size})
        for size in dict.fromkeys(size for size, _ in timed)), _stage_table(timed)]


def _race_table(size, by_threads):
    """Return the table of one size: milliseconds and ratios to 3WAY for each matcher."""
    rows, columns, disparities = size
    alone, together = by_threads[1], by_threads.get(2)
    headings = ['', '1 thread [ms]', 'of 3WAY', 'median / minimum', 'processor time [ms]',
                'of that of 3WAY']
    if together:
        headings += ['2 threads [ms]', '2 threads, of 3WAY', '2 threads, median / minimum',
                     '2 threads, faster by', '2 threads, cores used']
    lines = []
    for name, one in alone.items():
        line = [name, one.best, one.best / alone[REFERENCE].best, _unrest(one),
                min(one.processor_times),
                min(one.processor_times) / min(alone[REFERENCE].processor_times)]
        if together:
            two = together[name]
            line += [two.best, two.best / together[REFERENCE].best, _unrest(two),
                     one.best / two.best, two.cores]
        lines.append(tuple(line))
    return Table(f'{columns}x{rows}, {disparities} disparities', tuple(headings), lines,
                 'Processor time does not run while other programs do. Median over minimum tells '
                 'how noisy the machine was: 1.00 is quiet. Cores used far below 2 with two '
                 'threads, for all matchers alike, means that other programs had the second.')


def _unrest(matcher):
    return float(np.median(matcher.times)) / matcher.best


def _stage_table(timed):
    """Return the table of our stages, each at its fastest."""
    ours = {f'{size[1]}x{size[0]}, {one.name.split()[-1]}, {threads} thread'
            + 's' * (threads > 1): one.stages for (size, threads), matchers in timed.items()
            for one in matchers if one.name in (COLD, WARM)}
    names = dict.fromkeys(name for stages in ours.values() for name in stages if name != ALONE)
    alone = [(ALONE, *(stages[ALONE] for stages in ours.values())),
             (f'{ALONE} [%]', *(100 * stages[ALONE] / stages['total']
                                for stages in ours.values()))]
    return Table('Stages of our matcher, milliseconds', ('', *ours),
                 [*((name, *(stages.get(name) for stages in ours.values())) for name in names),
                  *alone],
                 'The minimum of each stage over the turns. More threads than bands earn nothing: '
                 'there are two from 128 rows, four from 640 and eight from 1280.')
