# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages into pairs, on stand-ins and on ROS's own messages."""
from array import array
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.pairs.calibration import read_calibration
from fuzzy_stereo_ros.pairs.messages import ENCODINGS, read_image, read_pair
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, Projection
from hypothesis import given, strategies as st
import numpy as np
import pytest

LEFT = Projection(200.0, 200.0, 50.0, 40.0)


def header(stamp=(12, 345), frame_id='left_optical'):
    return SimpleNamespace(
        stamp=SimpleNamespace(sec=stamp[0], nanosec=stamp[1]), frame_id=frame_id)


def image(pixels, pixel_encoding, padding=0, big_endian=False, as_data=bytes, **changes):
    """Return an image message of an array (R, C) or (R, C, channels), rows padded with 170."""
    rows, columns = pixels.shape[:2]
    stored = pixels.astype(pixels.dtype.newbyteorder('>' if big_endian else '<'))
    lines = np.frombuffer(stored.tobytes(), np.uint8).reshape(rows, -1)
    lines = np.pad(lines, ((0, 0), (0, padding)), constant_values=170)
    message = SimpleNamespace(
        header=header(), height=rows, width=columns, encoding=pixel_encoding,
        is_bigendian=int(big_endian), step=lines.shape[1], data=as_data(lines.tobytes()))
    message.__dict__.update(changes)
    return message


def compressed(content, form='jpeg'):
    return SimpleNamespace(header=header(), format=form, data=bytes(content))


def info(tx=0.0, cx=50.0, **changes):
    """Return a CameraInfo of a camera of 100x80, fx 200."""
    message = SimpleNamespace(
        header=header(), height=80, width=100, binning_x=0, binning_y=0,
        k=[200.0, 0, cx, 0, 200.0, 40.0, 0, 0, 1],
        p=[200.0, 0, cx, tx, 0, 200.0, 40.0, 0, 0, 0, 1, 0], roi=region())
    message.__dict__.update(changes)
    return message


def region(x_offset=0, y_offset=0, height=0, width=0):
    return SimpleNamespace(x_offset=x_offset, y_offset=y_offset, height=height, width=width)


def projection(**places):
    """Return P of `info` with elements changed: p3=-20 sets P[3]."""
    values = info().p
    for place, value in places.items():
        values[int(place[1:])] = value
    return values


def noise(rows, columns, channels=1, dtype=np.uint8, seed=0):
    shape = (rows, columns, channels) if channels > 1 else (rows, columns)
    return np.random.default_rng(seed).integers(
        0, np.iinfo(dtype).max, shape, dtype, endpoint=True)


def refusal_of(function, *arguments):
    with pytest.raises(BadPair) as refusal:
        function(*arguments)
    return refusal.value


images = st.tuples(
    st.sampled_from(sorted(ENCODINGS)), st.integers(4, 9), st.integers(4, 9),
    st.integers(0, 5), st.booleans(), st.integers(0, 99))


@given(images)
def test_every_encoding_is_read_whatever_the_padding_and_byte_order(drawn):
    encoding, rows, columns, padding, big_endian, seed = drawn
    dtype, channels, conversion = ENCODINGS[encoding]
    pixels = noise(rows, columns, channels, dtype, seed)
    read = read_image(image(pixels, encoding, padding, big_endian))
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
    ('bgr8', (0, 1, 2)), ('rgb8', (2, 1, 0)), ('bgra8', (0, 1, 2)), ('rgba8', (2, 1, 0))])
def test_colour_comes_out_as_bgr(encoding, order):
    pixels = noise(5, 7, ENCODINGS[encoding][1])
    np.testing.assert_array_equal(read_image(image(pixels, encoding)), pixels[:, :, order])


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_a_bayer_pattern_gives_its_own_colours(pattern, dtype):
    colours = {'b': 40, 'g': 90, 'r': 200}
    tile = np.array([colours[name] for name in pattern], dtype).reshape(2, 2)
    read = read_image(image(np.tile(tile, (4, 4)), f'bayer_{pattern}{8 * tile.itemsize}'))
    np.testing.assert_array_equal(read[4, 4], [40, 90, 200])


