# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""By how much the rows of a pair do not fit is found, told by kind, and never where they do."""
from types import SimpleNamespace

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs import epipolar
from fuzzy_stereo_ros.pairs.epipolar import corner_offsets, EpipolarCheck, Misalignment
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence, misaligned
import numpy as np
import pytest
from real_pairs import DATA, kitti_frames, middlebury, motorcycle, read_grey, third_size

ROWS, COLUMNS, DISPARITIES = 240, 320, 32
ERRORS = ({'tilt': 0.3}, {'tilt': -1.0}, {'roll': 0.2}, {'roll': -0.4}, {'zoom': 0.5},
          {'zoom': -0.4}, {'tilt': 0.8, 'roll': 0.1, 'zoom': -0.2})
CALIBRATION = Calibration(200.0, 0.1, 0.0, Projection(200.0, 200.0, 160.0, 120.0))


@pytest.fixture(scope='module')
def scene():
    return make_pair(ROWS, COLUMNS, DISPARITIES, seed=2, objects=6, noise=2.0)


def checked(pairs, disparities, **changes):
    """Return the Misalignment of (left, right)s that are matched one after the other."""
    matcher = StereoMatcher(MatcherConfig(disparities=disparities, **changes))
    check = EpipolarCheck()
    for left, right in pairs:
        match = matcher.match(left, right)
        check.measure(left, right, match.disparity, match.confidence, matcher.config.reference)
    return check.misalignment


def known(made, right=None):
    """Return what `look` takes of a made pair, its truth as the disparity."""
    return (made.left, made.right if right is None else right, made.truth,
            made.visible.astype(np.float32))


def at_the_edges(tilt=0.0, roll=0.0, zoom=0.0):
    """Return offset, roll and zoom of a moved image, px."""
    return tilt, np.deg2rad(roll) * COLUMNS / 2, zoom / 100 * ROWS / 2


@pytest.mark.parametrize('error', ERRORS, ids=str)
def test_tilt_roll_and_zoom_are_recovered_to_a_tenth_of_a_pixel(scene, error):
    found = checked([(scene.left, misaligned(scene.right, **error))], DISPARITIES)
    assert found[1:4] == pytest.approx(at_the_edges(**error), abs=0.1)
    assert max(found.doubts) < 0.05
    assert found.roll_degrees == pytest.approx(error.get('roll', 0.0), abs=0.03)
    assert found.zoom_percent == pytest.approx(error.get('zoom', 0.0), abs=0.08)


@pytest.mark.parametrize('error, fault, words', [
    ({'tilt': 0.8}, 'tilt', 'recalibrate: the right image is 0.'),
    ({'roll': 0.4}, 'roll', 'recalibrate: the right camera is turned by +0.'),
    ({'zoom': -0.7}, 'zoom', 'recalibrate: the right image is -0.')])
def test_an_error_above_half_a_pixel_is_told_by_its_kind(scene, error, fault, words):
    found = checked([(scene.left, misaligned(scene.right, **error))], DISPARITIES)
    assert found.faults == [fault]
    assert found.advice.startswith(words)
    assert found.sentence.endswith(found.advice)


def test_images_that_fit_are_no_fault(scene):
    found = checked([(scene.left, scene.right)], DISPARITIES)
    assert np.abs(found[1:4]).max() < 0.05
    assert (found.faults, found.advice) == ([], '')
    assert found.sentence.endswith('they fit')


@pytest.mark.parametrize('swing, faults', [(0.3, []), (0.9, ['timing'])])
def test_exposures_at_different_moments_swing_from_pair_to_pair(swing, faults):
    shifts = 2**0.5 * swing * np.sin(np.arange(24))     # as of a camera that shakes
    frames = make_sequence(120, 200, 16, len(shifts), seed=1, noise=1.0, pan=2.0)
    check = EpipolarCheck()
    for made, shift in zip(frames, shifts):
        check.measure(*known(made, misaligned(made.right, tilt=shift)))
    assert check.misalignment.swing == pytest.approx(np.std(shifts), abs=0.1)
    assert check.misalignment.faults == faults
    assert check.misalignment.advice.startswith('synchronise' if faults else '')


def test_pairs_without_change_have_no_swing_and_few_pairs_none_at_all(scene):
    check = EpipolarCheck()
    for _ in range(epipolar.PAIRS_OF_SWING - 1):
        check.measure(*known(scene))
    assert check.misalignment.swing is None
    check.measure(*known(scene))
    assert check.misalignment.swing == pytest.approx(0, abs=1e-6)


def test_an_error_that_is_not_sure_is_no_fault():
    found = Misalignment(0.6, 0.6, 0.0, 0.0, (0.04, 0.04, 0.04), None, 50, 1, ROWS, COLUMNS)
    assert found.faults == ['tilt']
    assert found._replace(doubts=(0.06, 0.06, 0.06)).faults == []
    assert found._replace(offset=0.49, doubts=(0.0, 0.0, 0.0)).faults == []


def test_the_same_corners_seen_often_are_no_surer(scene):
    once, often = EpipolarCheck(), EpipolarCheck()
    once.measure(*known(scene))
    for _ in range(10):
        often.measure(*known(scene))
    assert often.misalignment.corners == 10 * once.misalignment.corners
    assert often.misalignment.doubts == pytest.approx(once.misalignment.doubts, rel=1e-6)


def test_mistakes_of_the_flow_do_not_move_the_result(scene):
    found = corner_offsets(*known(scene))
    spoilt = found.copy()
    spoilt[::5, 2] += 4.0
    plain, robust = (epipolar.misalignment_of([one], ROWS, COLUMNS) for one in (found, spoilt))
    assert robust[1:4] == pytest.approx(plain[1:4], abs=0.02)


