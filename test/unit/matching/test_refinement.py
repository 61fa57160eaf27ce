# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Left-right consistency, speckles, fills, medians, sub-pixel disparities, and confidence."""
from types import SimpleNamespace

from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import check_consistency
from fuzzy_stereo_ros.matching.kernels.refinement.filling import fill_rows
from fuzzy_stereo_ros.matching.kernels.refinement.subpixel import CALIBRATION
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPossibility, extra_columns, FULL_SIZE)
from fuzzy_stereo_ros.matching.realtime.refinement import (
    CLASS_ALIKE, Refinement, reject_speckles)
from hypothesis import given, settings, strategies as st
import numpy as np
import reference_refinement as twins

POOL = ThreadPool(1)


@settings(max_examples=100)
@given(st.sampled_from([(np.uint8, 256), (np.uint16, 600)]), st.integers(1, 5),
       st.integers(1, 40), st.integers(-600, 5) | st.sampled_from([-2048, 2048]),
       st.integers(0, 99))
def test_validities_are_those_of_the_twin(kind, rows, columns, min_disparity, seed):
    """Of labels that point into the image, and of targets whose labels differ little from them."""
    (dtype, limit), shape = kind, (rows, columns)
    extra, inside = extra_columns(min_disparity, limit), (
        min_disparity, min_disparity + columns - 1)
    labels = np.clip(np.arange(columns) - min_disparity + 2 - random_map(
        shape, columns + 4, seed, np.int64), 0, limit - 1)
    target = random_map((rows, extra + columns), 256, seed, np.int64)
    pointed = np.clip(extra + np.arange(columns) - labels, 0, extra + columns - 1)
    np.put_along_axis(target, pointed, labels + random_map(shape, 5, seed + 1, int) - 2, axis=1)
    labels, target, validity = labels.astype(dtype), target.astype(np.uint8), np.full(
        shape, 9, np.uint8)
    check_consistency(labels, target, inside, validity, 0, rows)
    np.testing.assert_array_equal(validity, twins.validities(labels, target, inside))


@settings(max_examples=75)
@given(st.sampled_from([(np.uint8, 3), (np.uint8, 60), (np.uint8, 256), (np.uint16, 600)]),
       st.integers(1, 17), st.integers(1, 40), st.sampled_from([0, 0.1, 0.5, 0.9, 1]),
       st.integers(0, 2), st.integers(2, 30), st.integers(0, 999))
def test_speckles_fills_and_medians_are_those_of_the_twins(
        kind, rows, columns, share, step, smallest, seed):
    """Of maps from nothing rejected to everything, in steps small and wide."""
    (dtype, limit), shape = kind, (rows, columns)
    labels, grey = random_map(shape, limit, seed, dtype), random_map(shape, 50, seed + 1)
    validity = random_map(shape, INVALID, seed)
    validity[np.random.default_rng(seed).random(shape) < share] = INVALID
    found, filled = validity.copy(), np.full_like(labels, 77)
    reject_speckles(POOL, labels, found, step, smallest)
    np.testing.assert_array_equal(found, twins.without_speckles(labels, validity, step, smallest))
    fill_rows(labels, validity, filled, 0, rows)
    np.testing.assert_array_equal(filled, twins.filled_by_rows(labels, validity))
    if min(shape) > 1:
        refinement = Refinement(CensusPossibility(*shape, limit, FULL_SIZE), dtype)
        np.testing.assert_array_equal(
            refinement.smooth(POOL, labels, labels, grey),
            twins.median_of_25(twins.membership_median(labels, grey, CLASS_ALIKE)))


@settings(max_examples=80)
@given(st.integers(1, 9), st.integers(1, 33),
       st.sampled_from([1, 2, 6, 64, 256, 257, 1999, 2000, 4096]), st.integers(-300, 300),
       st.booleans(), st.floats(0, 1), st.integers(0, 99))
def test_disparities_and_confidence_are_those_of_the_twin(
        rows, columns, disparities, min_disparity, fill, threshold, seed):
    config = MatcherConfig(disparities=disparities, min_disparity=min_disparity, fill=fill,
                           confidence_threshold=threshold)
    shape, dtype = (rows, columns), np.uint8 if disparities <= 256 else np.uint16
    labels = random_map(shape, disparities, seed, dtype)
    chosen = SimpleNamespace(
        labels=labels, offsets=random_map(shape, 17, seed + 2).astype(np.int8) - np.int8(8),
        sums=random_map(shape, 256, seed + 3), margins=random_map(shape, 256, seed + 4))
    validity, near = random_map(shape, 3, seed + 5), random_map(shape, 4, seed + 1, int) - 1
    final = np.clip(labels + near, 0, disparities - 1).astype(dtype)
    final[::2, 1:] = final[::2, :-1]
    refinement = Refinement(CensusPossibility(rows, columns, disparities, FULL_SIZE), dtype)
    refinement.final_validity[:] = validity
    half = SimpleNamespace(
        chosen=SimpleNamespace(margins=random_map(
            (max(rows // 2, 1), max(columns // 2, 1)), 256, seed + 6)),
        prior=SimpleNamespace(weights=6 * random_map(shape, 2, seed + 7)),
        certainty=random_map(shape, 256, seed + 8))
    disparity, confidence = refinement.write(
        POOL, final, chosen, half, lambda first, last: None, config)
    fine, agreeing = twins.fine_disparities(final, chosen.labels, chosen.offsets, validity)
    margins = np.minimum(chosen.margins, twins.margins_of_half(half))
    sure = twins.confidence(twins.certainty(chosen.sums, margins, validity), agreeing, validity)
    pointed = np.floor(np.arange(columns) + 0.5 - fine / 16) - min_disparity
    sure = np.where((pointed >= 0) & (pointed < columns), sure, 0)
    right = np.where(sure > 0, np.interp(10 * sure, range(11), CALIBRATION), 0)
    np.testing.assert_allclose(confidence, np.minimum(right, half.certainty / 255), atol=1e-4)
    # Where the twin's certainty is rounded otherwise, the threshold decides by the kernel's.
    np.testing.assert_array_equal(disparity, twins.disparities_of(
        fine, validity, confidence, min_disparity, disparities, fill,
        np.float32(max(threshold, 1e-9))))
