# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""By how much the rows of a pair differ is found and told; it is undone, held, and forgotten."""
from dataclasses import replace
from unittest import mock

from bench.conditions import misaligned
import cv2
from fuzzy_stereo_ros.matching import (
    MatcherConfig, row_alignment, row_offsets, StereoMatcher)
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility.row_alignment import (
    nearest_features, shift_rows)
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.matching.plausibility import CONFIRMED
from fuzzy_stereo_ros.matching.row_alignment import (
    FIRST, LEAST_DOUBT, PERIOD, rig_of, RowAlignment, Rows)
from fuzzy_stereo_ros.matching.row_offsets import (
    corner_offsets, feature_offsets, Misalignment, misalignment_of, normalised,
    row_offset_in_words, terms_at)
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
from hypothesis import example, given, settings, strategies as st
from made_scenes import bits, LARGE, large_scene, wrong
import numpy as np
import pytest
from real_pairs import middlebury, motorcycle, third_size

ROWS, COLUMNS, DISPARITIES = LARGE
CONFIG = MatcherConfig(disparities=DISPARITIES, fill=True)
CAMERA = Camera(300.0, 300.0, 159.5, 119.5)


@pytest.fixture(scope='module')
def scene():
    return large_scene()


def known(made, right=None):
    """Return what `corner_offsets` takes of a made pair, its truth as the disparity."""
    return (normalised(made.left), normalised(made.right if right is None else right), made.truth,
            made.visible.astype(np.float32))


FORMS = [lambda image: image, lambda image: image.astype(np.uint16) * 250,
         lambda image: np.stack([image] * 3, 2), lambda image: (0.4 * image + 60).astype(np.uint8)]


@settings(max_examples=10)
@example(tilt=0.0, roll=0.0, zoom=0.0, form=FORMS[0])
@given(tilt=st.floats(-1, 1), roll=st.floats(-0.4, 0.4), zoom=st.floats(-0.6, 0.6),
       form=st.sampled_from(FORMS))
def test_tilt_roll_and_zoom_are_recovered_to_a_tenth_of_a_pixel_and_told_by_kind(
        scene, tilt, roll, zoom, form):
    """In any kind of image, of cameras that differ in gain, and where every fifth is mistaken."""
    left = form(scene.left) if form is FORMS[1] else scene.left
    right = form(misaligned(scene.right, tilt=tilt, roll=roll, zoom=zoom))
    edges = tilt, np.deg2rad(roll) * COLUMNS / 2, zoom / 100 * ROWS / 2
    images = normalised(left), normalised(right)
    for offsets in (feature_offsets(*images, 0, DISPARITIES),
                    corner_offsets(*images, *known(scene)[2:])):
        found = misalignment_of([offsets], ROWS, COLUMNS)
        assert found[:3] == pytest.approx(edges, abs=0.1)
        assert max(found.doubts) < 0.06
        assert found.roll_degrees == pytest.approx(roll, abs=0.04)
        assert found.zoom_percent == pytest.approx(zoom, abs=0.1)
        told = dict(zip(('tilt', 'roll', 'zoom'), np.abs(edges)))
        assert {kind for kind in told if told[kind] > 0.6} <= set(found.faults) <= {
            kind for kind in told if told[kind] > 0.4}
        assert found.advice.startswith('recalibrate: the right ' if found.faults else '')
        for kind, word in (('tilt', f'px too {"low" if found.tilt > 0 else "high"}'),
                           ('roll', f'is turned by {found.roll_degrees:+.2f} degrees'),
                           ('zoom', f'is {found.zoom_percent:+.2f} %')):
            assert (word in found.advice) == (kind in found.faults)
        assert bool(found.advice) == bool(found.faults)
        assert row_offset_in_words(found).endswith(found.advice or 'OK (limit 0.5)')
    offsets[::5, 2] += 4.0
    assert misalignment_of([offsets], ROWS, COLUMNS).terms == pytest.approx(found.terms, abs=0.05)