def test_the_right_image_as_reference_tells_the_same(scene):
    right = misaligned(scene.right, tilt=0.7)
    of_the_right = checked([(scene.left, right)], DISPARITIES, reference='right')
    assert of_the_right.offset == pytest.approx(0.7, abs=0.1)


@pytest.mark.parametrize('images', [
    lambda left, right: (left.astype(np.uint16) * 250, right.astype(np.uint16) * 250),
    lambda left, right: (np.stack([left] * 3, 2), right),
    lambda left, right: (left, (0.4 * right + 60).astype(np.uint8))],
    ids=['16 bits', 'colour', 'darker'])
def test_any_kind_of_image_will_do_and_cameras_may_differ_in_gain(scene, images):
    left, right = images(scene.left, misaligned(scene.right, tilt=0.7))
    check = EpipolarCheck()
    check.measure(left, right, *known(scene)[2:])
    assert check.misalignment.offset == pytest.approx(0.7, abs=0.05)


@pytest.mark.parametrize('rows, columns', [(1, 1), (10, 400), (59, 80), (60, 60), (61, 103)])
def test_small_and_plain_images_tell_nothing_and_break_nothing(rows, columns):
    plain, textured = np.full((rows, columns), 90, np.uint8), np.random.default_rng(0).integers(
        0, 255, (rows, columns), np.uint8)
    disparity, confidence = np.zeros((rows, columns), np.float32), np.ones(
        (rows, columns), np.float32)
    for image, sureness in ((plain, confidence), (textured, 0 * confidence)):
        check = EpipolarCheck()
        check.measure(image, image, disparity, sureness)
        assert check.misalignment is None
    check.measure(textured, textured, disparity * np.nan, confidence)
    assert check.misalignment is None


def test_few_corners_or_few_places_tell_nothing():
    random = np.random.default_rng(0)
    corners = np.column_stack([random.uniform(0, COLUMNS, 200), random.uniform(0, ROWS, 200),
                               np.zeros(200)])
    assert epipolar.misalignment_of([corners[:epipolar.FEWEST[0]]], ROWS, COLUMNS) is not None
    assert epipolar.misalignment_of([corners[:epipolar.FEWEST[0] - 1]], ROWS, COLUMNS) is None
    corners[:, :2] %= 60       # the upper left tiles
    assert epipolar.misalignment_of([corners], ROWS, COLUMNS) is None


def test_invalid_pixels_take_no_part(scene):
    left, right, disparity, confidence = known(scene)
    disparity = disparity.copy()
    disparity[:, 160:] = np.nan
    confidence[:120] = 0
    found = corner_offsets(left, right, disparity, confidence)
    assert len(found) > 10
    assert (found[:, 0] < 160).all() and (found[:, 1] >= 119).all()


def watched(check, made, milliseconds, calibration=CALIBRATION, tilt=0.0):
    pair = StereoPair(made.left, misaligned(made.right, tilt=tilt), calibration, 0)
    check.measure_within_share(pair, SimpleNamespace(
        disparity=made.truth, confidence=made.visible.astype(np.float32),
        times={'total': milliseconds}))
    return check.misalignment


def test_watching_takes_its_share_of_the_time_and_not_more(scene, monkeypatch):
    check, clock = EpipolarCheck(), iter(range(1000))
    # Each look takes 1 s by this clock, a tenth of which each match pays.
    monkeypatch.setattr(epipolar.time, 'perf_counter', lambda: next(clock))
    looks = [watched(check, scene, 100 / epipolar.SHARE).pairs for _ in range(31)]
    assert looks == [*[1] * 9, *[2] * 10, *[3] * 10, 4, 4]


def test_another_calibration_or_size_begins_anew(scene):
    check = EpipolarCheck()
    assert watched(check, scene, 1e9, tilt=0.9).faults == ['tilt']
    assert watched(check, scene, 1e9, tilt=0.9).pairs == 2
    new = watched(check, scene, 1e9, CALIBRATION.scaled(0.9))
    assert (new.pairs, new.faults) == (1, [])
    smaller = make_pair(120, 200, 16, seed=1)
    check.measure(*known(smaller))
    assert (check.misalignment.pairs, check.misalignment.columns) == (1, 200)


REAL = {
    **{name: lambda name=name: (middlebury(name), ) for name in ('tsukuba', 'venus', 'teddy',
                                                                 'cones')},
    **{name: lambda name=name: (third_size(name, 370, 413),) for name in ('Bowling1', 'Aloe')},
    'Motorcycle': lambda: (motorcycle(),)}


@pytest.mark.parametrize('name', REAL)
def test_a_real_pair_fits_as_it_is_and_is_found_turned_by_a_fifth_of_a_degree(name):
    (pair,) = REAL[name]()
    plain, turned = (checked([(pair.left, right)], pair.disparities)
                     for right in (pair.right, misaligned(pair.right, roll=0.2)))
    assert plain.faults == []
    assert turned.faults == ['roll']
    assert turned.roll_degrees - plain.roll_degrees == pytest.approx(0.2, abs=0.025)
    assert turned.offset == pytest.approx(plain.offset, abs=0.1)


@pytest.mark.parametrize('name, numbers', [('000027', range(7, 12)), ('000138', (10, 11))])
def test_a_drive_of_kitti_raises_no_alarm(name, numbers):
    found = checked(kitti_frames(name, numbers)[0], 96)
    assert found.faults == []
    assert found.corners > 200


def test_a_flight_of_euroc_raises_no_alarm():
    folder = DATA / 'euroc_v101_rect'
    found = checked([[read_grey(folder / side / f'{number:04d}.png') for side in (
        'left', 'right')] for number in range(0, 30, 3)], 64)
    assert np.abs(found[1:4]).max() < 0.1
    assert found.faults == []
