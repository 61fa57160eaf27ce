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
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, OUTSIDE
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPossibility, extra_columns, FULL_SIZE)
from fuzzy_stereo_ros.matching.realtime.refinement import (
    CLASS_ALIKE, Refinement, reject_speckles)
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
import reference_refinement as twins

KINDS = [(np.uint8, 256), (np.uint16, 600)]
validity_of_pixels = st.sampled_from([CONSISTENT, OUTSIDE, INVALID])


def checked(labels, target, disparities, inside):
    validity = np.full(labels.shape, 9, np.uint8)
    check_consistency(labels, target, disparities, inside, validity, 0, len(labels))
    return validity


def refinement_of(shape, disparities, labels_type):
    return Refinement(CensusPossibility(*shape, disparities, FULL_SIZE), labels_type)


def inside_of(min_disparity, columns):
    return min_disparity, min_disparity + columns - 1


def despeckled(labels, validity, step, smallest):
    validity = validity.copy()
    reject_speckles(ThreadPool(1), labels, validity, step, smallest)
    return validity


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(KINDS), st.integers(1, 5), st.integers(1, 40),
       st.integers(-50, 5) | st.sampled_from([-200, -2048, 2048]), st.integers(1, 30))
def test_validities_are_those_of_the_twin(kind, rows, columns, min_disparity, spread):
    dtype, limit = kind
    extra, inside = extra_columns(min_disparity, spread), inside_of(min_disparity, columns)
    labels = random_map((rows, columns), min(spread, limit), 1, dtype)
    target = random_map((rows, extra + columns), min(spread, 256), 2)
    np.testing.assert_array_equal(checked(labels, target, limit, inside),
                                  twins.validities(labels, target, inside))


@pytest.mark.parametrize('label', [0, 1, 255, 256, 257, 400, 511])
@pytest.mark.parametrize('away, validity', [
    (-2, INVALID), (-1, CONSISTENT), (0, CONSISTENT), (1, CONSISTENT), (2, INVALID)])
def test_labels_agree_within_one_pixel_modulo_256(label, away, validity):
    labels = np.full((1, 600), label, np.uint16)
    target = np.full((1, 600), (label + away) % 256, np.uint8)
    assert checked(labels, target, 600, (0, 599))[0, 599] == validity


@st.composite
def labels_and_validity(draw, dtype=np.uint8):
    shape = draw(st.integers(1, 12)), draw(st.integers(1, 12))
    values = draw(st.sampled_from([2, 4, 256]))
    labels = draw(arrays.arrays(dtype, shape, elements=st.integers(0, values - 1)))
    return labels, draw(arrays.arrays(np.uint8, shape, elements=validity_of_pixels))


@settings(max_examples=150, deadline=None)
@given(labels_and_validity(), st.integers(0, 2), st.integers(2, 30))
def test_speckles_are_those_of_flood_fill(maps, step, smallest):
    np.testing.assert_array_equal(despeckled(*maps, step, smallest),
                                  twins.without_speckles(*maps, step, smallest))


kinds = st.sampled_from([(np.uint8, 3), (np.uint8, 256), (np.uint16, 600)])     # steps small, wide
sizes = st.integers(1, 12)


@st.composite
def maps(draw):
    """Return labels and a validity, from nothing rejected to everything."""
    (dtype, limit), shape = draw(kinds), (draw(sizes), draw(sizes))
    seed, share = draw(st.integers(0, 10000)), draw(st.sampled_from([0, 0.1, 0.5, 0.9, 1]))
    labels = random_map(shape, limit, seed, dtype)
    random = np.random.default_rng(seed)
    validity = random_map(shape, INVALID, seed)
    validity[random.random(shape) < share] = INVALID
    return labels, validity


def by_rows(labels, validity):
    filled = np.full_like(labels, 77)
    fill_rows(labels, validity, filled, 0, len(labels))
    return filled


@settings(max_examples=150, deadline=None)
@given(maps())
def test_rows_are_filled_as_by_the_twin(given_maps):
    np.testing.assert_array_equal(by_rows(*given_maps), twins.filled_by_rows(*given_maps))


@pytest.mark.parametrize('dtype, disparities', [(np.uint8, 60), (np.uint16, 300)])
@pytest.mark.parametrize('shape', [(2, 2), (3, 9), (5, 5), (17, 40)])
def test_smoothing_is_both_medians_one_after_the_other(shape, dtype, disparities):
    labels, grey = random_map(shape, disparities, 7, dtype), random_map(shape, 50, 8)
    refinement = refinement_of(shape, disparities, dtype)
    np.testing.assert_array_equal(
        refinement.smooth(ThreadPool(1), labels, labels, grey),
        twins.median_of_25(twins.membership_median(labels, grey, CLASS_ALIKE)))


POOL = ThreadPool(1)


def keep_all(first, last):
    """Reject nothing of some rows."""


def half_at_random(shape, seed):
    """Return what a half-size search says of how sure a map of a shape is."""
    halves = [max(side // 2, 1) for side in shape]
    return SimpleNamespace(
        chosen=SimpleNamespace(margins=random_map(halves, 256, seed)),
        prior=SimpleNamespace(weights=6 * random_map(shape, 2, seed + 1)),
        certainty=random_map(shape, 256, seed + 2))


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


@settings(max_examples=80, deadline=None)
@given(st.integers(1, 9), st.integers(1, 33),
       st.sampled_from([1, 2, 6, 64, 256, 257, 1999, 2000, 4096]), st.integers(-300, 300),
       st.booleans(), st.floats(0, 1), st.integers(0, 99))
def test_disparities_and_confidence_are_those_of_the_twin(
        rows, columns, disparities, min_disparity, fill, threshold, seed):
    config = MatcherConfig(disparities=disparities, min_disparity=min_disparity, fill=fill,
                           confidence_threshold=threshold)
    chosen, validity, final = chosen_at_random((rows, columns), disparities, seed)
    refinement = refinement_of((rows, columns), disparities, final.dtype)
    refinement.final_validity[:] = validity
    half = half_at_random((rows, columns), seed + 6)
    disparity, confidence = refinement.write(POOL, final, chosen, half, keep_all, config)
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