def test_a_yaw_is_recovered_from_rows_that_converge_and_few_points_or_places_tell_nothing():
    random, fewest = np.random.default_rng(0), row_offsets.FEWEST[0]
    column, row = random.uniform(0, COLUMNS, 300), random.uniform(0, ROWS, 300)
    terms = np.array([0.2, -0.4, 0.1, 1.3])
    offsets = terms_at(column, row, ROWS, COLUMNS) @ terms + random.normal(0, 0.1, 300)
    points = np.column_stack([column, row, offsets])
    found = misalignment_of([points], ROWS, COLUMNS)
    assert found.terms == pytest.approx(terms, abs=0.05)
    assert found.faults == ['yaw']
    assert 'rows converge to the left' in found.advice
    assert misalignment_of([points[:fewest]], ROWS, COLUMNS) is not None
    assert misalignment_of([points[:fewest - 1]], ROWS, COLUMNS) is None
    points[:, :2] %= 60       # the upper left tiles
    assert misalignment_of([points], ROWS, COLUMNS) is None


@pytest.mark.parametrize('swing, faults', [(0.3, []), (0.9, ['timing'])])
def test_exposures_at_different_moments_swing_from_pair_to_pair(swing, faults):
    """But not pairs whose points contradict each other, such as of swapped images."""
    shifts = 2**0.5 * swing * np.sin(np.arange(24))     # as of a camera that shakes
    frames = make_sequence(120, 200, 16, len(shifts), seed=1, noise=1.0, pan=2.0)
    offsets = [corner_offsets(*known(made, misaligned(made.right, tilt=shift)))
               for made, shift in zip(frames, shifts)]
    found = misalignment_of(offsets, 120, 200)
    assert found.swing == pytest.approx(np.std(shifts), abs=0.1)
    assert found.faults == faults
    assert found.advice.startswith('synchronise' if faults else '')
    random, wrong = np.random.default_rng(0), []
    for _ in range(8):
        wrong.append(random.permutation(offsets[0])[:random.integers(1, 20)])
        wrong[-1][:, 2] = random.uniform(-10, 10, len(wrong[-1]))
    assert misalignment_of([offsets[0]] * 8 + wrong, 120, 200).swing == pytest.approx(0, abs=0.05)


def test_a_fault_is_a_reason_to_warn_unless_it_is_undone_well():
    found = Misalignment(0.6, 0.0, 0.0, 0.0, (0.0,) * 4, 0.2, 50, 9, ROWS, COLUMNS, undone=True)
    assert not found.warns
    assert found.advice.endswith('cut off); undone before matching')
    for worse, end in ((found._replace(undone=False), 'cut off)'),
                       (found._replace(swing=0.8), 'all but the swing is undone before matching'),
                       *((found._replace(**{name: limit + 0.1}),
                          'undone before matching, but matches are lost') for name, limit in zip(
                              row_offsets.TERMS, row_offsets.UNDONE_LIMITS))):
        assert worse.warns
        assert worse.advice.startswith('recalibrate: ')
        assert worse.advice.endswith(end)
    assert 'undone' not in found._replace(tilt=0.0, swing=0.8).advice
    assert row_offset_in_words(found._replace(tilt=0.2)).endswith(
        'OK (limit 0.5), undone before matching')


@pytest.mark.parametrize('shape', [(1, 1), (10, 400), (59, 80), (60, 60), (61, 103)])
def test_small_and_plain_images_tell_nothing_and_break_nothing(shape):
    plain, textured = (normalised(image) for image in (
        np.full(shape, 90, np.uint8),
        np.random.default_rng(0).integers(0, 255, shape, np.uint8)))
    zero, one, unknown = (np.full(shape, value, np.float32) for value in (0, 1, np.nan))
    for found in (corner_offsets(plain, plain, zero, one),
                  corner_offsets(textured, textured, zero, zero),
                  corner_offsets(textured, textured, unknown, zero),
                  feature_offsets(plain, plain, 0, 16), feature_offsets(plain, textured, 0, 16)):
        assert misalignment_of([found], *shape) is None