def test_an_image_that_fits_is_not_copied():
    message = image(noise(5, 7), 'mono8', as_data=lambda content: array('B', content))
    assert np.shares_memory(read_image(message), np.frombuffer(message.data, np.uint8))


@pytest.mark.parametrize('encoding', ['mono8', 'nv12', 'nv21'])
def test_bytes_behind_the_last_row_are_accepted(encoding):
    pixels = noise(4, 6)
    message = image(pixels, encoding)
    message.data += bytes(12)
    np.testing.assert_array_equal(read_image(message), pixels)


def test_an_image_of_one_pixel_is_an_image():
    assert read_image(image(noise(1, 1), 'mono8')).shape == (1, 1)


@pytest.mark.parametrize('changes, reason, sentence', [
    ({'encoding': '32FC1'}, 'encoding', "encoding is '32FC1'; allowed are mono8, 8UC1, mono16"),
    ({'height': 0}, 'size', 'the image is 6x0; it needs at least one pixel'),
    ({'width': 0}, 'size', 'the image is 0x4; it needs at least one pixel'),
    ({'step': 5}, 'size', 'step is 5 bytes, but 6 pixels of mono8 need 6'),
    ({'height': 5}, 'size', 'data has 24 bytes, but 5 rows of 6 bytes need 30'),
    ({'height': 2**31}, 'size', 'data has 24 bytes, but 2147483648 rows of 6 bytes need'),
    ({'width': 2**31, 'step': 2**31}, 'size', 'data has 24 bytes, but 4 rows of 2147483648'),
    ({'width': 2**31, 'height': 2**31, 'step': 0}, 'size', 'step is 0 bytes, but 2147483648'),
    ({'data': b''}, 'size', 'data has 0 bytes, but 4 rows of 6 bytes need 24'),
])
def test_an_image_that_cannot_be_right_is_refused_with_a_sentence(changes, reason, sentence):
    refusal = refusal_of(read_image, image(noise(4, 6), 'mono8', **changes))
    assert refusal.reason == reason
    assert str(refusal).startswith(sentence)


def test_a_mosaic_too_small_to_fill_in_is_refused():
    refusal = refusal_of(read_image, image(noise(3, 9), 'bayer_rggb8'))
    assert str(refusal) == 'the image is 9x3; a Bayer pattern needs at least 4x4'


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1),
       st.sampled_from(sorted(ENCODINGS)), st.integers(0, 64))
def test_no_field_can_make_it_read_past_the_data(height, width, step, encoding, length):
    message = image(noise(1, 1), encoding, height=height, width=width, step=step)
    message.data = bytes(length)
    try:
        assert read_image(message).size <= 3 * length
    except BadPair as refusal:
        assert refusal.reason == 'size'


@pytest.mark.parametrize('suffix', ['.png', '.jpg'])
def test_compressed_images_are_read(suffix):
    pixels = np.full((6, 8, 3), (40, 90, 200), np.uint8)
    read = read_image(compressed(cv2.imencode(suffix, pixels)[1].tobytes()))
    assert np.abs(read.astype(int) - pixels).max() <= 3


def test_a_compressed_image_keeps_sixteen_bits_and_loses_alpha():
    deep = noise(6, 8, dtype=np.uint16)
    np.testing.assert_array_equal(
        read_image(compressed(cv2.imencode('.png', deep)[1].tobytes())), deep)
    clear = noise(6, 8, 4)
    np.testing.assert_array_equal(
        read_image(compressed(cv2.imencode('.png', clear)[1].tobytes())), clear[:, :, :3])


@pytest.mark.parametrize('content', [b'', b'no image', b'\xff\xd8\xff\xe0'])
def test_a_broken_compressed_image_is_refused_with_a_sentence(content):
    refusal = refusal_of(read_image, compressed(content, 'bgr8; jpeg compressed bgr8'))
    assert str(refusal) == (f"{len(content)} bytes of format 'bgr8; jpeg compressed bgr8' hold "
                            'no image of 8 or 16 bits; allowed are JPEG and PNG')


