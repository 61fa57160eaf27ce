# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Four messages into a pair: what belongs together, sizes, depths, cropping and scale."""
from functools import cache
from itertools import combinations

import cv2
from fuzzed import examples
from fuzzy_stereo_ros.pairs.messages import ENCODINGS
from fuzzy_stereo_ros.pairs.pair_reader import (
    is_inside, largest_window, OFF_IMAGE, PairReader, raw_positions)
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays
from made_messages import header, image, info, noise, region, rejection_of
import numpy as np
import pytest
from raw_camera import CENTRE, COLUMNS, FOCAL, LENSES, RawCamera, ROWS


@pytest.mark.parametrize('names', combinations(['mono8', 'mono16', 'bgr8', 'bgr16'], 2))
def test_a_pair_has_the_stamp_and_frame_of_the_left_image_and_images_that_are_equally_deep(names):
    formats = [ENCODINGS[name] for name in names]
    images = [noise(80, 100, channels, dtype) for dtype, channels, _ in formats]
    left, right = map(image, images, names)
    right.header = header((12, 346), 'right_optical')
    pair = PairReader().read(left, info(), right, info(tx=-24.0))
    assert (pair.stamp, pair.frame_id) == (12_000_000_345, 'left_optical')
    assert pair.calibration == Calibration(200.0, 0.12, 0.0, Projection(200.0, 200.0, 50.0, 40.0))
    deep = np.uint16 in [dtype for dtype, *_ in formats]
    for found, stored in zip((pair.left, pair.right), images):
        assert (found.dtype, found.shape) == (np.uint16 if deep else np.uint8, stored.shape)
        assert found.dtype != stored.dtype or np.array_equal(found, stored)


def test_a_stamp_of_0_and_an_empty_frame_get_a_remark_while_they_last():
    reader = PairReader()
    for stamp, frame, told in ((2, 0), 'c', []), ((0, 0), 'c', ['stamp']), (
            (0, 0), '', ['stamp', 'frame_id']), ((0, 1), '', ['frame_id']), ((1, 0), 'c', []):
        message = image(noise(80, 100), 'mono8')
        message.header = header(stamp, frame)
        pair = reader.read(message, info(), image(noise(80, 100, 1), 'mono8'), info(tx=-24.0))
        assert [remark.split(' of ')[0] for remark in pair.calibration.remarks] == [
            f'the {name}' for name in told]
        assert all('let the driver set header.' in one for one in pair.calibration.remarks)


@pytest.mark.parametrize('size, effect', [
    ((160, 200), 'depth and points are 2 times too near, as fx is of the other size: publish '
                 'the camera_info of this size'),
    *((size, 'if it is cut out, points lie beside their place: give its region of interest in '
             'both camera_info') for size in ((80, 60), (79, 100), (80, 101), (81, 101)))])
def test_what_an_unexpected_size_does_to_depth_and_points_is_told(size, effect):
    pair = PairReader().read(image(noise(*size), 'mono8'), info(),
                             image(noise(*size), 'mono8'), info(tx=-24.0))
    assert [remark.split(': ', 1)[1] for remark in pair.calibration.remarks] == 2 * [effect]


ELSEWHERE = [200.0, 0, 5050, -24, 0, 200, 40, 0, 0, 0, 1, 0]
UNEXPECTED = ('the left image is 90x80, its camera_info expects 100x80; it can be neither '
              'rectified nor cropped: correct the camera_info, or set rectify and crop to false')


@pytest.mark.parametrize('options, left, right, changes, reason, sentence', [
    ({}, (80, 100), (80, 99), {}, 'size',
     'the left image is 100x80, the right one 99x80; a pair needs two of one size'),
    ({'scale': 0.25}, (3, 100), (3, 100), {}, 'size', 'the images are 100x3; scale 0.25 averages '
     'blocks of 4x4 pixels and needs one at least'),
    ({'rectify': True}, (80, 90), (80, 90), {}, 'size', UNEXPECTED),
    ({'crop': True}, (80, 90), (80, 90), {}, 'size', UNEXPECTED),
    ({'crop': True}, (80, 100), (80, 100), {'p': ELSEWHERE}, 'calibration',
     'no rectangle is left in which both rectified images have pixels; K, D, R and P')])
