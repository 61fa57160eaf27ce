# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is written is what is read, a bad file is rejected, and metres come of disparities."""
import errno
from itertools import product
import os
from pathlib import Path
import struct

import cv2
from fuzzed import examples
from fuzzy_stereo_ros.pairs.calibration import disparity_of, millimetres_of
from fuzzy_stereo_ros.pairs.disparity_files import (
    check_map_suffix, read_disparity, write_disparity)
from fuzzy_stereo_ros.pairs.image_files import (
    check_place, read_image, write_image, write_whole)
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

SHAPES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=7)
MAPS = 'allowed are .pfm, .npy, .png'


def disparities(low, high):
    return arrays.arrays(np.float32, SHAPES, elements=st.one_of(
        st.just(float('nan')), st.floats(low, high, width=32)))


@examples(60)
@given(suffix=st.sampled_from(['.pfm', '.npy', '.PFM']), disparity=disparities(-2**40, 2**40))
def test_pfm_and_npy_give_back_the_same_bits(tmp_path, suffix, disparity):
    path = tmp_path / f'map{suffix}'
    write_disparity(path, disparity)
    again = read_disparity(path)
    assert again.dtype == np.float32
    assert np.array_equal(again, disparity, equal_nan=True)
    if suffix == '.pfm':
        theirs = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert np.array_equal(theirs, np.where(np.isnan(disparity), np.inf, disparity))


@examples(60)
@given(disparity=disparities(-0.5, 65535 / 256), wrong=st.sampled_from([None, -0.6, 256.0, 300.0]))
def test_a_kitti_png_keeps_validity_exactly_and_values_to_half_a_step_or_is_not_written(
        tmp_path, disparity, wrong):
    path = tmp_path / 'map.png'
    if wrong is not None:
        disparity[-1, -1] = wrong
        with pytest.raises(ValueError, match=f'a disparity of {wrong:g} px does not fit .* .pfm'):
            write_disparity(path, disparity)
        assert os.listdir(tmp_path) == []
        return
    write_disparity(path, disparity)
    again = read_disparity(path)
    path.unlink()
    assert np.array_equal(np.isnan(again), np.isnan(disparity))
    stored = np.clip(disparity, 1 / 256, None)
    assert np.nanmax(abs(again - stored), initial=0) <= 1 / 512 + 1e-6


@pytest.mark.parametrize('kind, scale', [('<f4', '-0.003922'), ('>f4', '1.0'), ('<f4', '-1')])
def test_the_scale_of_a_pfm_tells_only_the_byte_order(tmp_path, kind, scale):
    """As the ground truth of Middlebury 2014 wants it; OpenCV multiplies by 255 there."""
    values = np.array([[1, 2, 3], [4, 5, np.inf]])
    (tmp_path / 'truth.pfm').write_bytes(
        f'Pf\n3 2\n{scale}\n'.encode() + values[::-1].astype(kind).tobytes())
    assert np.array_equal(read_disparity(tmp_path / 'truth.pfm'), [[1, 2, 3], [4, 5, np.nan]],
                          equal_nan=True)


@examples(40)
@given(st.data(), st.sampled_from([np.uint8, np.uint16]), st.sampled_from([1, 3]),
       st.sampled_from([None, 1, 3, 128, 256]))
def test_pictures_of_ground_truth_are_read_by_their_scale(tmp_path, data, kind, channels, scale):
    levels = data.draw(arrays.arrays(kind, SHAPES))
    cv2.imwrite(str(tmp_path / 'truth.png'), np.dstack([levels] * channels))
    if kind == np.uint8 and scale is None:
        with pytest.raises(ValueError, match='the grey levels of one pixel'):
            read_disparity(tmp_path / 'truth.png')
        return
    known = np.where(levels > 0, levels / np.float32(scale or 256), np.nan)
    found = read_disparity(tmp_path / 'truth.png', scale=scale)
    np.testing.assert_allclose(found, known, rtol=1e-7)


def test_what_is_no_map_is_rejected_with_a_sentence(tmp_path):
    cv2.imwrite(str(tmp_path / 'colour.png'), np.eye(3, dtype=np.uint8)[None])
    cv2.imwrite(str(tmp_path / 'grey.png'), np.eye(3, dtype=np.uint8))
    np.save(tmp_path / 'cube.npy', np.zeros((2, 2, 2)))
    np.save(tmp_path / 'empty.npy', np.zeros((0, 5)))
    (tmp_path / 'empty.pfm').write_bytes(b'Pf\n0 0\n-1.0\n')
    for name, scale, words in (
            ('colour.png', 16, 'colour image'), ('grey.png', 0, 'scale is 0; allowed are number'),
            ('cube.npy', None, r'holds float64 of shape \(2, 2, 2\)'),
            ('cube.npy', 4, 'a scale is for images'), ('empty.npy', None, 'holds no pixels'),
            ('empty.pfm', None, 'holds no pixels')):
        with pytest.raises(ValueError, match=words):
            read_disparity(tmp_path / name, scale=scale)


@pytest.mark.parametrize('write, names, words', [
    (write_disparity, ['map.tiff', 'map', 'map.jpg'], MAPS),
    (lambda path, image: check_map_suffix(path), ['map.tiff', 'map', 'map.jpg'], MAPS),
    (write_image, ['picture', 'picture.docx'], 'no image format; take .png')])
