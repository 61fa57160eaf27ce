# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How far a frame goes beyond its deadline: never more than the operator that ran as it passed."""
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np

DEADLINES = 20, 50, 100, 200, 500, 1000     # ms
PROFILE, ASKED = 'paper', {'generations': 1000, 'population': 10}


def deadline_row(size, deadline_ms, repeats):
    """Return a row of the table of deadlines: cold matches of one pair."""
    matcher = StereoMatcher(MatcherConfig.from_profile(
        PROFILE, disparities=size.disparities, threads=1, deadline_ms=float(deadline_ms), **ASKED))
    pair = size.pair()
    matcher.warm_up(size.rows, size.columns)
    matcher.match(*pair)        # takes memory
    found = [matcher.match(*pair) for _ in range(repeats)]
    total = [match.times['total'] for match in found]
    seeds = [total_ms - match.times['generations'] - match.times['refinement']
             for match, total_ms in zip(found, total)]
    return (f'{deadline_ms} ms', float(np.median(seeds)),
            int(np.median([match.generations for match in found])),
            float(np.median(total)), max(total),
            max(total_ms - max(deadline_ms, begun) for total_ms, begun in zip(total, seeds)))


def deadline_table(size, repeats):
    """Return the table of deadlines on a made scene."""
    asked = ', '.join(f'{name} = {value}' for name, value in ASKED.items())
    return Table(f'Deadline, {size.name}', (
        'asked', 'initial population [ms]', 'generations', 'frame taken, median [ms]',
        'worst [ms]', 'beyond the deadline, worst [ms]'),
        [deadline_row(size, one, repeats) for one in DEADLINES],
        f'Profile {PROFILE}, {asked}. Beyond the deadline, or beyond the initial population where '
        'the deadline had passed: the operator that ran, and the refinement, which always runs.')
