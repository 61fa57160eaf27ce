# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A program that matches pairs where each array lies against a forbidden page.

Arguments: `before` or `behind`, where that page lies; a profile, or `read` or `write` instead,
which reach one byte beyond an array; and how many kinds of images are matched in each size.
"""
from dataclasses import replace
import gc
import os
import sys

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels.simd import LANES, load, lowest, store
from guarded_memory import GuardedMemory
from numba import njit
import numpy as np

# rows, columns, disparities, min_disparity
SIZES = [(2, 2, 1, 0), (2, 2, 2, -2048), (3, 5, 5, -3), (2, 70, 33, -20), (40, 31, 9, -200),
         (17, 63, 63, 0), (63, 97, 64, 2), (131, 129, 128, 0), (9, 310, 256, 5),
         (9, 310, 257, -150), (20, 513, 512, 2048)]
KINDS = [(np.uint8, ()), (np.uint16, (3,)), (np.uint8, (3,)), (np.uint16, ())]
CHANGES = {'realtime': {}, 'quality': {'warm_start': True},
           'paper': {'population': 4, 'generations': 2}}


@njit
def reach(array, at, writing):
    """Read or write a vector of an array from an element on; no bounds are checked."""
    if writing:
        store(array, at, load(array, 0))
    return lowest(load(array, at))


def match_all(profile, kinds):
    """Match noise of every size, of some kinds, each twice, the second time warm."""
    chance = np.random.default_rng(0)
    for number, (rows, columns, disparities, min_disparity) in enumerate(SIZES):
        config = replace(
            MatcherConfig.from_profile(profile, **CHANGES[profile]), disparities=disparities,
            min_disparity=min_disparity, fill=number % 2 == 0, threads=1, speckle_size=9)
        for kind, channels in (KINDS[number % 4:] + KINDS)[:kinds]:
            images = [chance.integers(0, np.iinfo(kind).max, (rows, columns, *channels), kind,
                                      endpoint=True) for _ in range(2)]
            matcher = StereoMatcher(config)
            for _ in range(2):
                matcher.match(*images)
        gc.collect()


def main():
    """Run, print how many arrays were guarded and overwritten around, and end at once."""
    where, what, kinds = sys.argv[1:]
    memory = GuardedMemory(where == 'before')
    memory.begin()
    if what in CHANGES:
        match_all(what, int(kinds))
    else:
        array = np.zeros(100, np.uint8)
        reach(array, 100 - LANES, False)
        beyond = -1 if (where == 'before') == (what == 'read') else 101 - LANES
        reach(array, beyond, what == 'write')
        del array
    print(memory.guarded, memory.overwritten, flush=True)
    os._exit(0)     # when the interpreter ends it frees arrays after what is called for that


if __name__ == '__main__':
    main()