def test_a_calibration_is_read_from_the_right_camera():
    calibration = read_calibration(info(), info(tx=-24.0, cx=53.0))
    assert calibration == Calibration(focal=200.0, baseline=0.12, offset=-3.0, left=LEFT)


def test_the_baseline_is_between_the_cameras_wherever_the_origin_is():
    calibration = read_calibration(info(tx=10.0), info(tx=-14.0))
    assert calibration.baseline == pytest.approx(0.12)


def test_ros_1_names_are_read_too():
    left, right = info(), info(tx=-24.0)
    for message in (left, right):
        message.K, message.P = message.__dict__.pop('k'), message.__dict__.pop('p')
    assert read_calibration(left, right).baseline == pytest.approx(0.12)


def test_binning_and_region_change_focal_length_and_offset_but_not_the_baseline():
    changes = {'binning_x': 2, 'binning_y': 2}
    calibration = read_calibration(
        info(roi=region(x_offset=10, height=60, width=80), **changes),
        info(tx=-24.0, cx=60.0, roi=region(x_offset=4, height=60, width=80), **changes))
    assert calibration.focal == 100.0
    assert calibration.baseline == pytest.approx(0.12)
    assert calibration.offset == ((50 - 10) - (60 - 4)) / 2


@pytest.mark.parametrize('left, right, sentence', [
    ({}, {'tx': 24.0}, 'the baseline is -0.12 m: left and right are swapped, or Tx stands in'),
    ({'tx': -24.0}, {}, 'the baseline is -0.12 m: left and right are swapped, or Tx stands in'),
    ({}, {}, 'the baseline is 0 m: P[3] of the right camera_info must be -fx * baseline'),
    ({}, {'p': projection(p3=-24.0, p7=-24.0)}, 'Ty of the pair is -24: the cameras are mounted'),
    ({}, {'p': projection(p7=-24.0)}, 'Ty of the pair is -24: the cameras are mounted one above'),
    ({'p': [0.0] * 12}, {'tx': -24.0}, 'left camera_info: the camera is not calibrated (K[0] is '),
    ({}, {'k': [0.0] * 9, 'tx': -24.0}, 'right camera_info: the camera is not calibrated (K[0] '),
    ({}, {'p': projection(p0=0.0)}, 'right camera_info: the camera is not calibrated (K[0] is '),
    ({}, {'p': projection(p5=0.0)}, 'right camera_info: the camera is not calibrated (K[0] is '),
    ({}, {'k': [], 'tx': -24.0}, 'right camera_info: the camera is not calibrated (K[0] is 0, '),
    ({}, {'p': projection(p0=float('nan'))}, 'right camera_info: P is not twelve finite numbers'),
    ({}, {'p': projection(p3=float('inf'))}, 'right camera_info: P is not twelve finite numbers'),
    ({}, {'p': []}, 'right camera_info: P is not twelve finite numbers'),
    ({'binning_x': 2}, {'tx': -24.0}, 'the cameras bin 2x1 and 1x1 pixels; a pair needs equal'),
    ({'roi': region(y_offset=3)}, {'tx': -24.0}, 'the regions of interest begin in rows 3 and 0'),
])
def test_a_calibration_that_cannot_be_right_is_refused(left, right, sentence):
    refusal = refusal_of(read_calibration, info(**left), info(**right))
    assert refusal.reason == 'calibration'
    assert str(refusal).startswith(sentence)


def test_rounding_of_a_calibration_is_not_a_vertical_rig():
    read_calibration(info(), info(p=projection(p3=-24.0, p7=-1e-14)))


def test_a_doubtful_calibration_is_used_with_remarks():
    calibration = read_calibration(
        info(), info(p=projection(p0=210.0, p3=-21.0, p6=42.0)))
    assert calibration.focal == 210.0
    assert [remark.split(' is ')[0] for remark in calibration.remarks] == ['fx', 'cy']


