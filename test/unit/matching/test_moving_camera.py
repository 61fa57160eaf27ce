# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The previous frame follows a camera that drives and turns."""
from dataclasses import replace
from functools import cache

import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels.temporal import warp
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import STEPS
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.matching.over_frames import moving_camera
from fuzzy_stereo_ros.synthetic.scenes import BASELINE, FOCAL, make_sequence
from fuzzy_stereo_ros.synthetic.street import pose, rig_of
from hypothesis import given, settings, strategies as st
from made_scenes import bits, noisy, wrong
import numpy as np
import pytest
import reference_warp as twins

ROWS, COLUMNS, DISPARITIES, DRIVE, PAN = 180, 240, 40, 0.08, 2.0
CAMERA = Camera(FOCAL * COLUMNS, FOCAL * COLUMNS, (COLUMNS - 1) / 2, (ROWS - 1) / 2)


@cache
def drive(noise=0.0):
    """Return four frames; they take long to render, once for all kinds of noise."""
    if noise:
        random = np.random.default_rng(0)
        return [pair._replace(**dict(zip(('left', 'right'), noisy(pair[:2], noise, random))))
                for pair in drive()]
    return list(make_sequence(ROWS, COLUMNS, DISPARITIES, 4, 1, drive=DRIVE, pan=PAN))


@cache
def another_drive():
    """Return frames in which objects move by themselves."""
    return list(make_sequence(ROWS, COLUMNS, DISPARITIES, 4, 2, drive=DRIVE, pan=PAN, noise=2.0,
                              motion=4.0, objects=8))


def matcher(**changes):
    return StereoMatcher(replace(MatcherConfig.from_profile(
        'realtime', disparities=DISPARITIES, threads=1, fill=True), **changes))


def true_motion(frame):
    """Return rotation and shift in baselines of points, from a frame to the next."""
    rig = rig_of(ROWS, COLUMNS, DISPARITIES, FOCAL * COLUMNS, BASELINE)
    (before, place), (now, next_place) = (pose(rig, number, DRIVE, PAN)
                                          for number in (frame, frame + 1))
    return now @ before.T, now @ (place - next_place) / BASELINE


def errors(frames, camera, cold=False, **changes):
    made, found = matcher(**changes), []
    for pair in frames:
        if cold:
            made.reset()
        found.append(wrong(made.match(pair.left, pair.right, camera=camera), pair))
    return np.mean(found[2:])


@settings(max_examples=40)
@given(rows=st.integers(1, 9), columns=st.integers(1, 12), seed=st.integers(0, 999))
def test_kernels_that_move_maps_do_as_their_twins(rows, columns, seed):
    random = np.random.default_rng(seed)
    labels = random.uniform(0, 30, (rows, columns)).astype(np.float32)
    view = np.eye(3, 4) + random.normal(0, 0.01, (3, 4)) * [
        [1, 1, 30, 10], [1, 1, 30, 10], [0.02, 0.02, 5, 0.5]]      # of a camera that moves little
    view, lowest = tuple(view.ravel().tolist()), random.choice((-3.0, 0.0, 4.5))
    moved, source = np.zeros_like(labels), np.zeros(labels.shape, np.int32)
    warp.move_labels(labels, (view, lowest), (moved, source))
    expected = twins.move_labels(labels, lowest, view)
    assert np.array_equal(moved, expected[0]) and np.array_equal(source, expected[1])

    now, before = random.integers(0, 2**24, (2, 2 * rows, 2 * columns), np.uint32)
    half = random.integers(0, 15, (rows, columns), np.uint8)
    distances = np.zeros((2, rows, columns), np.uint8)
    warp.census_distances(moved, half, (view, lowest), (now, before), distances, 0, rows)
    assert np.array_equal(distances, twins.census_distances(moved, half, 3, lowest, view, now,
                                                            before))
    seen = np.zeros_like(labels)
    warp.to_right(moved, -1, seen)
    assert np.array_equal(seen, twins.to_right(moved, -1))
    places = np.zeros((2, rows, columns), np.float32)
    for of_right in (False, True):
        warp.look_back(moved, (view, lowest), -1, of_right, places, 0, rows)
        np.testing.assert_allclose(
            places, twins.look_back(moved, lowest, view, -1, of_right), rtol=1e-6)