def test_images_that_make_no_pair_are_rejected(options, left, right, changes, reason, sentence):
    rejection = rejection_of(PairReader(**options).read, image(noise(*left), 'mono8'), info(),
                             image(noise(*right), 'mono8'), info(tx=-24.0, **changes))
    assert rejection.reason == reason
    assert str(rejection).startswith(sentence)


# ---- rectified here ----


def cameras(model):
    """Return the left and the right camera of a rig."""
    return (RawCamera(model, (0.02, -0.03, 0.015)),
            RawCamera(model, (-0.015, 0.025, -0.01), right=0.1))


@cache
def seen(model, encoding):
    """Return a made pair, and [(camera, what it sees)] of a rig with a lens."""
    pair = make_pair(ROWS, COLUMNS, 32, seed=3, colour=encoding == 'bgr8',
                     bits=12 if encoding == 'mono16' else 8)
    return pair, [(camera, camera.raw(shown)) for camera, shown in zip(cameras(model), pair)]


def messages_of(model='plumb_bob', encoding='mono8', white=False):
    """Return the four messages of the rig, before a white wall if that is said."""
    return [message for camera, raw in seen(model, encoding)[1] for message in (
        image(np.full_like(raw, 255) if white else raw, encoding), camera.info())]


@pytest.mark.parametrize('model, encoding', zip(LENSES, ('mono8', 'bgr8', 'mono16', 'mono8')))
def test_raw_images_are_rectified_to_what_the_lens_was_shown(model, encoding):
    read = PairReader(rectify=True, crop=True).read(*messages_of(model, encoding))
    column, row = (round(centre - here) for centre, here in zip(CENTRE, read.calibration.left[2:]))
    for found, shown in zip((read.left, read.right), seen(model, encoding)[0]):
        assert found.dtype == shown.dtype
        error = abs(found.astype(float) - shown[row:, column:][:len(found), :found.shape[1]])
        assert error.mean() < 0.01 * shown.max()
    assert read.calibration.focal == FOCAL
    assert read.calibration.baseline == pytest.approx(0.1)
    assert read.calibration.offset == 0


def test_a_raw_bayer_pair_is_filled_in_before_it_is_rectified():
    messages = messages_of()
    for message in messages[::2]:
        message.encoding = 'bayer_grbg8'
    read = PairReader(rectify=True).read(*messages)
    coloured = cv2.cvtColor(np.frombuffer(messages[0].data, np.uint8).reshape(ROWS, COLUMNS),
                            cv2.COLOR_BayerGB2BGR)
    places = raw_positions('left', messages[1], ROWS, COLUMNS)
    np.testing.assert_array_equal(read.left, cv2.remap(
        coloured, *cv2.convertMaps(*places, cv2.CV_16SC2), cv2.INTER_LINEAR))


@pytest.mark.parametrize('name, value', [
    ('d', [-0.2, 0.08, 0, 0, 0]), ('k', [310.0, 0, 155, 0, 305, 122, 0, 0, 1]),
    ('r', [1.0, 0, 0, 0, 1, 0, 0, 0, 1]), ('distortion_model', ''),
    ('p', [280.0, 0, 161, 0, 0, 280, 118, 0, 0, 0, 1, 0]),
    ('roi', region(x_offset=2, width=COLUMNS, height=ROWS))])
def test_whatever_changes_in_a_calibration_counts_from_the_next_pair_on(name, value):
    messages, reader = messages_of(), PairReader(rectify=True)
    before = reader.read(*messages).left
    setattr(messages[1], name, value)
    after = reader.read(*messages).left
    assert (before != after).any()
    np.testing.assert_array_equal(after, PairReader(rectify=True).read(*messages).left)