def test_invalid_pixels_take_no_part_and_the_right_image_as_reference_tells_the_same(scene):
    left, right, disparity, confidence = known(scene)
    disparity = disparity.copy()
    disparity[:, 160:] = np.nan
    confidence[:120] = 0
    found = corner_offsets(left, right, disparity, confidence)
    assert len(found) > 10
    assert (found[:, 0] < 160).all() and (found[:, 1] >= 119).all()
    right = misaligned(scene.right, tilt=0.7, roll=0.2)
    one, other = (StereoMatcher(disparities=DISPARITIES, reference=reference).match(
        scene.left, right).misalignment for reference in ('left', 'right'))
    assert one[:2] == pytest.approx((0.7, np.deg2rad(0.2) * COLUMNS / 2), abs=0.1)
    assert other.terms == pytest.approx(one.terms, abs=0.1)


@pytest.mark.parametrize('name', ['tsukuba', 'teddy', 'Bowling1', ''])
def test_a_real_pair_fits_as_it_is_and_is_found_turned_by_a_fifth_of_a_degree(name):
    pair = middlebury(name) if name.islower() else third_size(
        name, 370, 413) if name else motorcycle()
    plain, turned = (StereoMatcher(disparities=pair.disparities).match(
        pair.left, right).misalignment for right in (pair.right, misaligned(pair.right, roll=0.2)))
    assert plain.faults == []
    assert turned.faults == ['roll']
    assert turned.roll_degrees - plain.roll_degrees == pytest.approx(0.2, abs=0.025)
    assert turned.tilt == pytest.approx(plain.tilt, abs=0.1)


# ---- what is done about it ----


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


@settings(max_examples=16)
@given(rows=st.integers(100, 480), columns=st.integers(160, 640), misled=st.booleans(),
       tilt=st.one_of(st.floats(-6, -0.8), st.floats(0.8, 6)), seed=st.integers(0, 9))
def test_what_features_tell_is_undone_where_rows_match_better_and_not_where_they_match_worse(
        rows, columns, misled, tilt, seed):
    left, right = make_pair(rows, columns, 32, seed=seed)[:2]
    random = np.random.default_rng(seed)
    points = np.column_stack([*(random.uniform(0, side, 200) for side in (columns, rows)),
                              random.normal(tilt, 0.05, 200)])
    with mock.patch.object(row_alignment, 'feature_offsets', lambda *_: points):
        _, found = RowAlignment(MatcherConfig(disparities=32)).align(
            ThreadPool(1), Rows(), left, right if misled else misaligned(right, tilt=tilt), ())
    assert found.undone.any() != misled


@pytest.mark.parametrize('profile, terms', [
    *(('realtime', terms) for terms in (
        (8, 0, 0, 0), (0, 1.5, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1.3))),
    pytest.param('quality', (-3, 1.5, -1, 0.5), marks=pytest.mark.slow)], ids=str)
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


@settings(max_examples=6)
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


@pytest.mark.parametrize('knock, covered', [(-6.0, 0), (2.0, 30)])
def test_a_rig_after_a_knock_is_put_right_within_pairs(scene, knock, covered):
    """Also while the cameras see nothing for some pairs."""
    matcher, blank = StereoMatcher(CONFIG), np.full((ROWS, COLUMNS), 100, np.uint8)
    assert not rows_after(matcher, *[scene[:2]] * 5, *[(blank, blank)] * covered).any()
    after = scene.left, misaligned(scene.right, tilt=knock)
    assert wrong(matcher.match(*after), scene) > 20
    rows_after(matcher, *[after] * (covered or CONFIRMED - 1))
    assert wrong(matcher.match(*after), scene) < 5
    assert matcher.rows.undone[0] == pytest.approx(knock, abs=0.2)


@settings(max_examples=12)
@given(tilt=st.one_of(st.floats(-0.03, 0.03), st.floats(0.2, 1), st.floats(-1, -0.2)),
       seed=st.integers(0, 9), error=st.sampled_from([-0.03, 0.03]))
def test_rows_moved_by_an_error_of_features_are_as_they_came_after_the_first_pairs_if_they_fit(
        tilt, seed, error):
    left, right = make_pair(ROWS, COLUMNS, DISPARITIES, seed)[:2]
    matcher, terms = StereoMatcher(CONFIG), np.array([tilt, 0, 0, 0])
    matcher.restore(None, Rows(undone=terms + error, pair=1, rig=rig_of(left, None)))
    undone = rows_after(matcher, *[(left, shifted(right, -terms))] * FIRST)
    assert undone.any() == (abs(tilt) > 0.1)


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
