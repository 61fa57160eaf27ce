# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
By what more cores than there are would make a frame faster.

A computer of many cores is reckoned: the parts of each join are timed one after the other in one
thread, and each core that is free takes the first part whose needs have ended; what lies between
joins stays in one thread, and each join costs what it costs here with two threads.
"""
from functools import partial
from heapq import heapreplace
import math
import time

from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.matching.bands import cut_parts, ThreadPool
from fuzzy_stereo_ros.matching.row_alignment import rig_of, Rows
import numpy as np
import pandas as pd

TURNS = 7           # frames of each size
CORES = 2, 4, 8, 16
JOINS = 300         # whose cost is measured
PART = 40_000       # roots of such a join, about 0.05 ms
UNMEASURED = 9      # number of a pair whose rows are not measured, see row_alignment.FIRST


class TimedPool(ThreadPool):
    """
    A pool of one thread, whose work is cut as for a number of cores.

    joins: [[(ms, need)]], of each part of each call of `run`: its processor time, and how many of
    the first parts it needs; within: ms of all of them and of the clock that times them
    """

    def __init__(self, cores):
        """Begin without joins."""
        super().__init__(1)
        self.joins, self.within, self._cores = [], 0.0, cores

    def parts(self, rows, height=1, each=1):
        """Return the parts of an image for the cores."""
        return cut_parts(rows, self._cores, height, each)

    def run(self, work, items, needs):
        """Work as ThreadPool does, and time each item."""
        times, started = [], time.thread_time()

        def timed(item):
            begun = time.thread_time()
            work(item)
            times.append(1000 * (time.thread_time() - begun))
        super().run(timed, items, needs)
        self.joins.append(list(zip(times, needs)))
        self.within += 1000 * (time.thread_time() - started)


def scheduled(parts, cores):
    """
    Return when the last of some parts ends, if each free core takes the first that may begin: ms.

    parts: [(ms, need)]; a part may begin once the first `need` parts have ended
    """
    free, left, ends = [0.0] * cores, list(range(len(parts))), [math.inf] * len(parts)
    while left:
        now = free[0]
        index = next((index for index in left
                      if max(ends[:parts[index][1]], default=0.0) <= now), None)
        if index is None:
            heapreplace(free, min(end for end in ends if end > now))
        else:
            left.remove(index)
            ends[index] = now + parts[index][0]
            heapreplace(free, ends[index])
    return max(ends, default=0.0)


def together(joins, alone, cores, cost):
    """
    Return how long a frame takes on a number of cores: ms.

    joins: [[(ms, need)]], parts of each join; alone: ms between the joins; cost: ms of a join of
    several parts
    """
    return alone + sum(scheduled(parts, cores) + cost * (cores > 1 and len(parts) > 1)
                       for parts in joins)


def cost_of_a_join():
    """Return by how much two threads take longer for two equal parts than one for one: ms."""
    pools, work = [ThreadPool(1), ThreadPool(2)], partial(np.sqrt, np.ones(PART))
    found = []
    for _ in range(JOINS):
        for number, pool in enumerate(pools, 1):
            begun = time.perf_counter()
            pool.each(lambda _: work(), range(number))
            found.append(1000 * (time.perf_counter() - begun))
    for pool in pools:
        pool.close()
    one, two = np.median(np.reshape(found, (-1, 2)), axis=0)
    return max(two - one, 0.0)


def reckoned(sizes, profiles):
    """
    Return a DataFrame of how many times faster a frame is on more cores, by size and profile.

    sizes: an iterable of (name, frames, disparities), frames: pairs of images; profiles: {name:
    `Ours`}
    """
    cost = cost_of_a_join()
    with opencv_threads(1):
        return pd.DataFrame([
            {'size': size, 'profile': name, **reckon(ours.matcher(disparities), frames, cost)}
            for size, frames, disparities in sizes for name, ours in profiles.items()])


def time_alone(matcher, pool, rows, frame):
    """Match a cold frame with a TimedPool; return what lies between its joins: ms."""
    matcher.algorithm.pool = pool
    matcher.restore(None, rows)
    begun = time.thread_time()
    matcher.match(*frame)
    return 1000 * (time.thread_time() - begun) - pool.within


def reckon(matcher, frames, cost):
    """Return {column: number} of a row, the medians of cold frames; cost: ms of a join."""
    rows, found = Rows(pair=UNMEASURED, rig=rig_of(frames[0][0], None)), []
    matcher.warm_up(*frames[0][0].shape[:2])
    for number in range(TURNS):
        times = {}
        for cores in (1, *CORES):
            frame, pool = frames[number % len(frames)], TimedPool(cores)
            alone = time_alone(matcher, pool, rows, frame)
            times[cores] = together(pool.joins, alone, cores, cost)
        found.append({f'{cores} cores, faster by': times[1] / times[cores] for cores in CORES})
    return pd.DataFrame(found).median().to_dict()
