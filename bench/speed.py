# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed: our matcher, cold, warm and still, against OpenCV's in turns; memory, first start.

Figures are medians and 95th percentiles over frames, since the work of a warm matcher differs from
frame to frame; the matchers take turns. Stages, and what more cores would bring, go to CSV files.
"""
from functools import partial
from io import StringIO
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
import tracemalloc
from types import SimpleNamespace

from bench.cores import reckoned, UNMEASURED
from bench.draws import with_noise
from bench.request import report_of, Request
from bench.scoring import REFERENCE
import cv2
from fuzzy_stereo_ros.commands.benchmark import FRAMES, NOISE, take_turns
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads, TUNED
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import environment, Table
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.bands import processors
from fuzzy_stereo_ros.matching.realtime.still_scene import SETTLED
from fuzzy_stereo_ros.matching.row_offsets import grey
import numpy as np
import pandas as pd

SIZES = ((480, 640, 64), (720, 1280, 128), (240, 320, 32))     # rows, columns, disparities
QUICK_SIZES = ((48, 80, 16), (72, 128, 32))
THREADS = (1, 2)
OURS = FIRST, COLD, WARM = 'ours, first pair', 'ours, cold', 'ours, warm'
FAST = 'ours, profile fast, cold'
INTERVAL = MatcherConfig.still_interval
LATE = 0.95         # of the turns take at most this long
ALONE = 'of the total, what one thread does alone'
PREFERRED = ('midd2014', 'midd2006_half', 'middv2', 'made')
IMPORT = 'from fuzzy_stereo_ros.matching import StereoMatcher'
WARM_UP = f'{IMPORT}; StereoMatcher().warm_up(480, 640)'
TURNS = 'import sys; from bench.speed import print_turns; print_turns(*sys.argv[1:])'
VERSIONS = 'versions'


def run(request):
    """Return the `Report` of times at each size, with one and two threads."""
    scenes, _ = request.scenes()
    scene = min(scenes, key=lambda one: [*PREFERRED, one.group].index(one.group))
    pair = scene.read()
    sizes = QUICK_SIZES if request.quick else SIZES
    threads = [count for count in THREADS if count <= processors()]
    skipped = [f'{count} threads: there is one core' for count in THREADS
               if count not in threads]
    rounds = [(size, count) for size in sizes for count in threads]
    turns = pd.DataFrame([turn for size, count in request.follow(rounds, 'speed')
                          for turn in race(request, pair, size, count, request.repeats)])
    still = still_table([still_row(request, pair, size) for size in sizes])
    memory = Table('Memory', ('', 'held [MB]', 'more during a frame [MB]'),
                   [memory_row(request, pair, size) for size in sizes],
                   'Held: by a warm matcher between frames, its state among it. More: at the peak '
                   'of a frame, what it returns and hands on among it.')
    cores = reckoned(
        ((f'{columns}x{rows}, {disparities} disparities', noisy_frames(pair, rows, columns),
          disparities) for rows, columns, disparities in request.follow(sizes, 'cores')),
        {'realtime': request.ours, 'fast': Ours('fast', 'fast')})
    if request.quick:
        skipped.append('the first start: it takes a minute')
    return report_of('speed', 'Speed', {
        'ours': f'{request.ours.description}, filled: colour images in; disparity to sub-pixels, '
                'filled and filtered, and confidence out',
        'baselines': 'tuned for Middlebury, with their own speckle filter; timed is compute() '
                     'alone of a matcher that is made once, on grey images without padding; '
                     'conversion to grey and from sixteenths, filling and median do not count',
        'pair': f'{scene.path}, resized, with fresh noise of {NOISE} grey levels in each frame',
        'times': f'medians and 95th percentiles of {request.repeats} turns, ratios of medians; '
                 'first pair: everything before is forgotten, so that the offset of the rows is '
                 'measured first; cold: the frame before is forgotten; warm: the frame before is '
                 'of the same scene, and each frame is searched; the offset of the rows is that '
                 f'of {UNMEASURED} pairs before, and not measured again',
    }, [times_table(turns), *([versions_table(request, pair)] if request.python else []), still,
        memory, *([] if request.quick else [first_start_table()])], skipped,
        threads='OpenCV and ours as in the tables', turns=turns, cores=cores)


def race(request, pair, size, threads, repeats):
    """Return the turns of matchers, dicts of `take_turns` with size and threads."""
    rows, columns, disparities = size
    frames = noisy_frames(pair, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    makers = {name: partial(_ours, request.ours, frames, disparities, threads, name)
              for name in OURS}
    makers[FAST] = partial(_ours, Ours(FAST, 'fast'), frames, disparities, threads, COLD)
    makers.update((baseline.name, partial(_baseline, baseline, greys, disparities))
                  for baseline in reversed(TUNED) if baseline.algorithm != 'SGBM')
    with opencv_threads(threads):
        works = {name: make() for name, make in makers.items()}
        return [{'size': f'{columns}x{rows}', 'disparities': disparities, 'threads': threads,
                 **turn} for turn in take_turns(works, repeats)]


def noisy_frames(pair, rows, columns):
    """Return FRAMES pairs (left, right) of a size, each with new noise: uint8 (R, C, 3)."""
    random = np.random.default_rng(0)
    images = [cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
              for image in (pair.left, pair.right)]
    return [tuple(with_noise(image, NOISE, random) for image in images) for _ in range(FRAMES)]


def _ours(ours, frames, disparities, threads, name):
    """Return a function that matches a frame, and returns {stage: milliseconds}."""
    matcher = ours.matcher(
        disparities, threads=threads, warm_start=True, still_interval=1)
    matcher.warm_up(*frames[0][0].shape[:2])
    for number in range(UNMEASURED):        # after these the rows of a rig are known
        matcher.match(*frames[number % FRAMES])

    def work(frame):
        if name == FIRST:
            matcher.restore(None)
        else:
            matcher.restore(None if name == COLD else matcher.state,
                            matcher.rows._replace(pair=UNMEASURED))
        pool, before = matcher.algorithm.pool, matcher.algorithm.pool.shared
        times = matcher.match(*frames[frame]).times
        return {**times, ALONE: times['total'] - (pool.shared - before)}
    return work


def _baseline(baseline, greys, disparities):
    """Return a function that matches a frame."""
    matcher = baseline.matcher(MIDDLEBURY, disparities).opencv

    def work(frame):
        matcher.compute(*greys[frame])
    return work


def times_table(turns):
    """Return the table of a DataFrame of turns: milliseconds, and ratios to 3WAY."""
    place, ms = ['size', 'disparities', 'matcher'], 'milliseconds'
    typical, late = (figure.unstack('threads', sort=False) for figure in (
        turns.groupby([*place, 'threads'], sort=False)[ms].median(),
        turns.groupby([*place, 'threads'], sort=False)[ms].quantile(LATE)))
    table = pd.DataFrame({'1 thread [ms]': typical[1], '95th percentile [ms]': late[1]})
    reference = typical.xs(REFERENCE.name, level='matcher')
    for threads, start in zip(THREADS, ('', '2 threads, ')):
        if threads in typical:
            table[f'{start}of 3WAY'] = typical[threads] / reference[threads].reindex(
                typical.index.droplevel('matcher')).values
    return Table.of('Times', table.set_axis([
        f'{size}, {disparities} disparities: {name}' for size, disparities, name in table.index]))


def versions_table(request, pair):
    """Return the table of times with the libraries of this Python and of another one."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, image in (('left', pair.left), ('right', pair.right)):
            cv2.imwrite(f'{folder}/{name}.png', image)
        for python in sys.executable, request.python:
            printed = subprocess.run(
                [python, '-c', TURNS, folder, str(request.repeats), str(int(request.quick))],
                check=True, stdout=subprocess.PIPE, text=True,
                cwd=Path(__file__).resolve().parents[1]).stdout
            turns = pd.read_csv(StringIO(printed))
            of_one = turns.groupby('matcher').milliseconds.median()
            rows.append((turns[VERSIONS][0], *(of_one[name] for name in (COLD, WARM)),
                         *(of_one[name] / of_one[REFERENCE.name]
                           for name in (FIRST, COLD, WARM, FAST))))
    return Table('Versions of the libraries', (
        '', 'cold [ms]', 'warm [ms]', 'first pair, of 3WAY', 'cold, of 3WAY', 'warm, of 3WAY',
        'fast, cold, of 3WAY'), rows,
        'The first size above, one thread, ours as it is by default; each row is measured in a '
        "process of its own, 3WAY that of the row's OpenCV.")


