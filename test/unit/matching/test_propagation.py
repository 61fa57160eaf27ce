# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Propagation from the half-size chromosome: the kernel against its twin; the profile `fast`."""
from bench.scoring import bad_percent, ScoredPair
from census_scene import random_map, seen, small_pair, twin_costs
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import cut_bands, ThreadPool
from fuzzy_stereo_ros.matching.kernels.scanlines import propagation as kernels
from fuzzy_stereo_ros.matching.realtime.half_size import TILE
from fuzzy_stereo_ros.matching.realtime.possibility import FULL_SIZE
from fuzzy_stereo_ros.matching.realtime.propagation import Propagation
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type, prior_of
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_census
import reference_propagation as twins


def check(shape, disparities, parents_of=4, min_disparity=0, seed=0, threads=1):
    """Compare what is chosen with the twin; parents_of: how many labels the parent has."""
    left, right = small_pair(*shape, seed=seed)
    possibility = seen(left, right, disparities, min_disparity)
    first = min(disparities // 2, disparities - 1)
    parents = np.minimum(first + random_map(shape, parents_of, seed, np.int64), disparities - 1)
    parent = prior_of(parents.astype(gene_type(disparities)), random_map(shape, 2, seed),
                      disparities)
    propagation = Propagation(possibility, TILE)
    pool = ThreadPool(threads)
    chosen = propagation.search(pool, parent)
    grey = possibility.left.grey[:, :shape[1]].astype(np.int64)
    totals = twins.summed(
        twin_costs(left, right, disparities, min_disparity, FULL_SIZE), grey, kernels.SUM_RADIUS,
        kernels.NEIGHBOURS_ALIKE, kernels.SUM_PLACES)
    totals += twins.inheritance(
        parents, parent.weights, disparities, kernels.CUT, kernels.OWN, kernels.WEAK)
    expected = twins.propagated(
        np.minimum(totals, 255), parents, 2 * (half_disparities(disparities) - 1),
        [band[1:] for band in cut_bands(shape[0], TILE)],
        (kernels.TILE_ROWS, kernels.TILE_COLUMNS), kernels.GROW)
    for name, values in zip(('labels', 'offsets', 'sums', 'margins'), expected):
        np.testing.assert_array_equal(getattr(chosen, name), values, name)
    np.testing.assert_array_equal(chosen.target, reference_census.chosen_by_target(
        expected[0], expected[2], chosen.target.shape[1] - shape[1]), 'target')


@pytest.mark.parametrize('shape', [
    (1, 1), (1, 70), (9, 1), (5, 7), (17, 63), (16, 64), (20, 65), (7, 130)])
@pytest.mark.parametrize('disparities', [1, 2, 24])
def test_chosen_labels_of_every_size_are_those_of_the_twin(shape, disparities):
    check(shape, disparities)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.integers(1, 130), st.integers(1, 40), st.integers(1, 40),
       st.integers(-60, 9), st.integers(0, 99))
def test_any_size_range_and_parent_is_that_of_the_twin(
        rows, columns, disparities, parents_of, min_disparity, seed):
    check((rows, columns), disparities, parents_of, min_disparity, seed)


def test_more_candidates_than_a_byte_counts_leave_out_the_largest():
    check((20, 70), 700, parents_of=700)


def test_several_bands_and_threads_are_the_twin():
    check((130, 20), 12, threads=2)


# ---- the profile ----


def test_fast_is_close_to_the_truth_and_closer_than_its_parent_enlarged():
    known = ScoredPair(*make_pair(96, 160, 32, 1, objects=10, noise=1.5))
    fast = StereoMatcher(MatcherConfig.from_profile('fast', disparities=32, fill=True))
    match = fast.match(known.left, known.right)
    assert match.disparity.shape == known.left.shape[:2]
    assert 'propagation' in match.times
    assert 'scanlines' not in match.times
    half = known.left.shape[1] // 2, known.left.shape[0] // 2
    small = StereoMatcher(MatcherConfig(disparities=16, fill=True)).match(*(
        cv2.resize(image, half, interpolation=cv2.INTER_AREA)
        for image in (known.left, known.right)))
    enlarged = 2 * small.disparity.repeat(2, axis=0).repeat(2, axis=1)
    errors = [bad_percent(found, known, 1.0) for found in (match.disparity, enlarged)]
    assert errors[0] < 0.7 * errors[1]
    assert errors[0] < 7


def test_fast_averages_the_pictures_of_a_still_scene():
    """Noise falls from frame to frame, and with it the error."""
    frames = list(make_sequence(96, 160, 32, 4, 3, objects=4, noise=12))
    fast = StereoMatcher(MatcherConfig.from_profile('fast', disparities=32, fill=True))
    errors = [bad_percent(fast.match(frame.left, frame.right).disparity,
                          ScoredPair(*frame), 1.0) for frame in frames]
    assert errors[-1] < 0.7 * errors[0]
