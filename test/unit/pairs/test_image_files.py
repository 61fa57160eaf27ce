# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Images come in as they are stored, or with a sentence that says why not; 16 bits in 8."""
import os
import struct

import cv2
from fuzzy_stereo_ros.pairs.image_files import (
    check_place, in_eight_bits, read_image, read_pair, write_image)
import numpy as np
import pytest


@pytest.mark.parametrize('kind', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', [(5, 7), (5, 7, 3)])
def test_an_image_is_read_as_it_was_written(tmp_path, kind, shape):
    image = np.random.default_rng(0).integers(0, np.iinfo(kind).max, shape).astype(kind)
    write_image(tmp_path / 'image.png', image)
    again = read_image(tmp_path / 'image.png')
    assert again.dtype == kind and np.array_equal(again, image)


def test_an_alpha_channel_is_left_out(tmp_path):
    image = np.random.default_rng(0).integers(0, 255, (4, 4, 4)).astype(np.uint8)
    cv2.imwrite(str(tmp_path / 'image.png'), image)
    assert np.array_equal(read_image(tmp_path / 'image.png'), image[:, :, :3])


def tiff(image, orientation, order, big):
    """Return the bytes of a TIFF of an image, its pixels before its tags, as libtiff writes."""
    offset = 'Q' if big else 'I'
    begin = struct.pack(order + '2sHHHQ' if big else order + '2sHI', *(
        {'<': b'II', '>': b'MM'}[order], *((43, 8, 0) if big else (42,)), 16 + image.nbytes))
    tags = {256: image.shape[1], 257: image.shape[0], 258: 8 * image.itemsize, 259: 1, 262: 1,
            273: 16, 274: orientation, 277: 1, 278: image.shape[0], 279: image.nbytes}
    return b''.join((
        begin.ljust(16, b'\0'), image.astype(image.dtype.newbyteorder(order)).tobytes(),
        struct.pack(order + ('Q' if big else 'H'), len(tags)),
        *(struct.pack(f'{order}HH{offset}', tag, 3, 1)
          + struct.pack(f'{order}H', value).ljust(8 if big else 4, b'\0')
          for tag, value in tags.items()), bytes(8)))


@pytest.mark.parametrize('kind', [np.uint8, np.uint16])
@pytest.mark.parametrize('order', '<>')
@pytest.mark.parametrize('big', [False, True])
def test_the_orientation_of_a_tiff_is_ignored_as_that_of_other_formats(
        tmp_path, kind, order, big):
    image = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (5, 8)).astype(kind)
    for orientation in range(1, 9):
        (tmp_path / 'image.tif').write_bytes(tiff(image, orientation, order, big))
        np.testing.assert_array_equal(read_image(tmp_path / 'image.tif'), image)


def test_what_is_no_image_is_rejected_by_name(tmp_path):
    with pytest.raises(ValueError, match='none.png cannot be read: No such file'):
        read_image(tmp_path / 'none.png')
    with pytest.raises(ValueError, match='cannot be read: Is a directory'):
        read_image(tmp_path)
    for content in (b'', b'no image'):
        (tmp_path / 'text.png').write_bytes(content)
        with pytest.raises(ValueError, match='text.png is not an image that OpenCV can read'):
            read_image(tmp_path / 'text.png')
    cv2.imwrite(str(tmp_path / 'float.tiff'), np.zeros((3, 3), np.float32))
    with pytest.raises(ValueError, match='holds float32 pixels; allowed are 8 and 16 bits'):
        read_image(tmp_path / 'float.tiff')


def test_a_jpeg_that_is_cut_off_is_rejected_by_name(tmp_path):
    whole = cv2.imencode('.jpg', np.zeros((64, 64), np.uint8))[1].tobytes()
    (tmp_path / 'cut.jpg').write_bytes(whole[:-2])
    with pytest.raises(ValueError, match='cut.jpg is cut off: its JPEG has no end marker'):
        read_image(tmp_path / 'cut.jpg')


def test_a_pair_of_two_sizes_is_rejected_with_both_sizes(tmp_path):
    write_image(tmp_path / 'left.png', np.zeros((5, 7), np.uint8))
    write_image(tmp_path / 'right.png', np.zeros((5, 8, 3), np.uint8))
    with pytest.raises(ValueError, match='left.png is 7x5 and .*right.png is 8x5'):
        read_pair(tmp_path / 'left.png', tmp_path / 'right.png')


def test_a_place_where_nothing_can_be_written_is_rejected_before_any_work(tmp_path, monkeypatch):
    check_place(tmp_path / 'file')
    monkeypatch.setattr(os, 'access', lambda path, mode: (path, mode) != (tmp_path, os.W_OK))
    with pytest.raises(ValueError, match=f'file cannot be written: {tmp_path} is read-only'):
        check_place(tmp_path / 'file')


def test_a_suffix_that_is_no_image_is_rejected_and_nothing_written(tmp_path):
    for name in ('picture', 'picture.docx'):
        with pytest.raises(ValueError, match='no image format; take .png'):
            write_image(tmp_path / name, np.zeros((2, 2), np.uint8))
    assert os.listdir(tmp_path) == []


def test_an_image_of_eight_bits_stays_the_same():
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert in_eight_bits(image) is image


@pytest.mark.parametrize('largest', [1023, 4095, 65535])
def test_the_brightest_channel_of_sixteen_bits_becomes_255(largest):
    image = np.array([[[0, largest // 2, largest], [0, 0, largest // 5]]], np.uint16)
    shown = in_eight_bits(image)
    assert shown.dtype == np.uint8
    np.testing.assert_array_equal(shown, np.rint(image * (255 / largest)))


def test_a_black_image_of_sixteen_bits_stays_black():
    assert not in_eight_bits(np.zeros((2, 3), np.uint16)).any()
