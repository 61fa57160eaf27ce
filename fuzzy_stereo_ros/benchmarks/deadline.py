# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How far a frame goes beyond its deadline: never more than the operator that ran as it passed."""
from itertools import pairwise
import time
from typing import NamedTuple

from fuzzy_stereo_ros.comparing.report import Table
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.evolution import always
from fuzzy_stereo_ros.matching.realtime.matcher import GuidedSearch
import numpy as np

DEADLINES = 5, 10, 20, 40, 80, 160, 320     # ms
ASKED = {'generations': 1000, 'population': 6, 'sweeps': 1}


class WatchedSearch(GuidedSearch):
    """
    The guided search, noting when it looked at the clock.

    looks: for each generation, the ns by `time.perf_counter_ns` at which an operator could start,
    and the end; between two of them no more than one ran. seeded: ns, when the seeds stood.
    """

    def start(self, left, right, state, seed_words):
        """Make the initial population of a pair."""
        self.looks = []
        super().start(left, right, state, seed_words)
        self.seeded = time.perf_counter_ns()

    def generation(self, number, in_time=always):
        """Make the next generation and return the gains."""
        looks = [time.perf_counter_ns()]
        self.looks.append(looks)

        def noted():
            looks.append(time.perf_counter_ns())
            return in_time()

        gains = super().generation(number, noted)
        looks.append(time.perf_counter_ns())
        return gains


class Frame(NamedTuple):
    """One frame in ms from its start: seeds stood, search ended, all done; and what it did."""

    seeds: float
    search: float
    total: float
    generations: int
    operator: float     # ms, the longest one; NaN where none ran


def frames(size, deadline_ms, repeats):
    """Return a `Frame` for each of some repetitions of a cold match with a deadline."""
    matcher = StereoMatcher(MatcherConfig(
        disparities=size.disparities, fill=True, threads=1, warm_start=False,
        deadline_ms=float(deadline_ms), **ASKED), WatchedSearch)
    pair = size.pair()
    matcher.warm_up(size.rows, size.columns)
    matcher.match(*pair)        # takes memory
    found = []
    for _ in range(repeats):
        begun = time.perf_counter_ns()
        match = matcher.match(*pair)
        search = matcher.search
        ended = search.looks[-1][-1] if search.looks else search.seeded
        spent = [after - before for looks in search.looks for before, after in pairwise(looks)]
        found.append(Frame((search.seeded - begun) / 1e6, (ended - begun) / 1e6,
                           match.times['total'], match.generations,
                           max(spent) / 1e6 if spent else float('nan')))
    return found


def deadline_row(size, deadline_ms, repeats):
    """Return a row of the table of deadlines."""
    found = frames(size, deadline_ms, repeats)
    seeds, search, total, generations, operator = np.transpose(found)
    late = max(max(0.0, one.search - max(deadline_ms, one.seeds)) for one in found)
    operators = operator[~np.isnan(operator)]
    return (f'{deadline_ms} ms', float(np.median(seeds)), float(np.median(search)),
            float(search.max()), late, float(operators.max()) if operators.size else None,
            int(np.median(generations)), float(np.median(total)), float(total.max()))


def deadline_table(size, repeats):
    """Return the table of deadlines on a made scene."""
    asked = ', '.join(f'{name} = {value}' for name, value in ASKED.items())
    return Table(f'Deadline, {size.name}', (
        'asked', 'seeds stand [ms]', 'search ends, median [ms]', 'worst [ms]',
        'overshoot, worst [ms]', 'longest operator [ms]', 'generations',
        'frame taken, median [ms]', 'worst [ms] '),
        [deadline_row(size, one, repeats) for one in DEADLINES],
        f'Profile realtime, cold, {asked}. Overshoot: from the deadline, or from the seeds where '
        'it had passed, to the end of the search. The seeds and the refinement after the search '
        'always run. A deadline that passes before the seeds stand leaves the seeds.')