@settings(max_examples=40)
@given(rows=st.integers(1, 7), columns=st.integers(1, 9), odd=st.integers(0, 1),
       seed=st.integers(0, 999))
def test_the_prior_of_a_moved_map_is_that_of_the_twins(rows, columns, odd, seed):
    random, shape = np.random.default_rng(seed), (rows, columns)
    full = 2 * rows + odd, 2 * columns + odd
    moved = random.integers(-1, 6, shape).astype(np.float32)
    source = random.integers(0, rows * columns, shape, np.int32)
    source[(moved < 0) | (random.random(shape) < 0.1)] = -1     # nothing moved to it
    sums = random.integers(75, 105, (2, *shape), np.uint16)
    half, survived, before = random.integers(0, 4, (3, *shape), np.uint8)
    moved_weights = np.zeros(shape, np.uint8)
    warp.trusted_moved((moved, source), before, half, sums, moved_weights, 0, rows)
    assert np.array_equal(moved_weights, twins.trusted_moved(
        moved, source, before, sums[0], half, sums[1], (90, 3, 4, 3)))

    weights, known = random.integers(0, 2, full, np.uint8), random.integers(0, 9, full, np.uint8)
    labels, written = np.zeros(full, np.uint8), weights.copy()
    moved_weights[:, -1] = 0        # an odd column at the end has no cell
    warp.moved_prior((moved, moved_weights), 4, known, written, labels, 0, rows)
    expected = twins.moved_prior(moved, moved_weights, 4, known, weights)
    assert np.array_equal(written, expected[1])
    assert np.array_equal(labels[written > 0], expected[0][written > 0])

    cells = (random.integers(0, 90, shape) / STEPS).astype(np.float32)
    now, source = np.zeros(shape, np.uint8), np.maximum(source, 0)
    warp.note_survivors(cells, (moved, source), moved_weights, survived, now, 0, rows)
    assert np.array_equal(now, twins.note_survivors(cells, moved, moved_weights, source, survived))


