# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A warm start is safe, and worth it."""
# Every frame is matched warm, after the frames before it, and cold; errors are percent of the
# visible pixels, dense.
from functools import cache
from itertools import product
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.scores import flicker, score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
import numpy as np
import pytest
from real_pairs import (
    motorcycle, moving_windows)

MARGIN = 0.2        # points that a warm frame may be worse than a cold one
FRAMES = 6
SCENES = range(4)


def mostly_slow(names, values, quick):
    """Return the mark of all values of parameters, of which those that are not quick are slow."""
    return pytest.mark.parametrize(names, [
        pytest.param(*one, marks=[pytest.mark.slow] * (one not in quick)) for one in values])


def disparities_of(frames, disparities, warm, **changes):
    """Yield a dense map for each frame, with the previous best or without."""
    matcher = StereoMatcher(MatcherConfig(
        disparities=disparities, fill=True, warm_start=warm, threads=2, **changes))
    for left, right, *_ in frames:
        yield matcher.match(left, right).disparity


# ---- safe: another scene, all at once or in part ----


def worst_after_cut(before, after, disparities, limit=1.0):
    """Return by how many points warm is worse at the worst of three frames after a cut."""
    # Rows are those of a rig: a cut is no other one, and they are measured slowly.
    cold, = disparities_of([after], disparities, warm=False, align_rows=False)
    *_, first, second, third = disparities_of(
        [before] * 2 + [after] * 3, disparities, warm=True, align_rows=False)
    return max(_bad(warm, *after[2:], limit) for warm in (first, second, third)) - _bad(
        cold, *after[2:], limit)


def _bad(disparity, truth, visible, limit):
    return score(disparity, truth, visible, (limit,)).bad_dense[limit]


@mostly_slow('noise, seed', product((0.0, 6.0), SCENES), [(0.0, 0), (6.0, 1)])
def test_a_cut_between_made_scenes_does_no_harm(noise, seed):
    before, after = (make_pair(200, 320, 48, scene, noise=noise) for scene in (seed, seed + 10))
    assert worst_after_cut(before, after, 48) <= MARGIN


@mostly_slow('before, after, seed', [(*counts, seed) for counts in ((2, 5), (5, 2))
                                     for seed in SCENES], [(2, 5, 0), (5, 2, 1)])
def test_objects_that_appear_or_go_do_no_harm(before, after, seed):
    frames = (make_pair(200, 320, 48, seed, objects=count, noise=2.0) for count in (before, after))
    assert worst_after_cut(*frames, 48) <= MARGIN


# ---- safe and worth it: the same scene, moving ----


class Course(NamedTuple):
    """Means over the frames after the first, in percent: wrong by > 1 px, changing by > 1 px."""

    wrong: float
    flicker: float


SHARES = {3.0: 0.9, 6.0: 0.82}     # of wrong pixels, warm by cold, by noise
QUICK_COURSES = (0, 3.0), (8, 6.0)  # pan, noise


@cache
def motorcycle_course(pan, noise, warm):
    """Follow the motorcycle through a window that moves."""
    pair = motorcycle()
    return _course(list(moving_windows(pair, 300, 480, pan, FRAMES, noise)), pair.disparities,
                   pan, warm)


def _course(frames, disparities, pan, warm):
    maps = list(disparities_of(frames, disparities, warm))
    wrong = [_bad(found, *frame[2:], 1.0) for found, frame in zip(maps, frames)]
    changing = []
    for (before, after), (earlier, later) in zip(zip(maps, maps[1:]), zip(frames, frames[1:])):
        moved = np.full_like(earlier[2], np.nan)
        moved[:, :moved.shape[1] - pan] = earlier[2][:, pan:]
        still = later[3] & (abs(moved - later[2]) < 0.5)
        changing.append(flicker(before, np.where(still, after, np.nan), (0, -pan)))
    return Course(float(np.mean(wrong[1:])), float(np.mean(changing)))


def made_course(noise, warm):
    """Follow made scenes that pan by 2 px a frame, with objects that move by themselves."""
    return Course(*np.mean([_course(list(make_sequence(
        200, 320, 48, FRAMES, seed, noise=noise, pan=2.0, motion=1.0)), 48, 2, warm)
        for seed in range(12)], axis=0))


# Objects that move by themselves are in no average: their edges flicker as in a cold map. Little
# noise is as much as the versions of OpenCV differ in the made scene itself.
@pytest.mark.slow
@pytest.mark.parametrize('noise, share', [(3.0, 1.04), (6.0, 0.96), (12.0, 0.85)])
def test_made_moving_scenes_are_no_more_wrong_warm_and_flicker_less_in_noise(noise, share):
    warm, cold = made_course(noise, True), made_course(noise, False)
    assert warm.wrong <= cold.wrong + MARGIN
    assert warm.flicker < share * cold.flicker


@mostly_slow('pan, noise', product((0, 2, 8), (0.0, 3.0, 6.0)), [(2, 0.0), *QUICK_COURSES])
def test_the_motorcycle_is_no_more_wrong_warm(pan, noise):
    cold, warm = motorcycle_course(pan, noise, False), motorcycle_course(pan, noise, True)
    assert warm.wrong <= cold.wrong + MARGIN


@mostly_slow('pan, noise', product((0, 2, 8), SHARES), QUICK_COURSES)
def test_the_motorcycle_through_a_moving_window_is_less_wrong_and_flickers_less_warm(pan, noise):
    warm, cold = (motorcycle_course(pan, noise, warm) for warm in (True, False))
    assert warm.wrong < SHARES[noise] * cold.wrong
    assert warm.flicker < 0.5 * cold.flicker