def test_a_pair_has_the_stamp_and_frame_of_the_left_image():
    left, right = noise(80, 100), noise(80, 100, seed=1)
    right_message = image(right, 'mono8')
    right_message.header = header((12, 346), 'right_optical')
    pair = read_pair(image(left, 'mono8'), info(), right_message, info(tx=-24.0))
    np.testing.assert_array_equal(pair.left, left)
    np.testing.assert_array_equal(pair.right, right)
    assert (pair.stamp, pair.frame_id) == (12_000_000_345, 'left_optical')
    assert pair.calibration == Calibration(200.0, 0.12, 0.0, LEFT)


def test_an_image_of_another_size_than_its_camera_info_is_used_with_a_remark():
    pair = read_pair(image(noise(40, 50), 'mono8'), info(),
                     image(noise(40, 50), 'mono8'), info(tx=-24.0, width=0))
    assert pair.calibration.remarks == (
        'the left image is 50x40, its camera_info expects 100x80; disparities are of the image '
        'as it is',)


def test_a_binned_image_of_a_region_has_the_expected_size():
    changes = {'binning_x': 2, 'binning_y': 2, 'roi': region(4, 4, 60, 80)}
    pair = read_pair(image(noise(30, 40), 'mono8'), info(**changes),
                     image(noise(30, 40), 'mono8'), info(tx=-24.0, **changes))
    assert pair.calibration.remarks == ()


def test_images_of_two_sizes_are_refused():
    refusal = refusal_of(read_pair, image(noise(80, 100), 'mono8'), info(),
                         image(noise(80, 99), 'mono8'), info(tx=-24.0))
    assert (refusal.reason, str(refusal)) == (
        'size', 'the left image is 100x80, the right one 99x80; a pair needs two of one size')


def test_a_refusal_names_the_side():
    refusal = refusal_of(read_pair, image(noise(80, 100), 'mono8'), info(),
                         image(noise(80, 100), 'mono8', encoding='32FC1'), info(tx=-24.0))
    assert str(refusal).startswith("right image: encoding is '32FC1'")


@pytest.mark.parametrize('left, right, dtype', [
    (noise(80, 100), noise(80, 100, 3), np.uint8),
    (noise(80, 100), noise(80, 100, dtype=np.uint16), np.uint16),
    (noise(80, 100, 3), noise(80, 100, dtype=np.uint16), np.uint16),
])
def test_two_images_of_a_pair_become_equally_deep(left, right, dtype):
    names = {(2, 1): 'mono8', (2, 2): 'mono16', (3, 1): 'bgr8'}
    pair = read_pair(
        image(left, names[left.ndim, left.itemsize]), info(),
        image(right, names[right.ndim, right.itemsize]), info(tx=-24.0))
    assert (pair.left.dtype, pair.right.dtype) == (dtype, dtype)
    assert (pair.left.shape, pair.right.shape) == (left.shape, right.shape)


def test_eight_and_twelve_bits_of_one_scene_become_equally_bright():
    grey = noise(80, 100)
    pair = read_pair(image(grey, 'mono8'), info(),
                     image(grey.astype(np.uint16) * 16, 'mono16'), info(tx=-24.0))
    assert np.abs(pair.left.astype(int) - pair.right).max() < 257


def test_messages_of_ros_are_read():
    sensor_messages = pytest.importorskip('sensor_msgs.msg')
    grey = noise(80, 100, dtype=np.uint16)
    left, right = sensor_messages.Image(), sensor_messages.Image()
    for message in (left, right):
        message.height, message.width, message.step = 80, 100, 200
        message.encoding = 'mono16'
        message.data = array('B', grey.tobytes())
    left.header.stamp.sec, left.header.stamp.nanosec = 12, 345
    left.header.frame_id = 'left_optical'
    infos = [sensor_messages.CameraInfo(
        height=80, width=100, k=made.k, p=made.p) for made in (info(), info(tx=-24.0, cx=52.0))]
    pair = read_pair(left, infos[0], right, infos[1])
    np.testing.assert_array_equal(pair.left, grey)
    assert pair.calibration == Calibration(200.0, 0.12, -2.0, LEFT)
