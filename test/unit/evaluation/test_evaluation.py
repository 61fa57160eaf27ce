# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of a map are what a person counts by hand."""
import math
from types import SimpleNamespace

from fuzzy_stereo_ros.evaluation.matchers import Maps, Task
from fuzzy_stereo_ros.evaluation.measuring import (
    _match_frames, FIGURES, figures_of, mean_figures)
from fuzzy_stereo_ros.evaluation.scores import error_map, flicker, score
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

NAN = np.nan
FOUND = np.ones((2, 5), np.float32)


def test_maps_that_cannot_be_compared_are_rejected():
    with pytest.raises(ValueError, match=r'truth has the shape \(1, 5\), the disparity \(2, 5\)'):
        score(FOUND, FOUND[:1])
    with pytest.raises(ValueError, match=r'mask has the shape \(2, 4\)'):
        score(FOUND, FOUND, np.ones((2, 4)))
    with pytest.raises(ValueError, match='one shape'):
        flicker(FOUND, FOUND[:1])
    with pytest.raises(ValueError, match='nothing is left'):
        flicker(FOUND, FOUND, (2, 0))


def test_a_frame_in_which_no_pixel_counts_changes_no_mean():
    good, nothing = (figures_of(score(FOUND, truth)) for truth in (FOUND + 2, NAN * FOUND))
    means = mean_figures([good, nothing, good])
    assert means.pop('pixels') == 20 and set(means) == set(FIGURES)
    assert means == {name: good[name] for name in FIGURES}


@pytest.mark.parametrize('missing, covered', [(None, 100), ((2, 0), 60), ((0, 2), 40)])
def test_what_lies_outside_the_raw_images_is_not_covered(missing, covered):
    """Pixels match the ones to their left, of which the first is cut off at the border."""
    def begin(task, start):
        return lambda name, pair: Maps(FOUND.copy(), FOUND.copy(), 1.0)

    sides = missing and tuple(np.arange(5) < number for number in missing)
    pair = SimpleNamespace(left=FOUND, right=FOUND, missing=sides and tuple(
        np.broadcast_to(side, FOUND.shape) for side in sides))
    record, *_ = _match_frames([('a', pair)], SimpleNamespace(name='one', begin=begin), '', Task(
        'own', 2, FOUND.shape, 1), False)[0]
    assert record['covered'] == covered


def share(flags):
    return 100 * np.mean(flags) if len(flags) else NAN


LEVELS = NAN, -math.inf, math.inf, -7.0, 5.0, 5.5, 6.0, 7.0, 100.0, 104.0, 106.0
maps = arrays.arrays(np.float32, (3, 4), elements=st.sampled_from(LEVELS))


@given(maps, maps, arrays.arrays(bool, (3, 4)), st.booleans())
def test_figures_are_those_of_each_pixel_of_a_mask_of_bool_or_grey(found, truth, mask, grey):
    """NaN, not 0, where there is no pixel; an error of exactly a threshold is not bad."""
    figures = score(found, truth, mask * np.uint8(255) if grey else mask)
    every = list(zip(found.ravel().tolist(), truth.ravel().tolist()))
    pairs = [(one, other) for (one, other), counts in zip(every, mask.flat)
             if counts and np.isfinite(other)]
    errors = [abs(one - other) if np.isfinite(one) else np.inf for one, other in pairs]
    valid = [error for error in errors if error < np.inf]
    assert figures.pixels == len(pairs)
    assert figures.density == pytest.approx(share(np.isfinite(errors)), nan_ok=True)
    for limit in figures.bad_dense:
        assert figures.bad_dense[limit] == pytest.approx(
            share(np.greater(errors, limit)), nan_ok=True)
        assert figures.bad_sparse[limit] == pytest.approx(
            share(np.greater(valid, limit)), nan_ok=True)
    assert figures.d1_dense == pytest.approx(share([
        error > 3 and error > 0.05 * abs(other) for error, (_, other) in zip(errors, pairs)]),
        nan_ok=True)
    assert figures.d1_sparse == pytest.approx(share([
        error > 3 and error > 0.05 * abs(other) for error, (_, other) in zip(errors, pairs)
        if error < np.inf]), nan_ok=True)
    assert figures.rms_error == pytest.approx(
        np.sqrt(np.mean(np.square(valid))) if valid else NAN, nan_ok=True)
    assert figures.average_error == pytest.approx(np.mean(valid) if valid else NAN, nan_ok=True)
    expected = np.array([abs(one - other) if math.isfinite(one - other) else NAN
                         for one, other in every], np.float32)
    np.testing.assert_array_equal(error_map(found, truth).ravel(), expected)
    assert flicker(found, truth) == pytest.approx(
        share(expected[np.isfinite(expected)] > 1), nan_ok=True)


@pytest.mark.parametrize('shift', [(0, -2), (0, 2), (1, 0), (-1, 1)])
def test_a_map_that_moves_with_the_scene_does_not_flicker(shift):
    scene = np.random.default_rng(0).uniform(0, 60, (30, 40)).astype(np.float32)
    before = scene[5:25, 5:35]
    after = scene[5 - shift[0]:25 - shift[0], 5 - shift[1]:35 - shift[1]]
    assert flicker(before, after, shift) == 0
    assert flicker(before, after) > 50
