# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No confidence where the pair shows nothing: covered lenses, burnt-out windows."""
from types import SimpleNamespace

from census_scene import random_map
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.evidence import Evidence
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, VOTED
from fuzzy_stereo_ros.matching.over_frames.pictures import Picture
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

SURE = .03      # share of a small picture that noise may match
COVERS = {'black': 0, 'white': 255, 'plain': 110, 'dark': 6}


def scene(rows, columns, disparity, seed, deep=False, colour=True):
    """Return a pair of fine texture on a slanted wall behind a nearer square."""
    random = np.random.default_rng(seed)
    wide = random.normal(0, 1, (rows, columns + disparity, 3 if colour else 1))
    wide = cv2.GaussianBlur(wide, (0, 0), random.uniform(.8, 2)).reshape(rows, -1, wide.shape[2])
    wide = 120 + 40 * wide / wide.std()
    pair = wide[:, :columns], wide[:, disparity:]
    top = 65535 if deep else 255
    return tuple(np.squeeze(np.clip(np.rint(image * top / 255), 0, top).astype(
        np.uint16 if deep else np.uint8)) for image in pair)


def noisy(image, noise, random):
    top = np.iinfo(image.dtype).max
    return np.clip(np.rint(image + random.normal(0, noise * top / 255, image.shape)), 0, top
                   ).astype(image.dtype)


@pytest.mark.parametrize('profile', ['realtime', 'fast'])
@settings(max_examples=6)
@given(st.sampled_from(sorted(COVERS)), st.sampled_from([0, 1]), st.sampled_from([0, .8, 1.5, 4]),
       st.sampled_from([0, 1.5]), st.integers(0, 3), st.booleans(), st.booleans(),
       st.integers(-3, 9), st.integers(0, 999))
def test_a_covered_lens_gives_no_confidence(
        profile, cover, side, noise, noise_of_other, before, deep, colour, min_disparity, seed):
    """Cold or after good frames, of any profile, depth and size."""
    random = np.random.default_rng(seed)
    rows, columns = random.integers(150, 260, 2)
    pair = scene(rows, columns, 12, seed, deep, colour)
    matcher = StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=32, min_disparity=min_disparity, seed=seed))
    for _ in range(before):
        good = matcher.match(*(noisy(image, noise_of_other, random) for image in pair))
        assert (good.confidence >= .5).mean() > .7
    shot = [noisy(image, noise_of_other, random) for image in pair]
    level = COVERS[cover] * (257 if deep else 1)
    shot[side] = noisy(np.full_like(shot[side], level), noise, random)
    match = matcher.match(*shot)
    assert (match.confidence >= .5).mean() <= SURE
    assert (np.isfinite(match.disparity) & (match.confidence == 0)).sum() == 0


@settings(max_examples=9)
@given(st.sampled_from(['realtime', 'fast', 'paper']), st.booleans(), st.integers(0, 99))
def test_a_burnt_out_window_gives_no_confidence_and_its_surroundings_keep_theirs(
        profile, white, seed):
    """Also after frames that are averaged, with noise before the sensor clips."""
    random = np.random.default_rng(seed)
    pair = [image.astype(float) for image in scene(120, 200, 9, seed)]
    top, left = random.integers(30, 50), random.integers(60, 90)
    for image, moved in zip(pair, (0, 9)):
        image[top:top + 40, left - moved:left - moved + 60] = 400 if white else -200
    matcher = StereoMatcher(profile, disparities=32, population=8, generations=4)
    for _ in range(3):
        match = matcher.match(*(np.clip(image + random.normal(0, 1.5, image.shape), 0, 255).astype(
            np.uint8) for image in pair))
    inside = match.confidence[top + 6:top + 34, left + 6:left + 54]
    assert inside.max() == 0
    if profile != 'paper':
        assert (match.confidence[:, 140:] >= .5)[:20].mean() > .9


@settings(max_examples=20)
@given(st.integers(2, 40), st.integers(2, 40), st.integers(0, 4), st.integers(-6, 6),
       st.floats(0, 40), st.integers(0, 999))
def test_what_is_seen_is_that_of_the_twin(rows, columns, extra, shift, noise, seed):
    random, (height, width) = np.random.default_rng(seed), (rows // 2, columns // 2)
    views = Picture(height, width, False), Picture(height, width + extra, True)
    for view in views:
        values = random.integers(0, 3, (height, view.columns)) * 32000 + random.integers(0, 1200)
        view.luminance[MARGIN:-MARGIN, MARGIN:MARGIN + view.columns] = np.minimum(values, 65535)
    labels = random_map((rows, columns), 12, seed)
    weights = VOTED * random_map((rows, columns), 2, seed + 1)
    evidence = Evidence(*views, [SimpleNamespace(level=noise)] * 2, shift)
    evidence.sum_up(labels, (0, 0, rows))
    evidence.judge()
    validity = random_map((rows, columns), 3, seed + 2)
    found = validity.copy()
    evidence.reject(found, weights, 0, rows)
    np.testing.assert_array_equal(found, twin(*views, labels, weights, validity, noise, shift))


def twin(left, right, labels, weights, validity, noise, shift):
    """Return the validity of a map, window by window, without sums over blocks."""
    (rows, columns), width = (left.rows, left.columns), right.columns
    ours = left.luminance[MARGIN:-MARGIN, MARGIN:MARGIN + columns].astype(float)
    mirror = right.luminance[MARGIN:-MARGIN, MARGIN:MARGIN + width].astype(float)
    place = columns - 1 - np.arange(columns) + (
        labels[:2 * rows:2, :2 * columns:2].astype(int) + shift + 1) // 2
    theirs = np.take_along_axis(mirror, np.clip(place, 0, width - 1), 1)
    ends = np.minimum(ours, theirs) <= 0, np.maximum(ours, theirs) >= 254 * 256
    expected = validity.copy()
    for row, column in np.ndindex(labels.shape):
        half_row, half_column = min(row // 2, rows - 1), min(column // 2, columns - 1)
        around = (slice(max(half_row - 1, 0), half_row + 2),
                  slice(max(half_column - 1, 0), half_column + 2))
        clipped = any(end[around].all() for end in ends)
        window = tuple(slice(max(middle // 4 * 4 - 4, 0), middle // 4 * 4 + 8)
                       for middle in (half_row, half_column))
        a, b = ours[window].ravel() / 256, theirs[window].ravel() / 256
        variances = a.var() + .14**2, b.var() + .14**2
        clear = min(variances) > 9 * ((noise / 2)**2 + .14**2)
        alike = ((a - a.mean()) * (b - b.mean())).mean() > .33 * np.sqrt(np.prod(variances))
        seen = (clear or alike) and not clipped
        if validity[row, column] == CONSISTENT and weights[row, column] != VOTED and not seen:
            expected[row, column] = INVALID
    return expected
