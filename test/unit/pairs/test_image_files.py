# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Images come in as they are stored, or with a sentence that says why not; 16 bits in 8."""
import os
import struct

import cv2
from fuzzy_stereo_ros.pairs.image_files import (
    check_place, in_eight_bits, read_image, write_image)
import numpy as np
import pytest


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


@pytest.mark.parametrize('largest', [1023, 4095, 65535])
def test_the_brightest_channel_of_sixteen_bits_becomes_255(largest):
    image = np.array([[[0, largest // 2, largest], [0, 0, largest // 5]]], np.uint16)
    shown = in_eight_bits(image)
    assert shown.dtype == np.uint8
    np.testing.assert_array_equal(shown, np.rint(image * (255 / largest)))
