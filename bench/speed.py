# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed: our matcher, cold and warm, against OpenCV's in turns; deadlines, memory, first start.

Figures are medians and 95th percentiles over frames, since the work of a warm matcher differs from
frame to frame; the matchers take turns.
"""
from functools import partial
import os
import subprocess
import sys
import tempfile
import time
import tracemalloc

from bench.busy import busy_table, FixedPlaces
from bench.cores import cores_table, UNMEASURED
from bench.draws import with_noise
from bench.request import report_of
from bench.scoring import REFERENCE
import cv2
from fuzzy_stereo_ros.commands.benchmark import take_turns
from fuzzy_stereo_ros.evaluation.baselines import grey, opencv_threads, TUNED
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.bands import processors
from fuzzy_stereo_ros.matching.realtime.still_scene import SETTLED
from fuzzy_stereo_ros.pairs.stereo_pair import number_of
import numpy as np
import pandas as pd

SIZES = ((480, 640, 64), (720, 1280, 128), (240, 320, 32))     # rows, columns, disparities
QUICK_SIZES = ((48, 80, 16), (72, 128, 32))
GROWING = ((240, 320, 32), (375, 450, 60), *SIZES[:1], (540, 960, 96), SIZES[1],
           (1080, 1920, 192), (1440, 2560, 256))
GROWING_REPEATS = 9
THREADS = (1, 2)
FRAMES = 4
NOISE = 1.5  # grey levels, fresh in every frame
OURS = FIRST, COLD, WARM = 'ours, first pair', 'ours, cold', 'ours, warm'
FAST = 'ours, profile fast, cold'
BM = 'BM tuned'
INTERVAL = MatcherConfig.still_interval
LATE = 0.95         # of the turns take at most this long
ALONE = 'of the total, what one thread does alone'
PREFERRED = ('midd2014', 'midd2006_half', 'middv2', 'made')
SHARES = 0.5, 0.9, 0.95, 1.0, 1.1, 2.0      # deadlines, of the median time without one
SETTLING = 12       # frames of a still scene until all operators may run
IMPORT = 'from fuzzy_stereo_ros.matching import StereoMatcher'
WARM_UP = f'{IMPORT}; StereoMatcher().warm_up(480, 640)'


def run(request):
    """Return the `Report` of times at each size, with one and two threads."""
    scenes, _ = request.scenes()
    scene = min(scenes, key=lambda one: [*PREFERRED, one.group].index(one.group))
    pair = scene.read()
    sizes, growing = (QUICK_SIZES, QUICK_SIZES) if request.quick else (SIZES, GROWING)
    threads = [count for count in THREADS if count <= processors()]
    skipped = [f'{count} threads: there is one core' for count in THREADS
               if count not in threads]
    rounds = [(size, count) for size in sizes for count in threads]
    turns = [turn for size, count in request.follow(rounds, 'speed')
             for turn in race(request, pair, size, count, request.repeats)]
    memory = Table('Memory', ('', 'held [MB]', 'bytes a pixel', 'more during a frame [MB]',
                              'the pair itself [MB]'),
                   [memory_row(request, pair, size) for size in sizes],
                   'Held: by a warm matcher between frames, its state among it. More: at the peak '
                   'of a frame, what it returns and hands on among it.')
    growth = growth_table([
        growth_row(request, pair, size, threads)
        for size in request.follow(growing, 'sizes')])
    cores = cores_table(
        ((f'{columns}x{rows}, {disparities} disparities', noisy_frames(pair, rows, columns),
          disparities) for rows, columns, disparities in request.follow(growing, 'cores')),
        {'realtime': request.ours, 'fast': Ours('fast', 'fast')})
    still = still_table([still_row(request, pair, size, count)
                         for size in sizes for count in threads])
    deadlines = deadline_table(request, pair, sizes[0])
    busy = beside_busy_processes(request, pair, sizes[0], threads)
    if request.quick:
        skipped.append('the first start: it takes a minute')
    return report_of('speed', 'Speed', {
        'ours': f'{request.ours.description}, filled: colour images in; disparity to sub-pixels, '
                'filled and filtered, and confidence out',
        'baselines': 'tuned for Middlebury, with their own speckle filter; timed is compute() '
                     'alone of a matcher that is made once, on grey images without padding; '
                     'conversion to grey and from sixteenths, filling and median do not count',
        'pair': f'{scene.path}, resized, with fresh noise of {NOISE} grey levels in each frame',
        'times': f'medians and 95th percentiles of {request.repeats} turns; first pair: '
                 'everything before is forgotten, so that the offset of the rows is measured '
                 'first; cold: the frame before is forgotten; warm: the frame before is of the '
                 'same scene, and each frame is searched; cold and warm frames measure no rows',
    }, [*tables(pd.DataFrame(turns)), growth, cores, still, busy, deadlines, memory,
        *([] if request.quick else [first_start_table()])], skipped,
        threads='OpenCV and ours as in the tables')


def race(request, pair, size, threads, repeats, names=None):
    """
    Return the turns of matchers, dicts of `take_turns` with size and threads.

    names: of the matchers; None for all
    """
    rows, columns, disparities = size
    frames = noisy_frames(pair, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    makers = {name: partial(_ours, request.ours, frames, disparities, threads, name)
              for name in OURS}
    makers[FAST] = partial(_ours, Ours(FAST, 'fast'), frames, disparities, threads, COLD)
    makers.update((baseline.name, partial(_baseline, baseline, greys, disparities))
                  for baseline in reversed(TUNED))
    with opencv_threads(threads):
        works = {name: make() for name, make in makers.items() if name in (names or makers)}
        return [{'size': f'{columns}x{rows}', 'disparities': disparities, 'threads': threads,
                 **turn} for turn in take_turns(works, repeats, FRAMES)]


def noisy_frames(pair, rows, columns):
    """Return FRAMES pairs (left, right) of a size, each with new noise: uint8 (R, C, 3)."""
    random = np.random.default_rng(0)
    images = [cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
              for image in (pair.left, pair.right)]
    return [tuple(with_noise(image, NOISE, random) for image in images) for _ in range(FRAMES)]


def _ours(ours, frames, disparities, threads, name, places=None):
    """
    Return a function that matches a frame, and returns {stage: milliseconds}.

    places: where helping threads run; None for the matcher's own rule
    """
    matcher = ours.matcher(
        disparities, threads=threads, warm_start=True, still_interval=1)
    matcher.warm_up(*frames[0][0].shape[:2])
    matcher.algorithm.pool.places = places or matcher.algorithm.pool.places

    def work(frame):
        if name == FIRST:
            matcher.restore(None)
        elif matcher.rows.pair:
            matcher.restore(None if name == COLD else matcher.state,
                            matcher.rows._replace(pair=UNMEASURED))
        pool, before = matcher.algorithm.pool, matcher.algorithm.pool.shared
        times = matcher.match(*frames[frame]).times
        return {**times, ALONE: times['total'] - (pool.shared - before)}
    return work


def _baseline(baseline, greys, disparities):
    """Return a function that matches a frame."""
    matcher = baseline.matcher(MIDDLEBURY, disparities)

    def work(frame):
        matcher.compute(*greys[frame])
    return work


def tables(turns):
    """Return the tables of a DataFrame of turns."""
    return [*(_race_table(f'{size}, {disparities} disparities', of_size) for (size, disparities),
              of_size in turns.groupby(['size', 'disparities'], sort=False)), _stage_table(turns)]


def _race_table(title, turns):
    """Return the table of a size: milliseconds of each matcher, and ratios to 3WAY."""
    names = turns.matcher.unique()
    grouped = turns.assign(cores=turns.processor / turns.milliseconds).groupby(
        ['matcher', 'threads'])
    typical, late, processor, cores = (figure.unstack().loc[names] for figure in (
        grouped.milliseconds.median(), grouped.milliseconds.quantile(LATE),
        grouped.processor.median(), grouped.cores.median()))
    table = pd.DataFrame({
        '1 thread [ms]': typical[1], '95th percentile [ms]': late[1],
        'of 3WAY': typical[1] / typical[1][REFERENCE.name],
        'processor time [ms]': processor[1],
        'of that of 3WAY': processor[1] / processor[1][REFERENCE.name]})
    if 2 in typical:
        table = table.assign(**{
            '2 threads [ms]': typical[2], '2 threads, 95th percentile [ms]': late[2],
            '2 threads, of 3WAY': typical[2] / typical[2][REFERENCE.name],
            '2 threads, faster by': typical[1] / typical[2],
            '2 threads, cores used': cores[2]})
    return Table.of(title, table,
                    'Medians where no percentile is named, ratios of medians. Processor time does '
                    'not run while other programs do. Cold and in OpenCV the work is the same in '
                    'each frame, so that a 95th percentile far above the median means that other '
                    'programs ran; warm frames differ in work themselves. Cores used far below 2 '
                    'with two threads, for all matchers alike, means that other programs had the '
                    'second.')


def _stage_table(turns):
    """Return the table of our stages: the median of each."""
    ours = turns[turns.matcher.isin((*OURS, FAST))]
    known = 'size', 'disparities', 'threads', 'matcher', 'milliseconds', 'processor', ALONE
    stages = ours.groupby(['size', 'threads', 'matcher'], sort=False)[
        [*(name for name in turns if name not in known), ALONE]].median().T
    stages.columns = [
        f"{size}, {name.removeprefix('ours, ')}, {number_of(threads, 'thread')}"
        for size, threads, name in stages.columns]
    stages.loc[f'{ALONE} [%]'] = 100 * stages.loc[ALONE] / stages.loc['total']
    return Table.of('Stages of our matcher, milliseconds', stages,
                    'The median of each stage over the turns.')


def growth_row(request, pair, size, threads):
    """Return a dict of the row of `growth_table` of a size; threads: numbers of threads."""
    rows, columns, disparities = size
    repeats = min(request.repeats, GROWING_REPEATS)
    found = {'': f'{columns}x{rows}, {disparities} disparities'}
    for count in threads:
        turns = pd.DataFrame(race(request, pair, size, count, repeats,
                                  (COLD, WARM, FAST, BM, REFERENCE.name)))
        typical = turns.groupby('matcher').milliseconds.median()
        found.update({f'{name}, {number_of(count, "thread")}': value for name, value in {
            'cold [ms]': typical[COLD],
            'ns a pixel': 1e6 * typical[COLD] / (rows * columns),
            'ns a pixel and disparity': 1e6 * typical[COLD] / (rows * columns * disparities),
            'of 3WAY': typical[COLD] / typical[REFERENCE.name],
            'of BM': typical[COLD] / typical[BM],
            'warm, of 3WAY': typical[WARM] / typical[REFERENCE.name],
            'fast [ms]': typical[FAST],
            'fast, of BM': typical[FAST] / typical[BM]}.items()})
    return found


def growth_table(rows):
    """Return the table of rows of `growth_row`: a row a figure, a column a size."""
    table = pd.DataFrame(rows).set_index('').T
    return Table.of('How time grows with the size', table,
                    f'Medians of {GROWING_REPEATS} turns, ratios of medians; all matchers cold '
                    'and of the profile realtime where nothing else is named.')


def still_row(request, pair, size, threads):
    """Return a dict of the row of `still_table` of a size and a number of threads."""
    rows, columns, disparities = size
    frames = noisy_frames(pair, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    with opencv_threads(threads):
        matcher = request.ours.matcher(disparities, threads=threads, warm_start=True)
        for number in range(SETTLED + 1):
            matcher.match(*frames[number % FRAMES])

        def keeps(number, frame):
            return {'reused': matcher.match(*frames[(frame + number) % FRAMES]).reused}

        names = [f'frame {number}' for number in range(INTERVAL)]
        turns = pd.DataFrame(take_turns({
            **{name: partial(keeps, number) for number, name in enumerate(names)},
            REFERENCE.name: _baseline(REFERENCE, greys, disparities)}, request.repeats, FRAMES))
    of_reference = turns.matcher == REFERENCE.name
    reference, ours = turns.milliseconds[of_reference].median(), turns[~of_reference]
    of_kind = ours.groupby(ours.reused.astype(bool)).milliseconds
    found = {'': f'{columns}x{rows}, {disparities} disparities', 'threads': threads}
    for kept, name in ((False, 'searched'), (True, 'kept')):
        found[f'{name} [ms]'] = of_kind.median().get(kept)
        found[f'{name}, 95th percentile [ms]'] = of_kind.quantile(LATE).get(kept)
    mean = ours.groupby('matcher').milliseconds.median().mean()
    return {**found, 'mean of all frames [ms]': mean, f'{REFERENCE.name} [ms]': reference,
            'of 3WAY': mean / reference}


def still_table(rows):
    """Return the table of rows of `still_row`."""
    return Table(
        'A scene that stands still', tuple(rows[0]), [tuple(row.values()) for row in rows],
        f'From frame {SETTLED + 1} on, with noise: one frame in {INTERVAL} is searched '
        '(`still_interval`), the others keep its result. Medians; the mean is that of the '
        f'medians of {INTERVAL} frames that follow each other.')


def deadline_table(request, pair, size):
    """Return the table of warm frames of a still scene, with and without deadlines."""
    rows, columns, disparities = size
    frames, found = noisy_frames(pair, rows, columns), {}

    def matches(deadline_ms):
        matcher = request.ours.matcher(
            disparities, warm_start=True, still_interval=1, deadline_ms=deadline_ms)
        return [matcher.match(*frames[number % FRAMES])
                for number in range(SETTLING + request.repeats)][SETTLING:]

    free = matches(0.0)
    whole = float(np.median([match.times['total'] for match in free]))
    for name, deadline in {'none': None, **{
            f'{share:.2f} of that': share * whole for share in SHARES}}.items():
        chosen = matches(deadline) if deadline else free
        total = np.array([match.times['total'] for match in chosen])
        found[name] = {
            '[ms]': deadline, 'frame taken, median [ms]': np.median(total),
            'worst [ms]': total.max(),
            'share in time': np.mean(total <= deadline) if deadline else None,
            'operators that ran, median': np.median([len(match.gains) for match in chosen])}
    least = min(match.times['total'] - match.times['generations'] for match in free)
    return Table.of(f'Deadlines, warm, {columns}x{rows}, {disparities} disparities',
                    pd.DataFrame(found).T,
                    f'What always runs takes {least:.1f} ms at the least; no earlier deadline can '
                    'be kept. Times as they pass: other programs make them longer.')


def beside_busy_processes(request, pair, size, threads):
    """Return the table of cold frames beside busy processes; threads: numbers of threads."""
    rows, columns, disparities = size
    frames = noisy_frames(pair, rows, columns)
    greys = [tuple(grey(image) for image in frame) for frame in frames]
    works = {f'{COLD}, {count} thread' + 's' * (count > 1):
             _ours(request.ours, frames, disparities, count, COLD) for count in reversed(threads)}
    places = {'helpers apart': True, 'helpers anywhere': False} if len(threads) > 1 else {}
    works.update((name, _ours(request.ours, frames, disparities, threads[-1], COLD,
                              FixedPlaces(apart))) for name, apart in places.items())
    works[REFERENCE.name] = _baseline(REFERENCE, greys, disparities)
    with opencv_threads(threads[-1]):
        return busy_table(works, FRAMES, request.quick, places)


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
    return (f'{columns}x{rows}, {disparities} disparities', held / 1e6, held / (rows * columns),
            more / 1e6, sum(image.nbytes for image in images) / 1e6)


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