@pytest.mark.parametrize('frame', range(3))
def test_the_motion_of_a_camera_that_drives_and_turns_is_found(frame):
    first, second = drive()[frame:frame + 2]
    before, now = (np.ascontiguousarray(pair.left.reshape(
        ROWS // 2, 2, COLUMNS // 2, 2).mean(axis=(1, 3)).astype(np.uint8))
        for pair in (first, second))
    consistent = np.zeros(before.shape, np.uint8)
    motion, word = moving_camera.between(before, now, first.truth[::2, ::2], consistent, 0,
                                         CAMERA)
    true, _ = moving_camera.between(before, now, first.truth, consistent, 0,
                                    CAMERA._replace(moved=true_motion(frame)))
    assert word == moving_camera.FOLLOWED
    points = np.array([(column, row, 1, first.truth[row, column])
                       for row in (20, 90, 160) for column in (20, 120, 220)], float).T
    found, wanted = (view.forward @ points for view in (motion, true))
    assert abs(found[:2] / found[2] - wanted[:2] / wanted[2]).max() < 0.5
    assert abs(points[3] / found[2] - points[3] / wanted[2]).max() < 0.2


@pytest.mark.parametrize('least, share', [(0, 0.8), (-7, 0.9), (3, 0.9)])
def test_on_a_drive_with_noise_a_fifth_of_the_errors_go_where_the_camera_is_known(least, share):
    frames = drive(6.0)
    cold = errors(frames, None, cold=True, min_disparity=least)
    assert errors(frames, CAMERA, min_disparity=least) < share * cold
    assert least or errors(frames, None) > 0.9 * cold


def test_objects_that_move_by_themselves_add_no_error():
    frames = another_drive()
    assert errors(frames, CAMERA) <= errors(frames, None, cold=True) + 0.1


def brighter(pair, step=0):
    """Return frames of one pair that gets brighter."""
    return [[np.clip(image + float(step * number), 0, 255).astype(np.uint8) for image in pair]
            for number in range(3)]


@pytest.mark.parametrize('pairs, camera, word', [
    (lambda: brighter(drive()[0][:2]), CAMERA, moving_camera.IN_PLACE),
    (lambda: brighter(2 * [np.full((ROWS, COLUMNS), 90, np.uint8)], 12), CAMERA,
     moving_camera.FEW_CORNERS),
    (lambda: [pair[:2] for pair in (*drive()[:2], another_drive()[1])], CAMERA,
     moving_camera.UNCLEAR),
    (lambda: [pair[:2] for pair in drive()[:2]], None, '')],
    ids=['a picture that stays', 'without texture', 'a cut', 'without a camera'])
def test_where_no_motion_is_found_the_match_says_why_and_after_a_cut_is_as_if_cold(
        pairs, camera, word):
    made, images = matcher(), pairs()
    first, *_, last = (made.match(*pair, camera=camera) for pair in images)
    assert (first.motion, last.motion) == ('', word)
    assert word or 'camera_motion' not in last.times and made.state.camera.cells.size == 0
    if word == moving_camera.UNCLEAR:
        cold = matcher().match(*images[-1])
        np.testing.assert_array_equal(last.disparity, cold.disparity)


def test_the_motion_of_the_right_camera_is_that_of_the_left_one_mirrored_and_is_followed():
    rotation, shift = true_motion(1)
    mirrored = CAMERA._replace(moved=(rotation, shift)).mirrored_right(COLUMNS)
    point = np.array((0.7, -0.3, 9.0))      # in baselines, seen by the left camera
    there = rotation @ point + shift
    turned, moved = mirrored.moved
    seen, expected = ((point - (1, 0, 0)) * (-1, 1, 1), (there - (1, 0, 0)) * (-1, 1, 1))
    np.testing.assert_allclose(turned @ seen + moved, expected, atol=1e-12)
    made = matcher(reference='right')
    match, = [made.match(*pair[:2], camera=CAMERA) for pair in drive()[:3]][2:]
    assert match.motion == moving_camera.FOLLOWED and match.times['camera_motion'] > 0


@pytest.mark.parametrize('camera', [
    CAMERA._replace(fx=1.0, fy=1.0, cx=1.0, cy=1.0), CAMERA._replace(fx=1e9, fy=1e-9),
    CAMERA._replace(offset=1e6), CAMERA._replace(cx=-1e6)])
def test_an_impossible_calibration_raises_no_error(camera):
    made = matcher()
    for pair in drive(6.0)[:3]:
        match = made.match(pair.left, pair.right, camera=camera)
    assert match.motion != '' and np.isfinite(match.disparity).all()


@given(st.integers(-100, 100), st.integers(-100, 100))
def test_tiles_are_as_old_as_those_that_were_there_and_new_where_none_was(down, right):
    ages = np.arange(1, 21, dtype=np.float32).reshape(4, 5)
    expected, (rows, columns) = np.zeros_like(ages), np.mgrid[:4 * TILE, :5 * TILE]
    for tile in np.ndindex(ages.shape):
        row, column = ((TILE * place + TILE // 2 + moved) // TILE
                       for place, moved in zip(tile, (down, right)))
        if 0 <= row < 4 and 0 <= column < 5:
            expected[tile] = ages[row, column]
    assert np.array_equal(moving_camera._ages_at(
        ages, columns + np.float32(right), rows + np.float32(down)), expected)


def test_a_frame_that_is_interrupted_changes_nothing_of_the_next_one(monkeypatch):
    """Half of the picture is in place while the camera moves, so that all priors are written."""
    def interrupted(*arguments, **named):
        raise KeyboardInterrupt

    camera = CAMERA._replace(moved=(np.eye(3), np.array((0.0, 0.0, -0.3))))
    (first, second), half = (frames[0] for frames in (drive(), another_drive())), ROWS // 2
    random = np.random.default_rng(0)
    made, again = matcher(align_rows=False), matcher(align_rows=False)
    made.match(*noisy(first[:2], 2.0, random), camera=camera)
    mixed = [np.vstack([one[:half], other[half:]]) for one, other in zip(first[:2], second[:2])]
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(cv2, 'boxFilter', interrupted)
        made.match(*noisy(mixed, 2.0, random), camera=camera)
    again.restore(made.state, made.rows)
    one, other = (bits(each.match(second.left, second.right, camera=camera))
                  for each in (made, again))
    assert one == other
