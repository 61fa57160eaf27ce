# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rows that do not fit are undone, held, moved by measured steps, and forgotten with the rig."""
from dataclasses import replace

from bench.conditions import misaligned
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels.possibility.row_alignment import (
    nearest_features, shift_rows)
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.matching.plausibility import CONFIRMED
from fuzzy_stereo_ros.matching.row_alignment import (
    LEAST_DOUBT, PERIOD, RowAlignment, Rows)
from fuzzy_stereo_ros.matching.row_offsets import feature_offsets, normalised, terms_at
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, settings, strategies as st
from made_scenes import bits, LARGE, large_scene, wrong
import numpy as np
import pytest

ROWS, COLUMNS, DISPARITIES = LARGE
CONFIG = MatcherConfig(disparities=DISPARITIES, fill=True)
CAMERA = Camera(300.0, 300.0, 159.5, 119.5)


@pytest.fixture(scope='module')
def scene():
    return large_scene()


def shifted(image, terms):
    channels = image.shape[2] if image.ndim == 3 else 1
    moved = np.zeros_like(image)
    shift_rows(image.reshape(len(image), -1), channels, np.array(terms, np.float64),
               np.float32(np.iinfo(image.dtype).max), moved.reshape(len(image), -1), 0, len(image))
    return moved


def shifted_by_numpy(image, terms, a=-0.75):
    """Return what shift_rows writes, by Keys (1981), Eq. 15, with another parameter: float64."""
    rows, columns = image.shape[:2]
    row, column = np.indices((rows, columns))
    place = row + (terms_at(column.ravel(), row.ravel(), rows, columns) @ terms).reshape(row.shape)
    found = 0
    for step in (-1, 0, 1, 2):
        near = np.floor(place) + step
        x = abs(place - near)
        weight = np.where(x <= 1, (a + 2) * x**3 - (a + 3) * x**2 + 1,
                          a * (x**3 - 5 * x**2 + 8 * x - 4))
        values = image[np.clip(near, 0, rows - 1).astype(int), column]
        found = found + values * weight.reshape(rows, columns, *(1,) * (image.ndim - 2))
    return np.clip(found, 0, np.iinfo(image.dtype).max)


@settings(max_examples=60)
@given(rows=st.integers(1, 20), columns=st.integers(2, 40), channels=st.sampled_from([0, 3]),
       kind=st.sampled_from([np.uint8, np.uint16]), seed=st.integers(0, 99),
       terms=st.lists(st.floats(-3, 3), min_size=4, max_size=4))
def test_shifted_rows_are_those_of_numpy(rows, columns, channels, kind, seed, terms):
    shape = (rows, columns, channels) if channels else (rows, columns)
    image = np.random.default_rng(seed).integers(0, np.iinfo(kind).max, shape, kind,
                                                 endpoint=True)
    # In colour the channels of a pixel are read at places that differ by a third of a column's.
    slope = 2 * (abs(terms[1]) + abs(terms[3])) / max(columns - 1, 1)
    largest = np.iinfo(kind).max
    tolerance = 0.51 + largest * (1e-5 + (2 * slope if channels else 0))
    found = shifted(image, terms).astype(float)
    assert np.abs(found - shifted_by_numpy(image, terms)).max() <= tolerance


@settings(max_examples=40)
@given(st.integers(0, 2**20), st.integers(1, 60), st.integers(1, 60), st.integers(1, 256))
def test_features_are_matched_as_by_the_brute_force_matcher_of_opencv(seed, number, others, most):
    """With few different bits several features are equally near."""
    lowest, highest, apart = map(np.float32, (-2, 9, 4))
    draw = np.random.default_rng(seed)
    (places, bits), (other_places, other_bits) = (
        (draw.integers(0, 20, (2, count)).astype(np.float32),
         draw.integers(0, most, (count, 32)).astype(np.uint8)) for count in (number, others))
    nearest, distances = np.empty((2, number), np.int32)
    order = np.argsort(other_places[1])
    begins = np.searchsorted(other_places[1, order], places[1] - apart)
    nearest_features(
        (places, bits.view(np.uint32), begins),
        (np.ascontiguousarray(other_places[:, order]), other_bits[order].view(np.uint32), order),
        lowest, highest, apart, nearest, distances)

    across, down = places[:, :, None] - other_places[:, None]
    allowed = (across >= lowest) & (across <= highest) & (abs(down) <= apart)
    found = cv2.BFMatcher(cv2.NORM_HAMMING).match(bits, other_bits, allowed.astype(np.uint8))
    assert {one: (nearest[one], distances[one]) for one in np.flatnonzero(nearest >= 0)} == {
        one.queryIdx: (one.trainIdx, one.distance) for one in found}


@pytest.mark.parametrize('profile, terms', [
    *(('realtime', terms) for terms in (
        (0.5, 0, 0, 0), (8, 0, 0, 0), (0, 1.5, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1.3))),
    ('quality', (-3, 1.5, -1, 0.5))], ids=str)
def test_a_single_pair_whose_rows_differ_is_matched_as_well_as_one_whose_rows_fit(
        scene, profile, terms):
    pair = scene.left, shifted(scene.right, -np.array(terms))
    aligned, fits, left_alone = (wrong(StereoMatcher(config).match(*images), scene)
                                 for config, images in (
        (MatcherConfig.from_profile(profile, disparities=DISPARITIES, fill=True), pair),
        (CONFIG, scene[:2]), (replace(CONFIG, align_rows=False), pair)))
    # Rows that the right camera does not see cost some pixels at the border.
    assert aligned <= 1.15 * fits + 50 * max(abs(terms[0]) - 1, 0) / ROWS
    assert aligned < left_alone


