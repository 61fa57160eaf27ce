# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Deadlines: whether a frame is out in time, and how far beyond it comes where it cannot be.

What always runs is the least that a frame takes: everything up to the first map, and what makes
a result of it. A profile that evolves for seconds ends with the operator that ran.
"""
from fuzzy_stereo_ros.benchmarks.datasets import with_noise
from fuzzy_stereo_ros.benchmarks.request import report_of
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import made_pair
import numpy as np

SIZE, QUICK_SIZE = (480, 640, 64), (40, 72, 16)     # rows, columns, disparities
SHARES = 0.5, 0.9, 0.95, 1.0, 1.1, 2.0      # of the median time without a deadline
MILLISECONDS = 20, 50, 100, 200, 500, 1000
PAPER = {'generations': 1000, 'population': 10}
NOISE, SETTLING = 1.5, 12       # grey levels; frames until all that may run does


def run(request):
    """Return the `Report` of deadlines: `realtime` on still noisy frames, `paper` cold."""
    rows, columns, disparities = QUICK_SIZE if request.quick else SIZE
    made = made_pair(rows, columns, disparities, colour=True)
    works = {'realtime': _realtime_table, 'paper': _paper_table}
    tables = request.each(list(works), 'deadline', lambda name: works[name](
        made, disparities, request.repeats))
    return report_of('deadline', 'Deadline', {
        'scene': f'made, {columns}x{rows}, {disparities} disparities',
        'times': f'{request.repeats} frames a row, as they pass: other programs make them longer',
    }, tables, [], threads='one')


def _realtime_table(made, disparities, repeats):
    """Return the table of warm frames of `realtime`, whose scene stands still."""
    free = _realtime_matches(made, disparities, 0.0, repeats)
    whole = float(np.median([match.times['total'] for match in free]))
    least = min(match.times['total'] - match.times['generations'] - match.times['evolution']
                for match in free)
    rows = [('none', None, whole, max(match.times['total'] for match in free), None, len(
        free[-1].gains))]
    for share in SHARES:
        deadline = share * whole
        found = _realtime_matches(made, disparities, deadline, repeats)
        total = [match.times['total'] for match in found]
        rows.append((f'{share:.2f} of that', deadline, float(np.median(total)), max(total),
                     float(np.mean([one <= deadline for one in total])),
                     int(np.median([len(match.gains) for match in found]))))
    return Table('Profile realtime, warm', (
        'deadline', '[ms]', 'frame taken, median [ms]', 'worst [ms]', 'share in time',
        'operators that ran, median'), rows,
        f'What always runs takes {least:.1f} ms at the least; no earlier deadline can be kept.')


def _realtime_matches(made, disparities, deadline_ms, repeats):
    """Return the last `repeats` matches of a still sequence with noise."""
    random = np.random.default_rng(1)
    matcher = StereoMatcher(MatcherConfig(disparities=disparities, threads=1,
                                          deadline_ms=float(deadline_ms)))
    return [matcher.match(*(with_noise(image, NOISE, random)
                            for image in (made.left, made.right)))
            for _ in range(SETTLING + repeats)][SETTLING:]


def _paper_table(made, disparities, repeats):
    asked = ', '.join(f'{name} = {value}' for name, value in PAPER.items())
    return Table('Profile paper, cold', (
        'asked', 'initial population [ms]', 'generations', 'frame taken, median [ms]',
        'worst [ms]', 'beyond the deadline, worst [ms]'),
        [_paper_row(made, disparities, one, repeats) for one in MILLISECONDS],
        f'{asked}. Beyond the deadline, or beyond the initial population where the deadline had '
        'passed: the operator that ran, and the refinement, which always runs.')


def _paper_row(made, disparities, deadline_ms, repeats):
    """Return a row of the table: cold matches of one pair."""
    matcher = StereoMatcher(MatcherConfig.from_profile(
        'paper', disparities=disparities, threads=1, deadline_ms=float(deadline_ms), **PAPER))
    matcher.match(made.left, made.right)        # takes memory
    found = [matcher.match(made.left, made.right) for _ in range(repeats)]
    total = [match.times['total'] for match in found]
    seeds = [total_ms - match.times['generations'] - match.times['refinement']
             for match, total_ms in zip(found, total)]
    return (f'{deadline_ms} ms', float(np.median(seeds)),
            int(np.median([match.generations for match in found])),
            float(np.median(total)), max(total),
            max(total_ms - max(deadline_ms, begun) for total_ms, begun in zip(total, seeds)))
