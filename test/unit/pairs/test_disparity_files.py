# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is written is what is read, and a bad file is rejected with a sentence."""
import errno
import os
import struct
from unittest import mock

import cv2
from fuzzy_stereo_ros.pairs.disparity_files import (
    check_map_suffix, read_disparity, write_disparity)
from fuzzy_stereo_ros.pairs.image_files import (
    check_place, in_eight_bits, read_image, write_image, write_whole)
from hypothesis import given, HealthCheck, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

NAN = np.nan
SHAPES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=7)
same_folder = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def disparities(low, high):
    return arrays.arrays(np.float32, SHAPES, elements=st.one_of(
        st.just(float('nan')), st.floats(low, high, width=32)))


@pytest.mark.parametrize('suffix', ['.pfm', '.npy', '.PFM'])
@same_folder
@given(disparity=disparities(-(2.0 ** 40), 2.0 ** 40))
def test_pfm_and_npy_give_back_the_same_bits(tmp_path, suffix, disparity):
    path = tmp_path / f'map{suffix}'
    write_disparity(path, disparity)
    again = read_disparity(path)
    assert again.dtype == np.float32
    assert np.array_equal(again, disparity, equal_nan=True)


@same_folder
@given(disparity=disparities(-0.5, 65535 / 256))
def test_a_kitti_png_keeps_validity_exactly_and_values_to_half_a_step(tmp_path, disparity):
    path = tmp_path / 'map.png'
    write_disparity(path, disparity)
    again = read_disparity(path)
    assert np.array_equal(np.isnan(again), np.isnan(disparity))
    stored = np.clip(disparity, 1 / 256, None)
    assert np.nanmax(abs(again - stored), initial=0) <= 1 / 512 + 1e-6


@pytest.mark.parametrize('value', [-0.6, 256.0, 300.0])
def test_what_a_kitti_png_cannot_hold_is_rejected_and_nothing_written(tmp_path, value):
    with pytest.raises(ValueError, match=f'a disparity of {value:g} px does not fit .* .pfm'):
        write_disparity(tmp_path / 'map.png', np.array([[1.0, value]]))
    assert os.listdir(tmp_path) == []


