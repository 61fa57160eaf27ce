# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""By how much the rows of a pair differ is found, told by kind, and never where they fit."""
from bench.conditions import misaligned
from fuzzy_stereo_ros.matching import MatcherConfig, row_offsets, StereoMatcher
from fuzzy_stereo_ros.matching.row_offsets import (
    corner_offsets, feature_offsets, Misalignment, misalignment_of, normalised,
    row_offset_in_words, terms_at)
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
from hypothesis import example, given, settings, strategies as st
from made_scenes import LARGE, large_scene
import numpy as np
import pytest
from real_pairs import middlebury, motorcycle, third_size

ROWS, COLUMNS, DISPARITIES = LARGE


def known(made, right=None):
    """Return what `corner_offsets` takes of a made pair, its truth as the disparity."""
    return (normalised(made.left), normalised(made.right if right is None else right), made.truth,
            made.visible.astype(np.float32))


def matched(pairs, disparities, **changes):
    """Return the Misalignment of (left, right)s that are matched one after the other."""
    matcher = StereoMatcher(MatcherConfig(disparities=disparities, **changes))
    for left, right in pairs:
        match = matcher.match(left, right)
    return match.misalignment


FORMS = [lambda image: image, lambda image: image.astype(np.uint16) * 250,
         lambda image: np.stack([image] * 3, 2), lambda image: (0.4 * image + 60).astype(np.uint8)]


@settings(max_examples=20)
@example(tilt=0.0, roll=0.0, zoom=0.0, form=FORMS[0])
@given(tilt=st.floats(-1, 1), roll=st.floats(-0.4, 0.4), zoom=st.floats(-0.6, 0.6),
       form=st.sampled_from(FORMS))
def test_tilt_roll_and_zoom_are_recovered_to_a_tenth_of_a_pixel_and_told_by_kind(
        tilt, roll, zoom, form):
    """In any kind of image, of cameras that differ in gain, and where every fifth is mistaken."""
    scene, deep = large_scene(), form is FORMS[1]
    left = form(scene.left) if deep else scene.left
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


def test_invalid_pixels_take_no_part_and_the_right_image_as_reference_tells_the_same():
    scene = large_scene()
    left, right, disparity, confidence = known(scene)
    disparity = disparity.copy()
    disparity[:, 160:] = np.nan
    confidence[:120] = 0
    found = corner_offsets(left, right, disparity, confidence)
    assert len(found) > 10
    assert (found[:, 0] < 160).all() and (found[:, 1] >= 119).all()
    right = misaligned(scene.right, tilt=0.7, roll=0.2)
    one, other = (matched([(scene.left, right)], DISPARITIES, reference=reference)
                  for reference in ('left', 'right'))
    assert one[:2] == pytest.approx((0.7, np.deg2rad(0.2) * COLUMNS / 2), abs=0.1)
    assert other.terms == pytest.approx(one.terms, abs=0.1)


@pytest.mark.parametrize('name', ['tsukuba', 'venus', 'teddy', 'cones', 'Bowling1', 'Aloe', ''])
def test_a_real_pair_fits_as_it_is_and_is_found_turned_by_a_fifth_of_a_degree(name):
    pair = middlebury(name) if name.islower() else third_size(
        name, 370, 413) if name else motorcycle()
    plain, turned = (matched([(pair.left, right)], pair.disparities)
                     for right in (pair.right, misaligned(pair.right, roll=0.2)))
    assert plain.faults == []
    assert turned.faults == ['roll']
    assert turned.roll_degrees - plain.roll_degrees == pytest.approx(0.2, abs=0.025)
    assert turned.tilt == pytest.approx(plain.tilt, abs=0.1)
