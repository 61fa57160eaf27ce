# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sub-pixel disparities, confidence, and what the user gets."""
from types import SimpleNamespace

from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import cut_bands, ThreadPool
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import CONSISTENT, INVALID
from fuzzy_stereo_ros.matching.kernels.refinement.subpixel import CLEAR_MARGIN
from fuzzy_stereo_ros.matching.realtime.refinement import AROUND, LEAST_SURE, Refinement, RIGHT
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_refinement as twins

POOL = ThreadPool(1)
DUE = np.array([0, 6, 24], np.uint8)


def no_reliance(shape):
    return np.zeros(shape, np.uint8), DUE


def chosen_at_random(shape, disparities, seed):
    """Return what the scanline guess chooses, a validity and final labels near the chosen."""
    dtype = np.uint8 if disparities <= 256 else np.uint16
    labels = random_map(shape, disparities, seed, dtype)
    near = labels.astype(np.int64) + random_map(shape, 4, seed + 1) - 1
    final = np.clip(near, 0, disparities - 1).astype(dtype)
    final[::2, 1:] = final[::2, :-1]
    return SimpleNamespace(
        labels=labels, offsets=random_map(shape, 17, seed + 2).astype(np.int8) - np.int8(8),
        sums=random_map(shape, 256, seed + 3), margins=random_map(shape, 256, seed + 4),
    ), random_map(shape, 3, seed + 5), final


def written(shape, disparities, seed=0, validity=None, **changes):
    """Return what the user gets, and what the twin makes of the same."""
    chosen, random_validity, final = chosen_at_random(shape, disparities, seed)
    validity = random_validity if validity is None else np.full(shape, validity, np.uint8)
    config = MatcherConfig(disparities=disparities, **changes)
    refinement = Refinement(shape[1], disparities, final.dtype, cut_bands(shape[0]))
    refinement.settled[:] = validity
    reliance = random_map(shape, 3, seed + 6)
    disparity, confidence = refinement.write(POOL, final, chosen, (reliance, DUE), config)
    fine = twins.fine_disparities(final, chosen.labels, chosen.offsets, validity)
    sure = twins.confidence(twins.certainty(
        chosen.sums, np.maximum(chosen.margins.astype(int) - DUE[reliance], 0), validity),
        validity)
    return disparity, confidence, fine, sure, validity


def check(shape, disparities, seed=0, **changes):
    disparity, confidence, fine, sure, validity = written(shape, disparities, seed, **changes)
    right = np.where(sure >= LEAST_SURE, np.interp(10 * sure, range(11), RIGHT), 0)
    np.testing.assert_allclose(confidence, right, atol=1e-4)
    # Where the twin's certainty is rounded otherwise, the threshold decides by the kernel's.
    config = MatcherConfig(disparities=disparities, **changes)
    np.testing.assert_array_equal(disparity, twins.disparities_of(
        fine, validity, confidence, config.min_disparity, disparities, config.fill,
        np.float32(max(config.confidence_threshold, LEAST_SURE))))


@pytest.mark.parametrize('shape', [(1, 1), (1, 9), (9, 1), (2, 2), (7, 33)])
@pytest.mark.parametrize('disparities', [1, 2, 64, 256, 257, 1999, 2000, 4096])
def test_disparities_and_confidence_are_those_of_the_twin(shape, disparities):
    check(shape, disparities)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 8), st.integers(1, 20), st.integers(-300, 300), st.booleans(),
       st.floats(0, 1), st.integers(0, 99))
def test_any_range_fill_and_threshold(rows, columns, min_disparity, fill, threshold, seed):
    check((rows, columns), 6, seed, min_disparity=min_disparity, fill=fill,
          confidence_threshold=threshold)


def test_labels_in_the_middle_of_their_like_move_by_the_mean_of_their_offsets():
    final = np.full((5, 5), 20, np.uint8)
    offsets = np.zeros((5, 5), np.int8)
    offsets[1, 1], offsets[4, 4] = 8, 5
    chosen = SimpleNamespace(labels=final, offsets=offsets, sums=final, margins=final)
    refinement = Refinement(5, 64, np.uint8, cut_bands(5))
    disparity, _ = refinement.write(
        POOL, final, chosen, no_reliance(final.shape), MatcherConfig())
    assert disparity[2, 2] == 20 + 1 / 16       # 13 / 25 of a sixteenth, rounded
    assert disparity[0, 0] == 20 + 1 / 16       # 8 / 9
    assert disparity[0, 4] == 20


def test_confidence_is_0_where_not_consistent_and_never_below_or_above_1():
    for seed in range(5):
        for validity in (None, CONSISTENT):
            _, confidence, _, _, validity = written((30, 40), 64, seed, validity=validity)
            assert not confidence[validity != CONSISTENT].any()
            assert confidence.min() >= 0
            assert confidence.max() <= 1


@pytest.mark.parametrize('margin, valid', [(0, 0), (1, 1)])
def test_only_where_nothing_is_known_a_pixel_is_refused_without_a_threshold(margin, valid):
    labels = np.full((19, 19), 7, np.uint8)
    margins = np.zeros((19, 19), np.uint8)
    margins[9, 9] = margin
    chosen = SimpleNamespace(labels=labels, offsets=np.zeros((19, 19), np.int8),
                             sums=np.full((19, 19), 255, np.uint8), margins=margins)
    refinement = Refinement(19, 64, np.uint8, cut_bands(19))
    disparity, _ = refinement.write(
        POOL, labels, chosen, no_reliance(labels.shape), MatcherConfig())
    assert np.count_nonzero(disparity == 7) == valid * AROUND**2
    assert np.count_nonzero(np.isnan(disparity)) == 19**2 - valid * AROUND**2


def test_a_pixel_as_sure_as_the_threshold_stays_valid():
    labels = np.full((4, 5), 7, np.uint8)
    chosen = SimpleNamespace(labels=labels, offsets=np.zeros((4, 5), np.int8),
                             sums=np.zeros((4, 5), np.uint8),
                             margins=np.full((4, 5), CLEAR_MARGIN, np.uint8))
    refinement = Refinement(5, 64, np.uint8, cut_bands(4))
    reliance = no_reliance(labels.shape)
    confidence = float(refinement.write(
        POOL, labels, chosen, reliance, MatcherConfig())[1][0, 0])
    assert confidence == pytest.approx(RIGHT[5], abs=1e-6)
    for threshold, known in ((confidence, True), (confidence + 1e-4, False)):
        disparity, _ = refinement.write(
            POOL, labels, chosen, reliance, MatcherConfig(confidence_threshold=threshold))
        assert (np.isfinite(disparity) == known).all()


def test_a_fill_leaves_nothing_invalid():
    disparity, confidence, *_ = written((8, 9), 64, fill=True, validity=INVALID,
                                        confidence_threshold=1.0)
    assert np.all(np.isfinite(disparity))
    assert not confidence.any()


def test_confidence_is_the_least_of_lines_as_the_table_is_never_bent_upwards():
    assert np.diff(RIGHT, 2).max() < 1e-9
