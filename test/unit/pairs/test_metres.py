# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Disparities into metres: depth, millimetres and points in space."""
from fuzzed import examples
from fuzzy_stereo_ros.pairs.calibration import disparity_of, millimetres_of
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
import pytest

DISPARITIES = arrays(
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
@given(DISPARITIES, CALIBRATIONS)
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