def print_turns(folder, repeats, quick):
    """Print the turns of matchers, of a pair in a folder, as CSV; used by `versions_table`."""
    pair = SimpleNamespace(**{name: cv2.imread(f'{folder}/{name}.png')
                              for name in ('left', 'right')})
    sizes = QUICK_SIZES if int(quick) else SIZES
    turns = pd.DataFrame(race(Request(), pair, sizes[0], 1, int(repeats)))
    versions = environment('1')[VERSIONS].replace('not installed', 'as here')
    turns.assign(**{VERSIONS: versions}).to_csv(sys.stdout)


def still_row(request, pair, size):
    """Return a dict of the row of `still_table` of a size."""
    rows, columns, disparities = size
    frames = noisy_frames(pair, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    with opencv_threads(1):
        matcher = request.ours.matcher(disparities, warm_start=True)
        for number in range(SETTLED + 1):
            matcher.match(*frames[number % FRAMES])

        def keeps(number, frame):
            return {'reused': matcher.match(*frames[(frame + number) % FRAMES]).reused}

        names = [f'frame {number}' for number in range(INTERVAL)]
        turns = pd.DataFrame(take_turns({
            **{name: partial(keeps, number) for number, name in enumerate(names)},
            REFERENCE.name: _baseline(REFERENCE, greys, disparities)}, request.repeats))
    of_reference = turns.matcher == REFERENCE.name
    reference, ours = turns.milliseconds[of_reference].median(), turns[~of_reference]
    of_kind = ours.groupby(ours.reused.astype(bool)).milliseconds.median()
    mean = ours.groupby('matcher').milliseconds.median().mean()
    return {'': f'{columns}x{rows}, {disparities} disparities',
            'searched [ms]': of_kind.get(False), 'kept [ms]': of_kind.get(True),
            'mean of all frames [ms]': mean, 'of 3WAY': mean / reference}


def still_table(rows):
    """Return the table of rows of `still_row`."""
    return Table(
        'A scene that stands still', tuple(rows[0]), [tuple(row.values()) for row in rows],
        f'One thread, from frame {SETTLED + 1} on, with noise: one frame in {INTERVAL} is '
        'searched (`still_interval`), the others keep its result. Medians; mean: of the '
        f'medians of {INTERVAL} frames that follow each other.')


def memory_row(request, pair, size):
    """Return a row: the size, memory of a matcher between frames, and more during a frame."""
    rows, columns, disparities = size
    images = noisy_frames(pair, rows, columns)[0]
    _match_twice(request, images, disparities)      # loads what all matchers share
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        matcher = _match_twice(request, images, disparities)
        held = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        matcher.match(*images)
        more = tracemalloc.get_traced_memory()[1] - held
        held -= before
    finally:
        tracemalloc.stop()
    return f'{columns}x{rows}, {disparities} disparities', held / 1e6, more / 1e6


def _match_twice(request, images, disparities):
    """Return a matcher after a cold and a warm frame."""
    matcher = request.ours.matcher(disparities, warm_start=True)
    for _ in range(2):
        matcher.match(*images)
    return matcher


def first_start_table():
    """Return the table of seconds until a new process can match its first frame."""
    with tempfile.TemporaryDirectory() as cache:
        rows = [('first ever: all kernels are compiled', process_seconds(WARM_UP, cache)),
                ('again: kernels come from the cache', process_seconds(WARM_UP, cache)),
                ('of these, Python and the import alone', process_seconds(IMPORT, cache))]
    return Table('Before the first frame, in a new process', ('', 'seconds'), rows,
                 'With profile realtime: grey and coloured images of 8 and of 16 bits.')


def process_seconds(program, cache):
    """Return the seconds that a Python process takes for a program; cache: of its kernels."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, '-c', program], check=True,
                   env={**os.environ, 'NUMBA_CACHE_DIR': cache})
    return time.perf_counter() - begun
