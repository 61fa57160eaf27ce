# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever stands in any field of a message: it is read, or rejected as BadPair."""
from array import array
from functools import partial
import math
import struct
from types import SimpleNamespace
import zlib

import cv2
from drawn_messages import (
    BENT_INFOS, COLUMNS, FILES, FORMATS, IMAGES, INFOS, jpeg, png, ROWS)
from fuzzed import examples
from fuzzy_stereo_ros.pairs.calibration import millimetres_of
from fuzzy_stereo_ros.pairs.messages import MOST_PIXELS, PIXELS_PER_BYTE, read_image, stamp_of
from fuzzy_stereo_ros.pairs.pair_reader import PairReader, SCALES
from fuzzy_stereo_ros.pairs.result_messages import (
    fill_camera_info, fill_disparity, fill_image, fill_points)
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair
from hypothesis import given, strategies as st
from made_messages import (
    compressed, empty_disparity, empty_message, image, made_match, noise, rejection_of,
    USUAL_POINTS, values_of)
import numpy as np
import pytest


def read_or_rejected(read, *arguments):
    """Return what a call gives; None where it raises a BadPair of one printable line."""
    try:
        return read(*arguments)
    except BadPair as rejection:
        assert rejection.reason in ('encoding', 'size', 'calibration', 'damaged message')
        assert str(rejection).isprintable()
        assert len(str(rejection)) < 700
        return None


@examples(300)
@given(IMAGES)
def test_an_image_of_any_fields_is_read_within_its_data_or_rejected(message):
    read = read_or_rejected(read_image, message)
    if read is not None:
        assert read.dtype in (np.uint8, np.uint16)
        assert read.flags.c_contiguous
        assert read.shape[:2] == (message.height, message.width)
        assert read.size <= 3 * memoryview(message.data).nbytes
    assert isinstance(stamp_of(message.header), int)


def assert_usable(calibration):
    numbers = (calibration.focal, calibration.baseline, calibration.offset, *calibration.left)
    assert all(math.isfinite(np.float32(number)) for number in numbers)
    assert calibration.baseline == 0 or np.float32(calibration.baseline) > 0
    assert np.float32(calibration.focal) > 0


READERS = st.tuples(st.booleans(), st.booleans(), st.sampled_from(SCALES))


def filled(pair):
    """Fill every message that comes of a pair, and return the DisparityImage."""
    shape = pair.left.shape[:2]
    disparity = np.linspace(0, 15, shape[0] * shape[1], dtype=np.float32).reshape(shape)
    disparity[0, 0] = np.nan
    match = made_match(disparity)
    config = SimpleNamespace(min_disparity=0, disparities=16, fill=False, algorithm='realtime')
    depth = pair.calibration.depth(match.disparity)
    fill_image(empty_message(), millimetres_of(depth), pair, '16UC1')
    fill_camera_info(empty_message(), pair)
    for size in (0.0, 0.05):
        cloud = empty_message(fields=[], point_step=0, data=array('B'))
        fill_points(cloud, match, pair, SimpleNamespace,
                    {**USUAL_POINTS, 'points_voxel_size': size})
    return fill_disparity(empty_disparity(), match, pair, config)


def assert_read_and_filled(messages, reader):
    rectify, crop, scale = reader
    pair = read_or_rejected(PairReader(rectify, crop, scale).read, *messages)
    if pair is None:
        return
    assert pair.left.shape[:2] == pair.right.shape[:2]
    assert pair.left.dtype == pair.right.dtype
    assert_usable(pair.calibration)
    message = filled(pair)
    assert np.isfinite(values_of(message.image)).all()
    assert all(math.isfinite(np.float32(number)) for number in (
        message.f, message.t, message.min_disparity, message.max_disparity))


@examples(250)
@given(IMAGES, INFOS, IMAGES, INFOS, READERS)
def test_a_pair_of_any_four_messages_is_read_and_answered_or_rejected(
        left, left_info, right, right_info, reader):
    assert_read_and_filled((left, left_info, right, right_info), reader)


@examples(300)
@given(BENT_INFOS, BENT_INFOS, READERS)
def test_a_calibration_with_any_number_in_any_place_is_used_or_rejected(left, right, reader):
    picture = image(noise(ROWS, COLUMNS), 'mono8')
    assert_read_and_filled((picture, left, picture, right), reader)


# ---- compressed images ----


@examples(300)
@given(FILES, FORMATS)
def test_a_compressed_image_of_any_bytes_is_read_or_rejected(content, form):
    read = read_or_rejected(read_image, compressed(content, form))
    if read is not None:
        assert read.dtype in (np.uint8, np.uint16)
        assert read.size <= 3 * PIXELS_PER_BYTE * len(content)


@pytest.mark.parametrize('make', [
    partial(png, 2**31 - 1, 2**31 - 1), partial(png, 30000, 30000), partial(jpeg, 65535, 65535),
    partial(jpeg, 30000, 30000), partial(jpeg, 30000, 30000, cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
    lambda: png(2**14, 2**14, rest=zlib.compress(bytes(2**14 * (2**14 + 1)), 1))],
    ids=['png huge', 'png', 'jpeg huge', 'jpeg', 'progressive jpeg', 'bomb'])
def test_a_size_that_is_only_said_takes_no_memory(make, monkeypatch):
    content = make()
    monkeypatch.setattr(cv2, 'imdecode', lambda *_: pytest.fail('it was decoded'))
    rejection = rejection_of(read_image, compressed(content))
    assert rejection.reason == 'size'
    most = min(MOST_PIXELS, PIXELS_PER_BYTE * len(content))
    assert f'by its header; {len(content)} bytes may hold {most} pixels' in str(rejection)


@pytest.mark.parametrize('options', [
    ('.png', cv2.IMWRITE_PNG_COMPRESSION, 9), ('.png', cv2.IMWRITE_PNG_BILEVEL, 1),
    ('.jpg', cv2.IMWRITE_JPEG_QUALITY, 1),
    ('.jpg', cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_OPTIMIZE, 1)])
def test_a_large_image_of_one_grey_is_no_lie(options):
    suffix, *options = options
    content = cv2.imencode(suffix, np.zeros((4000, 6000), np.uint8), options)[1].tobytes()
    assert read_image(compressed(content)).shape == (4000, 6000)


@examples(100)
@given(st.data())
def test_a_jpeg_that_is_cut_anywhere_is_rejected_and_one_that_is_padded_is_read(data):
    thumbnail = cv2.imencode('.jpg', noise(8, 8))[1].tobytes()
    whole = cv2.imencode('.jpg', noise(ROWS, COLUMNS))[1].tobytes()
    whole = (whole[:2] + b'\xff\xe1' + struct.pack('>H', len(thumbnail) + 2) + thumbnail
             + whole[2:])
    kept = data.draw(st.integers(0, len(whole) - 1))
    rejection_of(read_image, compressed(whole[:kept] + bytes(data.draw(st.sampled_from([0, 9])))))
    padding = data.draw(st.binary(max_size=40))
    np.testing.assert_array_equal(
        read_image(compressed(whole + padding)), read_image(compressed(whole)))