@pytest.mark.parametrize('tilt', [0.0, 0.05, -0.07, 1.0])
def test_below_a_tenth_of_a_pixel_no_bit_changes_and_the_match_says_what_was_done(scene, tilt):
    right = misaligned(scene.right, tilt=tilt) if tilt else scene.right
    aligned, left_alone = (StereoMatcher(replace(CONFIG, align_rows=align)).match(
        scene.left, right) for align in (True, False))
    done, measured = aligned.misalignment, left_alone.misalignment
    assert (bits(aligned) == bits(left_alone)) == (tilt < 0.1)
    assert (done.undone, measured.undone) == (tilt >= 0.1, False)
    if tilt >= 0.1:
        assert (done.tilt, measured.tilt) == pytest.approx((1.0, 1.0), abs=0.1)
        assert done.faults == measured.faults == ['tilt']


@settings(max_examples=12)
@given(st.integers(150, 300), st.integers(200, 400), st.integers(0, 99),
       st.sampled_from([0, 6, 12]))
def test_corners_of_the_first_pair_are_measured_where_its_features_leave_doubt(
        rows, columns, seed, noise):
    left, right, *_ = make_pair(rows, columns, 32, seed, noise=float(noise))
    matcher = StereoMatcher(MatcherConfig(disparities=32, threads=1))
    matcher.match(left, right)
    features = Rows().with_points(feature_offsets(
        normalised(left), normalised(right), 0, 32), (rows, columns))
    alone = features.measured((rows, columns))
    assert len(matcher.rows.points) > len(features.points) or (
        alone is not None and alone.doubts_at_places.max() < LEAST_DOUBT)
    if alone is not None and alone.doubts_at_places.max() < LEAST_DOUBT:
        np.testing.assert_array_equal(matcher.rows.points, features.points)
    matcher.match(left, right)      # every other one of the first pairs is measured
    assert matcher.rows.points[-1, 3] > 0 or alone is None


@pytest.mark.parametrize('tilt, unseen, nearest', [(6.0, np.s_[-4:], -6), (-6.0, np.s_[:4], 5)])
def test_in_a_filled_map_these_rows_continue_the_nearest_one_that_both_see(
        scene, tilt, unseen, nearest):
    match = StereoMatcher(CONFIG).match(scene.left, misaligned(scene.right, tilt=tilt))
    assert (match.disparity[unseen] == match.disparity[nearest]).all()
    assert (match.confidence[unseen] == 0).all()


def rows_after(matcher, *pairs, camera=None):
    """Return what is undone of rows after pairs."""
    for pair in pairs:
        matcher.match(*pair, camera=camera)
    return matcher.rows.undone


def test_what_was_found_is_held_without_texture_handed_on_and_forgotten_with_size_and_camera(
        scene):
    matcher, blank = StereoMatcher(CONFIG), np.full((ROWS, COLUMNS), 100, np.uint8)
    plain, tilted = scene[:2], (scene.left, misaligned(scene.right, tilt=1.5))
    undone = rows_after(matcher, *[tilted] * 3, camera=CAMERA)
    assert undone[0] == pytest.approx(1.5, abs=0.1)
    held = rows_after(matcher, *[(blank, blank)] * (PERIOD + 1), camera=CAMERA)
    np.testing.assert_array_equal(held, undone)
    assert wrong(matcher.match(*tilted, camera=CAMERA), scene) < 3

    other = StereoMatcher(CONFIG)
    other.restore(matcher.state, matcher.rows)
    for _ in range(PERIOD + 2):
        first, second = (one.match(*tilted, camera=CAMERA) for one in (matcher, other))
        assert bits(first) == bits(second)
        np.testing.assert_array_equal(matcher.rows.points, other.rows.points)
        np.testing.assert_array_equal(matcher.rows.undone, other.rows.undone)
    assert not rows_after(matcher, plain, camera=CAMERA._replace(fx=301.0)).any()
    assert rows_after(matcher, tilted).any()
    smaller = make_pair(120, 200, DISPARITIES, seed=1)
    assert not rows_after(matcher, smaller[:2]).any()


@pytest.mark.parametrize('knock, covered', [(-6.0, 0), (2.0, 0), (2.0, 30)])
def test_a_rig_after_a_knock_is_put_right_within_pairs(scene, knock, covered):
    """Also while the cameras see nothing for some pairs."""
    matcher, blank = StereoMatcher(CONFIG), np.full((ROWS, COLUMNS), 100, np.uint8)
    assert not rows_after(matcher, *[scene[:2]] * 5, *[(blank, blank)] * covered).any()
    after = scene.left, misaligned(scene.right, tilt=knock)
    assert wrong(matcher.match(*after), scene) > 20
    rows_after(matcher, *[after] * (covered or CONFIRMED - 1))
    assert wrong(matcher.match(*after), scene) < 5
    assert matcher.rows.undone[0] == pytest.approx(knock, abs=0.2)


def test_a_swing_between_exposures_is_not_followed():
    alignment, rows = RowAlignment(CONFIG), Rows(rig=(ROWS, COLUMNS))
    random, moves = np.random.default_rng(0), []
    for _ in range(40):
        column, row = random.uniform(0, COLUMNS, 60), random.uniform(0, ROWS, 60)
        swing = np.full(60, random.normal(0, 0.8)) + random.normal(0, 0.05, 60)
        rows = alignment._stepped(rows.with_points(
            np.column_stack([column, row, swing]), (ROWS, COLUMNS)), (ROWS, COLUMNS))
        moves.append(np.abs(rows.undone).max())
    assert len(set(moves)) < 5


def test_a_pattern_that_repeats_itself_down_the_image_moves_nothing():
    left, right = (np.tile(image, (5, 1)) for image in make_pair(48, 320, 16, seed=1)[:2])
    assert not StereoMatcher(CONFIG, disparities=16).match(left, right).misalignment.undone