def test_our_pfm_is_what_opencv_and_middlebury_read(tmp_path):
    disparity = np.array([[1, 2, 3], [4, 5, NAN]], np.float32)
    write_disparity(tmp_path / 'map.pfm', disparity)
    theirs = cv2.imread(str(tmp_path / 'map.pfm'), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(theirs, [[1, 2, 3], [4, 5, np.inf]])


@pytest.mark.parametrize('kind, scale', [('<f4', '-0.003922'), ('>f4', '1.0'), ('<f4', '-1')])
def test_the_scale_of_a_pfm_tells_only_the_byte_order(tmp_path, kind, scale):
    """As the ground truth of Middlebury 2014 wants it; OpenCV multiplies by 255 there."""
    values = np.array([[1, 2, 3], [4, 5, np.inf]])
    (tmp_path / 'truth.pfm').write_bytes(
        f'Pf\n3 2\n{scale}\n'.encode() + values[::-1].astype(kind).tobytes())
    assert np.array_equal(read_disparity(tmp_path / 'truth.pfm'), [[1, 2, 3], [4, 5, NAN]],
                          equal_nan=True)


def test_pictures_of_ground_truth_are_read_by_their_scale(tmp_path):
    cv2.imwrite(str(tmp_path / 'eight.png'), np.array([[0, 4, 255]], np.uint8))
    cv2.imwrite(str(tmp_path / 'sixteen.png'), np.array([[0, 256, 384]], np.uint16))
    assert np.array_equal(read_disparity(tmp_path / 'eight.png', scale=4),
                          np.float32([[NAN, 1, 63.75]]), equal_nan=True)
    eight = cv2.imread(str(tmp_path / 'eight.png'))
    assert eight.shape == (1, 3, 3)
    cv2.imwrite(str(tmp_path / 'three_channels.png'), eight)
    assert np.array_equal(read_disparity(tmp_path / 'three_channels.png', scale=4),
                          np.float32([[NAN, 1, 63.75]]), equal_nan=True)
    assert np.array_equal(read_disparity(tmp_path / 'sixteen.png'), [[NAN, 1, 1.5]],
                          equal_nan=True)
    assert np.array_equal(read_disparity(tmp_path / 'sixteen.png', scale=128), [[NAN, 2, 3]],
                          equal_nan=True)


def test_a_missing_file_and_a_useless_picture_are_rejected(tmp_path):
    with pytest.raises(ValueError, match='none.pfm cannot be read: No such file'):
        read_disparity(tmp_path / 'none.pfm')
    cv2.imwrite(str(tmp_path / 'colour.png'), np.eye(3, dtype=np.uint8)[None])
    with pytest.raises(ValueError, match='colour image'):
        read_disparity(tmp_path / 'colour.png', scale=16)
    cv2.imwrite(str(tmp_path / 'eight.png'), np.zeros((2, 2), np.uint8))
    with pytest.raises(ValueError, match='the grey levels of one pixel'):
        read_disparity(tmp_path / 'eight.png')
    with pytest.raises(ValueError, match='scale is 0; allowed are numbers above 0'):
        read_disparity(tmp_path / 'eight.png', scale=0)
    np.save(tmp_path / 'cube.npy', np.zeros((2, 2, 2)))
    with pytest.raises(ValueError, match=r'holds float64 of shape \(2, 2, 2\)'):
        read_disparity(tmp_path / 'cube.npy')
    with pytest.raises(ValueError, match='a scale is for images'):
        read_disparity(tmp_path / 'cube.npy', scale=4)


@pytest.mark.parametrize('suffix', ['.tiff', '', '.jpg'])
def test_an_unknown_suffix_is_rejected_before_anything_is_written(tmp_path, suffix):
    with pytest.raises(ValueError, match='allowed are .pfm, .npy, .png'):
        check_map_suffix(f'map{suffix}')
    with pytest.raises(ValueError, match='allowed are .pfm, .npy, .png'):
        write_disparity(tmp_path / f'map{suffix}', np.zeros((2, 2)))
    assert os.listdir(tmp_path) == []


def test_a_write_that_fails_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / 'map.pfm'
    write_disparity(path, np.ones((2, 2)))
    with mock.patch('pathlib.Path.replace', side_effect=OSError('disk full')), \
            pytest.raises(OSError, match='disk full'):
        write_disparity(path, np.zeros((2, 2)))
    assert os.listdir(tmp_path) == ['map.pfm']
    assert read_disparity(path).min() == 1


def test_an_error_on_a_disk_that_is_only_read_names_the_file_and_not_a_temporary_one(tmp_path):
    with mock.patch('pathlib.Path.unlink', autospec=True, side_effect=lambda path, **_: (
            _ for _ in ()).throw(OSError(errno.EROFS, 'Read-only file system', str(path)))), \
            pytest.raises(OSError) as ended:
        write_whole(tmp_path / 'map.pfm', b'')
    assert (ended.value.errno, ended.value.filename) == (errno.EROFS, str(tmp_path / 'map.pfm'))


def test_a_link_that_somebody_put_beside_a_file_is_not_followed(tmp_path):
    (tmp_path / 'victim').write_text('kept')
    part = tmp_path / f'.file.{os.getpid()}.part'
    part.symlink_to(tmp_path / 'victim')
    write_whole(tmp_path / 'file', b'content')
    assert (tmp_path / 'file').read_bytes() == b'content'
    assert not (tmp_path / 'file').is_symlink()
    assert (tmp_path / 'victim').read_text() == 'kept'


# ---- images come in as they are stored, or with a sentence that says why not ----


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