def test_a_pair_that_is_kept_is_not_overwritten_by_the_next():
    reader = PairReader(rectify=True, crop=True, scale=0.5)
    kept = reader.read(*messages_of())
    before = kept.left.copy(), kept.right.copy()
    reader.read(*messages_of(white=True))
    np.testing.assert_array_equal((kept.left, kept.right), before)


@examples(40)
@given(st.floats(0, 40), st.floats(0.2, 0.6), st.sampled_from([-0.05, -0.25, -0.4]))
def test_a_ray_at_a_right_angle_to_the_lens_hides_no_pixel_that_it_sees(turned, focal, k1):
    """A barrel that folds back where its derivative is 0: 1 + 3 k1 radius**2."""
    rotation, wide = cv2.Rodrigues(np.array([0.0, np.radians(turned), 0.0]))[0], 0.45 * COLUMNS
    lens = [wide, 0, COLUMNS / 2, 0, wide, ROWS / 2, 0, 0, 1]
    near = focal * COLUMNS
    message = info(height=ROWS, width=COLUMNS, k=lens, d=[k1, 0, 0, 0, 0],
                   r=rotation.ravel().tolist(),
                   p=[near, 0, COLUMNS / 2, 0, 0, near, ROWS / 2, 0, 0, 0, 1, 0])
    found = is_inside(*raw_positions('left', message, ROWS, COLUMNS), ROWS, COLUMNS)
    row, column = np.mgrid[:ROWS, :COLUMNS]
    x, y, z = np.moveaxis(np.stack([(column - COLUMNS / 2) / near, (row - ROWS / 2) / near,
                                    np.ones((ROWS, COLUMNS))], axis=-1) @ rotation, -1, 0)
    radius, fold = np.hypot(x, y) / np.where(z > 0, z, 1e-9), (-3 * k1)**-0.5
    spread = 1 + k1 * np.minimum(radius, fold)**2
    places = [wide * side / np.where(z > 0, z, 1) * spread + centre
              for side, centre in ((x, COLUMNS / 2), (y, ROWS / 2))]
    sure = (abs(radius / fold - 1) > 2e-3) & np.all([
        (abs(place) > 0.1) & (abs(place - size + 1) > 0.1)
        for place, size in zip(places, (COLUMNS, ROWS))], axis=0)
    expected = (z > 0) & (radius < fold) & is_inside(*places, ROWS, COLUMNS)
    np.testing.assert_array_equal(found[sure], expected[sure])


# ---- cut ----


@pytest.mark.parametrize('scale', [1.0, 0.5])
def test_a_rectified_pair_names_the_pixels_without_source_and_a_cut_one_has_none(scale):
    messages = messages_of(white=True)
    whole = PairReader(rectify=True, scale=scale).read(*messages)
    for image_read, missing in zip((whole.left, whole.right), whole.missing):
        assert missing.shape == image_read.shape[:2] and missing.dtype == bool
        assert missing[image_read < 255].all()
        assert 0 < missing.mean() < 0.3
    assert PairReader(rectify=True, crop=True, scale=scale).read(*messages).missing is None
    assert PairReader(scale=scale).read(*messages).missing is None


def test_where_nothing_is_missing_nothing_is_cut_or_copied():
    messages = (image(noise(80, 100), 'mono8'), info(),
                image(noise(80, 100), 'mono8'), info(tx=-24.0))
    pair = PairReader(crop=True).read(*messages)
    assert pair.left.shape == (80, 100)
    assert pair.calibration == PairReader().read(*messages).calibration
    assert np.shares_memory(pair.left, np.frombuffer(messages[0].data, np.uint8))


def test_a_camera_info_without_a_size_takes_the_images_as_they_are():
    pair = PairReader(rectify=True).read(
        image(noise(80, 90), 'mono8'), info(width=0, height=0),
        image(noise(80, 90), 'mono8'), info(tx=-24.0, width=0))
    np.testing.assert_array_equal(pair.left, noise(80, 90))


# ---- reduced ----


