# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages into images and calibrations, on stand-ins and on ROS's own messages."""
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.pairs.calibration import read_calibration
from fuzzy_stereo_ros.pairs.messages import ENCODINGS, fill_pixels, read_image, SEMI_PLANAR
from fuzzy_stereo_ros.pairs.stereo_pair import Projection, SIDES
from hypothesis import given, strategies as st
from made_messages import (
    compressed, image, info, noise, projection, region, rejection_of)
import numpy as np
import pytest

LEFT = Projection(200.0, 200.0, 50.0, 40.0)

images = st.tuples(
    st.sampled_from(sorted(ENCODINGS)), st.integers(4, 9), st.integers(4, 9),
    st.integers(0, 5), st.booleans(), st.integers(0, 99))


@given(images)
def test_every_encoding_is_read_whatever_the_padding_and_byte_order(drawn):
    encoding, rows, columns, padding, big_endian, seed = drawn
    dtype, channels, conversion = ENCODINGS[encoding]
    pixels = noise(rows, columns, channels, dtype, seed)
    message = image(pixels, encoding, padding, big_endian)
    if encoding in SEMI_PLANAR:
        message.data += bytes(message.step * ((rows + 1) // 2))      # the chroma of nv12
    read = read_image(message)
    if conversion is None:
        expected = pixels
    elif conversion == 'first':
        expected = pixels[:, :, 0]
    elif conversion == 'second':
        expected = pixels[:, :, 1]
    else:
        expected = cv2.cvtColor(pixels, conversion)
    assert read.dtype == dtype
    assert read.flags.c_contiguous
    np.testing.assert_array_equal(read, expected)


@pytest.mark.parametrize('encoding, order', [
    ('bgr', (0, 1, 2)), ('rgb', (2, 1, 0)), ('bgra', (0, 1, 2)), ('rgba', (2, 1, 0))])
@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_colour_comes_out_as_bgr(encoding, order, dtype):
    encoding = f'{encoding}{8 * np.dtype(dtype).itemsize}'
    pixels = noise(5, 7, ENCODINGS[encoding][1], dtype)
    np.testing.assert_array_equal(read_image(image(pixels, encoding)), pixels[:, :, order])


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_a_bayer_pattern_gives_its_own_colours(pattern, dtype):
    colours = {'b': 40, 'g': 90, 'r': 200}
    tile = np.array([colours[name] for name in pattern], dtype).reshape(2, 2)
    read = read_image(image(np.tile(tile, (4, 4)), f'bayer_{pattern}{8 * tile.itemsize}'))
    np.testing.assert_array_equal(read[4, 4], [40, 90, 200])


@pytest.mark.parametrize('rows', [1, 2])
def test_what_is_written_is_read_also_a_single_row_cut_from_an_image(rows):
    pixels = noise(2, 9)[:rows, :6]
    message = fill_pixels(SimpleNamespace(), pixels, 'mono8')
    assert message.step == 6
    np.testing.assert_array_equal(read_image(message), pixels)


@pytest.mark.parametrize('encoding', SEMI_PLANAR)
def test_luma_is_dense_where_step_counts_the_two_channels_of_sensor_msgs(encoding):
    pixels = noise(4, 6)
    message = image(pixels, encoding, step=12)
    message.data += bytes(24)
    np.testing.assert_array_equal(read_image(message), pixels)


@pytest.mark.parametrize('changes, reason, sentence', [
    ({'encoding': '32FC1'}, 'encoding', "encoding is '32FC1'; allowed are mono8, 8UC1, bgr8"),
    ({'height': 0}, 'size', 'the image is 6x0; it needs at least one pixel'),
    ({'step': 5}, 'size', 'step is 5 bytes, but 6 pixels of mono8 need 6'),
    ({'width': 2**31, 'step': 2**31}, 'size', 'data has 24 bytes, but 4 rows of 2147483648'),
])
def test_an_image_that_cannot_be_right_is_rejected_with_a_sentence(changes, reason, sentence):
    rejection = rejection_of(read_image, image(noise(4, 6), 'mono8', **changes))
    assert rejection.reason == reason
    assert str(rejection).startswith(sentence)


def test_a_compressed_image_keeps_sixteen_bits_and_loses_alpha():
    deep = noise(6, 8, dtype=np.uint16)
    np.testing.assert_array_equal(
        read_image(compressed(cv2.imencode('.png', deep)[1].tobytes())), deep)
    clear = noise(6, 8, 4)
    np.testing.assert_array_equal(
        read_image(compressed(cv2.imencode('.png', clear)[1].tobytes())), clear[:, :, :3])


@pytest.mark.parametrize('form', [
    'png', 'bgr8; png compressed bgr8', 'rgb8; png compressed bgr8', 'rgb8; png compressed',
    'yuv422; png compressed bgr8', 'bayer_rggb8; png compressed bgr8'])
def test_a_compressed_image_is_bgr_whatever_was_compressed(form):
    pixels = noise(6, 8, 3)
    content = cv2.imencode('.png', pixels)[1].tobytes()
    np.testing.assert_array_equal(read_image(compressed(content, form)), pixels)


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('ending', ['', ' ', ' bayer'])
def test_a_compressed_bayer_pattern_is_filled_in_as_a_raw_one(pattern, dtype, ending):
    mosaic = noise(6, 8, dtype=dtype)
    encoding = f'bayer_{pattern}{8 * mosaic.itemsize}'
    content = cv2.imencode('.png', mosaic)[1].tobytes()
    read = read_image(compressed(content, f'{encoding}; png compressed{ending}'))
    np.testing.assert_array_equal(read, read_image(image(mosaic, encoding)))


@pytest.mark.parametrize('suffix', ['.bmp', '.tiff', '.webp', '.pgm'])
def test_files_of_other_kinds_never_reach_the_decoders_of_opencv(suffix, monkeypatch):
    content = cv2.imencode(suffix, np.full((6, 8), 40, np.uint8))[1].tobytes()
    monkeypatch.setattr(cv2, 'imdecode', lambda *_: pytest.fail('it was decoded'))
    assert 'allowed are JPEG and PNG' in str(rejection_of(read_image, compressed(content)))


def test_texts_of_messages_are_told_short_and_without_what_a_terminal_obeys():
    hostile = '\x1b[2J\n[INFO] all is well' + 1000 * 'x'
    for rejection in (rejection_of(read_image, image(np.zeros((4, 4), np.uint8), hostile)),
                      rejection_of(read_image, compressed(b'', hostile))):
        assert str(rejection).isprintable()
        assert len(str(rejection)) < 600


def test_binning_and_region_change_focal_length_and_offset_but_not_the_baseline():
    changes = {'binning_x': 2, 'binning_y': 2}
    calibration = read_calibration(
        info(roi=region(x_offset=10, height=60, width=80), **changes),
        info(tx=-24.0, cx=60.0, roi=region(x_offset=4, height=60, width=80), **changes))
    assert calibration.focal == 100.0
    assert calibration.baseline == pytest.approx(0.12)
    assert calibration.offset == ((50 - 10) - (60 - 4)) / 2


@pytest.mark.parametrize('left, right, sentence', [
    ({}, {'tx': 24.0}, 'the baseline is -0.12 m: left and right are swapped, or Tx is in'),
    ({}, {'p': projection(p7=-24.0)}, 'Ty of the pair is -24: the cameras are mounted one above'),
    ({'p': [0.0] * 12}, {'tx': -24.0}, 'left camera_info: the camera is not calibrated (P[0] is '),
    ({}, {'p': projection(p0=5e-324), 'binning_x': 9}, 'right camera_info: the camera is not ca'),
    ({}, {'p': projection(p3=float('inf'))}, 'right camera_info: P is not twelve finite numbers'),
    ({}, {'p': []}, 'right camera_info: P is not twelve finite numbers'),
    ({'binning_x': 2}, {'tx': -24.0}, 'the cameras bin 2x1 and 1x1 pixels; a pair needs equal'),
    ({'roi': region(y_offset=3)}, {'tx': -24.0}, 'the regions of interest begin in rows 3 and 0'),
])
def test_a_calibration_that_cannot_be_right_is_rejected(left, right, sentence):
    rejection = rejection_of(read_calibration, info(**left), info(**right))
    assert rejection.reason == 'calibration'
    assert str(rejection).startswith(sentence)


@pytest.mark.parametrize('left, right, sentence', [
    ({}, {}, 'the baseline is 0 m, as P[3] of the right camera_info is not -fx * baseline'),
    ({'p': [1.0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0], 'k': [0.0] * 9},
     {'p': [1.0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0], 'k': [0.0] * 9}, 'the baseline is 0 m'),
])
def test_without_a_baseline_a_calibration_has_no_metres_and_one_remark(left, right, sentence):
    calibration = read_calibration(info(**left), info(**right))
    assert calibration.baseline == 0
    (remark,) = calibration.remarks
    assert remark.startswith(sentence)
    assert 'depth and points are left out; calibrate the two cameras as a pair' in remark


DOUBTFUL = [
    ({}, {'tx': -24000.0}, ['the baseline is 120 m; if that is meant to be cm or mm, all depths '
                            'and points are 100 or 1000 times too far: P[3] of the right']),
    ({'tx': -91.0}, {'tx': -91.0}, ['the baseline is 0 m, as P[3] of both camera_info is the sa']),
    ({}, {'p': projection(p3=-24.0, p1=0.5, p4=-3.0, p8=-0.01, p9=2e-6, p10=0.999)},
     ['P[1] is 0.5, P[4] is -3, P[8] is -0.01, P[9] is 2e-06, P[10] is 0.999 in the right camer']),
    ({'cx': 20.0}, {'tx': -24.0}, ['the principal point 20, 40 of the left camera_info is far out'
                                   'side the middle of 100x80 pixels: give the region']),
    ({'roi': region(y_offset=30, height=50)}, {'tx': -24.0, 'roi': region(y_offset=30, height=50)},
     [f'the principal point 50, 10 of the {side} camera_info is far' for side in SIDES]),
    ({}, {'p': projection(p0=210.0, p3=-21.0, p6=42.0)}, ['fx is 200', 'cy is 40'])]


@pytest.mark.parametrize('k', [[0.0] * 9, [float('nan')] * 9, []])
@pytest.mark.parametrize('side', [0, 1])
def test_k_is_not_read_of_rectified_cameras_as_p_has_all(k, side):
    infos = info(), info(tx=-24.0)
    infos[side].k = k
    assert read_calibration(*infos) == read_calibration(info(), info(tx=-24.0))


@pytest.mark.parametrize('left, right, remarks', DOUBTFUL)
def test_a_doubtful_calibration_is_used_with_remarks(left, right, remarks):
    calibration = read_calibration(info(**left), info(**right))
    assert calibration.focal == info(**right).p[0]
    assert [found[:len(remark)] for found, remark in zip(
        calibration.remarks, remarks, strict=True)] == remarks


@given(focal=st.floats(10, 5000), baseline=st.floats(0.001, 1.99), binning=st.sampled_from([1, 2]),
       cx=st.floats(26, 74), cy=st.floats(21, 59), cut=st.booleans(), offset=st.floats(-1, 1),
       rounding=st.floats(-1e-7, 1e-7), height=st.floats(-0.009, 0.009))
def test_a_calibration_of_a_rectified_pair_gets_no_remark(
        focal, baseline, binning, cx, cy, cut, offset, rounding, height):
    cameras = [info(p=[focal, focal * rounding, centre, tx, 0, focal, cy, height * tx, rounding, 0,
                       1 + rounding, 0], binning_x=binning, binning_y=binning)
               for centre, tx in ((cx, 0), (cx - offset, -focal * baseline))]
    if cut:         # out of a larger image
        for one in cameras:
            one.p[2], one.p[6] = one.p[2] + 300, one.p[6] + 200
            one.width, one.height, one.roi = 640, 480, region(300, 200, 80, 100)
    assert read_calibration(*cameras).remarks == ()
