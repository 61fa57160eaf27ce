# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cameras in files come back as they were, and a file that says something else is rejected."""
from fuzzed import examples
from fuzzy_stereo_ros.pairs.calibration import expected_size, read_calibration
from fuzzy_stereo_ros.pairs.camera_files import (
    Camera, read_camera, rectified_cameras, write_camera, write_middlebury_calibration)
from fuzzy_stereo_ros.pairs.camera_formats import read_cameras
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
from hypothesis import given, strategies as st
import pytest

numbers = st.floats(-1e4, 1e4)
calibrations = st.builds(
    lambda fx, fy, baseline, offset, cx, cy: Calibration(
        fx, baseline, offset, Projection(fx, fy, cx, cy)),
    st.floats(1, 1e4), st.floats(1, 1e4), st.floats(0.01, 10), numbers, numbers, numbers)


@examples(20)
@given(k=st.tuples(*[numbers] * 9), p=st.tuples(*[numbers] * 12), r=st.tuples(*[numbers] * 9),
       d=st.lists(numbers, max_size=14).map(tuple), rows=st.integers(1, 9999),
       model=st.sampled_from(['plumb_bob', 'rational_polynomial', 'equidistant']))
def test_a_camera_comes_back_from_its_file_to_the_last_bit(tmp_path, k, p, r, d, rows, model):
    camera = Camera(rows, 640, k, p, r, d, model)
    write_camera(tmp_path / 'left.yaml', camera, 'made/left')
    assert read_camera(tmp_path / 'left.yaml') == camera


@examples(20)
@given(known=calibrations)
def test_a_rig_comes_back_from_yaml_and_from_calib_txt(tmp_path, known):
    for side, camera in rectified_cameras(known, 48, 64).items():
        write_camera(tmp_path / f'{side}.yaml', camera, side)
    paths = [tmp_path / 'left.yaml', tmp_path / 'right.yaml']
    write_middlebury_calibration(tmp_path / 'calib.txt', known, (48, 64), -3, 20)
    for cameras in (read_cameras(paths), read_cameras(paths[1:], offset=known.offset),
                    read_cameras([tmp_path / 'calib.txt'])):
        found = read_calibration(*cameras)
        assert (found.focal, found.baseline) == pytest.approx(
            (known.focal, known.baseline), rel=1e-12)
        assert (found.offset, *found.left) == pytest.approx(
            (known.offset, *known.left), rel=1e-12, abs=1e-10)
        assert expected_size(cameras[1]) == (48, 64)


def test_the_calibration_of_middlebury_2014_is_in_metres_and_of_our_sign(tmp_path):
    """At doffs of 131 px what has no disparity is no further than f B / doffs."""
    (tmp_path / 'calib.txt').write_text(
        'cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\n'
        'cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\ndoffs=131.111\n'
        'baseline=193.001\nwidth=2964\nheight=1988\nndisp=280\nisint=0\nvmin=31\nvmax=257\n')
    cameras = read_cameras([tmp_path / 'calib.txt'])
    found = read_calibration(*cameras)
    assert found.baseline == pytest.approx(0.193001)
    assert (found.focal, found.offset) == (3997.684, pytest.approx(-131.111))
    assert found.left == (3997.684, 3997.684, 1176.728, 1011.728)
    assert expected_size(cameras[1]) == (1988, 2964)


def test_files_that_no_format_takes_together_are_rejected(tmp_path):
    write_camera(tmp_path / 'one.yaml', Camera(4, 4, 9 * (1.0,), 12 * (1.0,)), 'one')
    with pytest.raises(ValueError, match='one.yaml and .*one.yaml and .*one.yaml; allowed'):
        read_cameras(3 * [tmp_path / 'one.yaml'])
