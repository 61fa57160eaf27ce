# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A warm start is safe, and worth it."""
# Every frame is matched warm, after the frames before it, and cold; errors are percent of the
# visible pixels, dense.
from itertools import pairwise, product

from fuzzy_stereo_ros.evaluation.scores import flicker
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
from made_scenes import matches_of, wrong
import numpy as np
import pytest
from real_pairs import motorcycle, moving_windows

MARGIN = 0.2        # points that a warm frame may be worse than a cold one
FRAMES = 6


def mostly_slow(names, values, quick):
    """Return the mark of all values of parameters, of which those that are not quick are slow."""
    return pytest.mark.parametrize(names, [
        pytest.param(*one, marks=[pytest.mark.slow] * (one not in quick)) for one in values])


def dense(frames, disparities, warm, **changes):
    """Return a dense match for each frame, with the previous best or without."""
    return matches_of(StereoMatcher(MatcherConfig(
        disparities=disparities, fill=True, warm_start=warm, threads=2, **changes)), frames)


# Noise; by how much the seed rises, and numbers of objects of both scenes.
CUTS = [(0.0, 10, (4, 4)), (6.0, 10, (4, 4)), (2.0, 0, (2, 5)), (2.0, 0, (5, 2))]


@mostly_slow('cut, seed', product(CUTS, range(4)), [*zip(CUTS, (0, 1, 0, 1))])
def test_another_scene_and_objects_that_appear_or_go_do_no_harm(cut, seed):
    """At the worst of three frames; rows are those of a rig, which is not measured anew."""
    noise, rise, objects = cut
    before, after = (make_pair(200, 320, 48, number, objects=count, noise=noise)
                     for number, count in zip((seed, seed + rise), objects))
    cold, = dense([after], 48, warm=False, align_rows=False)
    warm = dense([before] * 2 + [after] * 3, 48, warm=True, align_rows=False)[2:]
    assert max(wrong(one, after) for one in warm) <= wrong(cold, after) + MARGIN


def course(frames, disparities, pan, warm):
    """Return the means after the first frame: percent wrong, and percent changing, by > 1 px."""
    matches, changing = dense(frames, disparities, warm), []
    for (before, earlier), (after, later) in pairwise(zip(matches, frames)):
        moved = np.full_like(earlier.truth, np.nan)
        moved[:, :moved.shape[1] - pan] = earlier.truth[:, pan:]
        still = later.visible & (abs(moved - later.truth) < 0.5)
        changing.append(flicker(
            before.disparity, np.where(still, after.disparity, np.nan), (0, -pan)))
    return np.mean([*map(wrong, matches, frames)][1:]), np.mean(changing)


# Objects that move by themselves are in no average: their edges flicker as in a cold map. Little
# noise is as much as the versions of OpenCV differ in the made scene itself.
@pytest.mark.slow
@pytest.mark.parametrize('noise, share', [(3.0, 1.04), (6.0, 0.96), (12.0, 0.85)])
def test_made_moving_scenes_are_no_more_wrong_warm_and_flicker_less_in_noise(noise, share):
    """With objects that move by themselves while all pans by 2 px a frame."""
    scenes = [list(make_sequence(200, 320, 48, FRAMES, seed, noise=noise, pan=2.0, motion=1.0))
              for seed in range(12)]
    warm, cold = (np.mean([course(frames, 48, 2, warm) for frames in scenes], axis=0)
                  for warm in (True, False))
    assert warm[0] <= cold[0] + MARGIN
    assert warm[1] < share * cold[1]


@mostly_slow('pan, noise', product((0, 2, 8), (0.0, 3.0, 6.0)), [(2, 0.0), (8, 6.0)])
def test_the_motorcycle_through_a_moving_window_is_less_wrong_and_flickers_less_warm_in_noise(
        pan, noise):
    pair = motorcycle()
    frames = list(moving_windows(pair, 300, 480, pan, FRAMES, noise))
    warm, cold = (course(frames, pair.disparities, pan, warm) for warm in (True, False))
    assert warm[0] <= cold[0] + MARGIN
    if noise:
        assert warm[0] < {3.0: 0.9, 6.0: 0.82}[noise] * cold[0]
        assert warm[1] < 0.5 * cold[1]