def test_an_unknown_suffix_is_rejected_before_anything_is_written(tmp_path, write, names, words):
    for name in names:
        with pytest.raises(ValueError, match=words):
            write(tmp_path / name, np.zeros((2, 2), np.uint8))
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize('method, number', [('replace', errno.ENOSPC), ('unlink', errno.EROFS)])
def test_a_write_that_fails_names_the_file_and_leaves_the_old_one_and_no_other(
        tmp_path, monkeypatch, method, number):
    """Of a disk that is only read, too: nothing temporary is there to be removed."""
    def fail(path, *_, **__):
        raise OSError(number, os.strerror(number), str(path))

    write_whole(tmp_path / 'file', b'old')
    with monkeypatch.context() as patch:
        patch.setattr(Path, method, fail)
        with pytest.raises(OSError) as ended:
            write_whole(tmp_path / 'file', b'new')
    assert (ended.value.errno, ended.value.filename) == (number, str(tmp_path / 'file'))
    assert os.listdir(tmp_path) == ['file']
    assert (tmp_path / 'file').read_bytes() == b'old'


def test_a_link_that_somebody_put_beside_a_file_is_not_followed(tmp_path):
    (tmp_path / 'victim').write_text('kept')
    (tmp_path / f'.file.{os.getpid()}.part').symlink_to(tmp_path / 'victim')
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


def test_the_orientation_of_a_tiff_is_ignored_as_that_of_other_formats(tmp_path):
    for kind, *form in product((np.uint8, np.uint16), range(1, 9), '<>', (False, True)):
        image = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (5, 8)).astype(kind)
        (tmp_path / 'image.tif').write_bytes(tiff(image, *form))
        np.testing.assert_array_equal(read_image(tmp_path / 'image.tif'), image)


def test_what_is_no_image_is_rejected_by_name(tmp_path):
    """Any bytes: see test_fuzz_files.py."""
    with pytest.raises(ValueError, match='cannot be read: Is a directory'):
        read_image(tmp_path)
    (tmp_path / 'text.png').write_bytes(b'no image')
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


# ---- disparities into metres ----

FAR_AND_NEAR = arrays.arrays(
    np.float32, st.tuples(st.integers(1, 5), st.integers(1, 9)),
    elements=st.one_of(st.integers(-500, 2000).map(lambda steps: steps / 16), st.just(np.nan)))
CALIBRATIONS = st.builds(
    Calibration, focal=st.floats(50, 5000), baseline=st.floats(0.01, 2),
    offset=st.integers(-40000, 40000).map(lambda number: number / 1000), left=st.builds(
        Projection, st.floats(50, 5000), st.floats(50, 5000), st.floats(-10, 50),
        st.floats(-10, 50)))


@pytest.mark.parametrize('depth, millimetres', [
    (np.nan, 0), (np.inf, 0), (0.0004, 0), (0.0006, 1), (1.2344, 1234), (1.2346, 1235),
    (65.5344, 65534), (65.535, 65535), (65.536, 0), (70.0, 0), (131.07, 0), (2.2e6, 0),
    (1e30, 0)])
def test_millimetres_are_rounded_and_zero_where_there_are_none(depth, millimetres):
    for shape in ((1, 1), (1, 5), (4, 1), (1, 4), (3, 37)):
        found = millimetres_of(np.full(shape, depth, np.float32))
        np.testing.assert_array_equal(found, np.full(shape, millimetres, np.uint16))
        assert found.dtype == np.uint16


@examples(60)
@given(FAR_AND_NEAR, CALIBRATIONS)
def test_a_point_is_seen_at_its_pixel_with_its_disparity(disparity, calibration):
    before, left, depth = disparity.copy(), calibration.left, calibration.depth(disparity)
    np.testing.assert_array_equal(disparity, before)
    points = left.points(depth, np.full((*depth.shape, 3), -7, np.float32)).astype(np.float64)
    corrected = disparity - np.float32(calibration.offset)
    seen = corrected > 0
    np.testing.assert_array_equal(
        depth[~seen], np.where(np.isnan(disparity), np.float32(np.nan), np.inf)[~seen])
    assert depth.dtype == np.float32
    rows, columns = np.nonzero(seen)
    x, y, z = points[seen].T
    assert (z > 0).all()
    np.testing.assert_allclose(left.fx * x / z + left.cx, columns, atol=1e-4)
    np.testing.assert_allclose(left.fy * y / z + left.cy, rows, atol=1e-4)
    np.testing.assert_allclose(calibration.focal * calibration.baseline / z, corrected[seen],
                               rtol=3e-7)


@pytest.mark.parametrize('depth, disparity', [
    (10.0, 24.0), (np.nan, np.nan), (np.inf, 4.0), (0.0, np.nan), (-0.0, np.nan), (-2.0, np.nan),
    (-np.inf, np.nan)])
def test_the_disparity_of_a_depth_is_the_one_it_comes_from(depth, disparity):
    found = disparity_of(np.full((3, 11), depth, np.float32),
                         Calibration(400.0, 0.5, 4.0, Projection(410.0, 395.5, 17.25, 11.5)))
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, np.full((3, 11), disparity, np.float32))
