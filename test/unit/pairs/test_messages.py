# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages into images and calibrations, on stand-ins and on ROS's own messages."""
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.pairs.calibration import read_calibration
from fuzzy_stereo_ros.pairs.messages import ENCODINGS, fill_pixels, read_image, SEMI_PLANAR
from fuzzy_stereo_ros.pairs.stereo_pair import SIDES
from hypothesis import given, strategies as st
from made_messages import (
    compressed, image, info, noise, projection, region, rejection_of)
import numpy as np
import pytest

COLOURS = {'b': 40, 'g': 90, 'r': 200}
BAYER = [f'bayer_{pattern}{bits}' for pattern in ('rggb', 'bggr', 'gbrg', 'grbg')
         for bits in (8, 16)]


@given(st.sampled_from(sorted({*ENCODINGS} - {*BAYER})), st.integers(4, 9), st.integers(4, 9),
       st.integers(0, 5), st.booleans(), st.integers(0, 99))
def test_every_encoding_is_read_as_grey_or_bgr_whatever_the_padding_and_byte_order(
        encoding, rows, columns, padding, big_endian, seed):
    dtype, channels, _ = ENCODINGS[encoding]
    pixels = noise(rows, columns, channels, dtype, seed)
    message = image(pixels, encoding, padding, big_endian)
    if encoding in SEMI_PLANAR:
        message.data += bytes(message.step * ((rows + 1) // 2))      # the chroma of nv12
    read = read_image(message)
    letters = encoding.rstrip('0123456789')
    if channels == 2:       # of each two bytes one is the luma
        pixels = pixels[:, :, 1 if encoding in ('yuv422', 'uyvy') else 0]
    elif channels > 2:
        pixels = pixels[:, :, [letters.index(one) if one in letters else place
                               for place, one in enumerate('bgr')]]
    assert read.dtype == dtype
    assert read.flags.c_contiguous
    np.testing.assert_array_equal(read, pixels)


@pytest.mark.parametrize('encoding', BAYER)
def test_a_bayer_pattern_gives_its_own_colours(encoding):
    tile = np.array([COLOURS[name] for name in encoding[6:10]], ENCODINGS[encoding][0])
    read = read_image(image(np.tile(tile.reshape(2, 2), (4, 4)), encoding))
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


FORMS = ['png', 'bgr8; png compressed bgr8', 'rgb8; png compressed bgr8', 'rgb8; png compressed',
         'yuv422; png compressed bgr8', 'bayer_rggb8; png compressed bgr8',
         'rgb8; png compressed rgb8']


@given(st.sampled_from(FORMS), st.sampled_from([1, 3, 4]), st.sampled_from([np.uint8, np.uint16]))
def test_a_compressed_image_is_as_deep_as_it_is_stored_and_bgr_whatever_was_compressed(
        form, channels, dtype):
    pixels = noise(6, 8, channels, dtype)
    form = 'mono' if channels == 1 else form
    read = read_image(compressed(cv2.imencode('.png', pixels)[1].tobytes(), form))
    turned = channels == 3 and form.endswith('rgb8')
    np.testing.assert_array_equal(
        read, pixels if channels == 1 else pixels[:, :, 2::-1] if turned else pixels[:, :, :3])
    assert read.dtype == dtype


@pytest.mark.parametrize('encoding', BAYER)
@pytest.mark.parametrize('ending', ['', ' ', ' bayer'])
def test_a_compressed_bayer_pattern_is_filled_in_as_a_raw_one(encoding, ending):
    mosaic = noise(6, 8, dtype=ENCODINGS[encoding][0])
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


@pytest.mark.parametrize('changes', [
    {}, {'p': [1.0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0], 'k': [0.0] * 9}])
def test_without_a_baseline_a_calibration_has_no_metres_and_one_remark(changes):
    calibration = read_calibration(info(**changes), info(**changes))
    assert calibration.baseline == 0
    (remark,) = calibration.remarks
    assert remark.startswith('the baseline is 0 m, as P[3] of the right camera_info is not -fx * ')
    assert 'depth and points are left out; calibrate the two cameras as a pair' in remark


@pytest.mark.parametrize('left, right, remarks', [
    ({}, {'tx': -24000.0}, ['the baseline is 120 m; if that is meant to be cm or mm, all depths '
                            'and points are 100 or 1000 times too far: P[3] of the right']),
    ({'tx': -91.0}, {'tx': -91.0}, ['the baseline is 0 m, as P[3] of both camera_info is the sa']),
    ({}, {'p': projection(p3=-24.0, p1=0.5, p4=-3.0, p8=-0.01, p9=2e-6, p10=0.999)},
     ['P[1] is 0.5, P[4] is -3, P[8] is -0.01, P[9] is 2e-06, P[10] is 0.999 in the right camer']),
    ({'cx': 20.0}, {'tx': -24.0}, ['the principal point 20, 40 of the left camera_info is far out'
                                   'side the middle of 100x80 pixels: give the region']),
    ({'roi': region(y_offset=30, height=50)}, {'tx': -24.0, 'roi': region(y_offset=30, height=50)},
     [f'the principal point 50, 10 of the {side} camera_info is far' for side in SIDES]),
    ({}, {'p': projection(p0=210.0, p3=-21.0, p6=42.0)}, ['fx is 200', 'cy is 40'])])
def test_a_doubtful_calibration_is_used_with_remarks(left, right, remarks):
    calibration = read_calibration(info(**left), info(**right))
    assert calibration.focal == info(**right).p[0]
    assert [found[:len(remark)] for found, remark in zip(
        calibration.remarks, remarks, strict=True)] == remarks


@given(focal=st.floats(10, 5000), baseline=st.floats(0.001, 1.99), binning=st.sampled_from([1, 2]),
       cx=st.floats(26, 74), cy=st.floats(21, 59), cut=st.booleans(), offset=st.floats(-1, 1),
       rounding=st.floats(-1e-7, 1e-7), height=st.floats(-0.009, 0.009),
       k=st.sampled_from([[0.0] * 9, [float('nan')] * 9, []]))
def test_a_rectified_pair_has_metres_by_binning_and_regions_and_no_remark_whatever_k_is(
        focal, baseline, binning, cx, cy, cut, offset, rounding, height, k):
    cameras = [info(p=[focal, focal * rounding, centre, tx, 0, focal, cy, height * tx, rounding, 0,
                       1 + rounding, 0], binning_x=binning, binning_y=binning)
               for centre, tx in ((cx, 0), (cx - offset, -focal * baseline))]
    if cut:         # out of a larger image
        for one, x in zip(cameras, (300, 294)):
            one.p[2], one.p[6] = one.p[2] + x, one.p[6] + 200
            one.width, one.height, one.roi = 640, 480, region(x, 200, 80, 100)
    found = read_calibration(*cameras)
    assert found.remarks == ()
    assert (found.focal, found.baseline, found.offset) == pytest.approx(
        (focal / binning, baseline, offset / binning), abs=1e-6)
    assert found.left[:2] == pytest.approx([focal / binning] * 2)
    for one in cameras:
        one.k = k
    assert read_calibration(*cameras) == found