def assert_reduced(found, image, scale):
    """Compare an image with the means of the blocks of another one."""
    block = round(1 / scale)
    rows, columns = (side // block for side in image.shape[:2])
    blocks = image[:rows * block, :columns * block].reshape(
        rows, block, columns, block, *image.shape[2:])
    assert found.shape == (rows, columns, *image.shape[2:])
    assert found.dtype == image.dtype and found.flags.c_contiguous
    assert abs(found - blocks.mean(axis=(1, 3))).max() <= 0.5


@given(st.sampled_from([0.5, 0.25]), st.integers(4, 103), st.integers(4, 103),
       st.sampled_from(['mono8', 'mono16', 'bgr8', 'bgr16']), st.integers(0, 9))
def test_a_reduced_image_is_the_mean_of_blocks(scale, rows, columns, encoding, seed):
    dtype, channels, _ = ENCODINGS[encoding]
    images = [noise(rows, columns, channels, dtype, seed + side) for side in (0, 1)]
    sizes = {'height': 0, 'width': 0}
    pair = PairReader(scale=scale).read(image(images[0], encoding), info(**sizes),
                                        image(images[1], encoding), info(tx=-24.0, **sizes))
    for found, full in zip((pair.left, pair.right), images):
        assert_reduced(found, full, scale)


@pytest.mark.parametrize('scale', [0.5, 0.25])
def test_what_is_rectified_and_cut_is_reduced_last(scale):
    messages = messages_of()
    cut = PairReader(rectify=True, crop=True).read(*messages)
    small = PairReader(rectify=True, crop=True, scale=scale).read(*messages)
    assert_reduced(small.left, cut.left, scale)
    assert small.calibration == cut.calibration.scaled(scale)


# ---- the rectangle in which no pixel is missing ----


@given(arrays.arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_nothing_is_missing_in_the_window(there):
    window = largest_window(there)
    assert there[window].all()
    assert there[window].size > 0 or window == (slice(0, 0), slice(0, 0))


def largest_area(there):
    """Return the area of the largest rectangle in which nothing is missing."""
    best, heights = 0, np.zeros(there.shape[1], int)
    for row in there:
        heights = (heights + 1) * row
        for first in range(heights.size):
            lowest = np.minimum.accumulate(heights[first:])
            best = max(best, int((lowest * np.arange(1, lowest.size + 1)).max()))
    return best


def turned(degrees):
    """Return which pixels of an image are there when it is turned."""
    turn = cv2.getRotationMatrix2D((60, 40), degrees, 1)
    turn[:, 2] += degrees, -3
    return cv2.warpAffine(np.full((80, 120), 255, np.uint8), turn, (120, 80)) == 255


def without_corner(rows, columns):
    there = np.ones((10, 100), bool)
    there[:rows, :columns] = False
    return there


@examples(40)
@given(st.builds(turned, st.integers(-8, 8)) | st.builds(
    without_corner, st.integers(0, 9), st.integers(0, 99)) | st.builds(
        lambda *borders: np.pad(np.ones((10, 12), bool), np.reshape(borders, (2, 2))),
        *4 * [st.integers(0, 4)]))
def test_the_window_is_nearly_the_largest_there_is_where_borders_or_corners_are_missing(there):
    assert there[largest_window(there)].size >= 0.99 * largest_area(there)


# ---- the maps of a rectification, against a plain camera and what a lens cannot show ----


# The names of lenses, and whether numbers may follow the coefficients.
NAMES = {'plumb_bob': (['plumb_bob', 'radial-tangential'], [[]]),
         'equidistant': (['Fisheye', 'equi', 'equidistant'], [[0.0]]),
         'rational_polynomial': (['rational_polynomial'], [[]]),
         'fisheye': (['equidistant', 'fisheye', 'Kannala-Brandt', 'equi'],
                     [[], [0.0] * 4, [0.0] * 5, [0.0] * 14]),
         '': (['', 'plumb_bob', 'unheard of'], [[], [0.0] * 6])}


@examples(40)
@given(data=st.data(), model=st.sampled_from([*LENSES]), side=st.sampled_from([0, 1]),
       depth=st.floats(0.5, 20), bins=st.tuples(*2 * [st.integers(1, 4)]),
       begin=st.tuples(*2 * [st.integers(0, 40)]))
def test_a_rectified_pixel_comes_from_where_the_camera_sees_its_point(
        data, model, side, depth, bins, begin):
    """Whatever a lens is called, how many zeros follow its coefficients, binning and region."""
    names, more = NAMES[model]
    camera, (across, down), (x, y) = cameras(model)[side], bins, begin
    rows, columns = (ROWS - y) // down, (COLUMNS - x) // across
    named = camera.info(
        binning_x=across, binning_y=down, roi=region(x, y, rows * down, columns * across),
        distortion_model=data.draw(st.sampled_from(names)))
    named.d = named.d + (data.draw(st.sampled_from(more)) if named.distortion_model else [0.1] * 5)
    row, column = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    points = depth * np.stack([
        (column - CENTRE[0]) / FOCAL, (row - CENTRE[1]) / FOCAL, np.ones_like(row)])
    points[0] += camera.right
    seen = np.stack(camera.sees(points))[
        :, y:y + rows * down:down, x:x + columns * across:across]
    np.testing.assert_allclose(
        raw_positions('left', named, rows, columns),
        (seen - [[[x]], [[y]]]) / [[[across]], [[down]]], rtol=0, atol=1e-4)


@pytest.mark.parametrize('model, coefficients, last', [
    ('plumb_bob', [-0.4, 0, 0, 0, 0], 1 / np.sqrt(3 * 0.4)),
    ('rational_polynomial', [0, 0, 0, 0, 0, 1.0, 0, 0], 1.0),
    ('rational_polynomial', [0, 0, 0, 0, 0, -1.0, 0, 0], 1.0),
    ('equidistant', [-0.5, 0, 0, 0], np.tan(np.sqrt(1 / 1.5)))])
def test_what_lies_beyond_where_a_lens_turns_back_comes_from_nowhere(model, coefficients, last):
    strong = info(distortion_model=model, d=coefficients,
                  p=[30.0, 0, 50, 0, 0, 30, 40, 0, 0, 0, 1, 0])
    down, across = np.mgrid[:80, :100]
    radius = np.hypot(across - 50, down - 40) / 30
    nowhere = np.equal(raw_positions('left', strong, 80, 100), OFF_IMAGE).all(axis=0)
    assert nowhere[radius > last + 0.01].all()
    assert not nowhere[radius < last - 0.01].any()


def test_a_place_is_inside_where_its_four_pixels_are():
    x, y = np.float32([0, -0.01, -0.02, 9, 9.01, 9.02, 5, 5, np.inf]), np.float32([0] * 9)
    y[6:8] = 4, 4.5
    inside = [True, True, False, True, True, False, True, False, False]
    assert is_inside(x, y, 5, 10).tolist() == inside


@pytest.mark.parametrize('changes, sentence', [
    ({'r': [0.0] * 9}, 'left camera_info: R is not a rotation; calibrate the two cameras as a'),
    ({'r': [1.0, 0, 0, 0, 1, 0, 0, 0, -1]}, 'left camera_info: R is not a rotation'),
    ({'k': [200.0, 0, 50, 0, 0, 40, 0, 0, 1]}, 'left camera_info: K is not of a calibrated'),
    ({'distortion_model': 'fov', 'd': [0.9]},
     "left camera_info: distortion_model is 'fov'; allowed are plumb_bob, rational_polynomial, "
     'equidistant; for others'),
    ({'d': [0.1] * 3}, 'left camera_info: D has 3 numbers; allowed for plumb_bob are 4, 5, 8,'),
    ({'d': [0.1, float('nan'), 0, 0]}, 'left camera_info: D has 4 numbers; allowed for plumb_bo'),
])
def test_a_camera_that_cannot_be_rectified_is_rejected_with_a_sentence(changes, sentence):
    rejection = rejection_of(raw_positions, 'left', info(**changes), 80, 100)
    assert rejection.reason == 'calibration'
    assert str(rejection).startswith(sentence)
