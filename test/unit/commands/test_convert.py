# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo convert` makes of a file comes back as it was, and is where geometry says."""
from pathlib import Path
import re

import cv2
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.camera_files import (
    centred_calibration, rectified_cameras, write_camera, write_middlebury_calibration)
from fuzzy_stereo_ros.pairs.disparity_files import (
    read_depth, read_disparity, write_depth, write_disparity)
from fuzzy_stereo_ros.pairs.image_files import write_image
from hypothesis import given, HealthCheck, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures('folder')
NAN, INF = np.nan, np.inf
FOCAL, BASELINE, OFFSET = 400.0, 0.25, -3.0
CAMERAS = ['--focal', f'{FOCAL}', '--baseline', f'{BASELINE}', '--offset', f'{OFFSET}']
SHAPES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=7)
same_folder = settings(max_examples=12,
                       suppress_health_check=[HealthCheck.function_scoped_fixture])


def maps(low, high, *others):
    """Return a strategy for float32 (R, C) with numbers, NaN and other values."""
    return arrays.arrays(np.float32, SHAPES, elements=st.one_of(
        st.sampled_from([NAN, *others]), st.floats(np.float32(low), np.float32(high), width=32)))


def done(*words):
    assert main(['convert', *map(str, words), '--overwrite']) == 0


def read_points(path):
    """Return the vertices of a binary PLY file as a structured array."""
    header, content = Path(path).read_bytes().split(b'end_header\n', 1)
    assert header.startswith(b'ply\nformat binary_little_endian 1.0\n')
    types = {'float': '<f4', 'uchar': 'u1'}
    fields = [(name, types[kind]) for kind, name in re.findall(r'property (\w+) (\w+)',
                                                               header.decode())]
    count = int(re.search(rb'element vertex (\d+)', header)[1])
    points = np.frombuffer(content, fields)
    assert len(points) == count
    return points


@same_folder
@given(depth=maps(0.001, 65.5, INF), suffix=st.sampled_from(['.npy', '.pfm', '.png']))
def test_depth_comes_back_from_each_format_from_a_png_to_half_a_millimetre(depth, suffix):
    write_depth('a.npy', depth)
    done('a.npy', f'b{suffix}', '--from', 'depth')
    done(f'b{suffix}', 'c.pfm', '--from', 'depth')
    found, seen = read_depth('c.pfm'), np.isfinite(depth)
    if suffix == '.png':
        stored = cv2.imread('b.png', cv2.IMREAD_UNCHANGED)
        assert stored.dtype == np.uint16 and np.array_equal(stored == 0, ~seen)
        assert np.array_equal(np.isnan(found), ~seen)
        assert np.abs(found[seen] - depth[seen]).max(initial=0) <= 0.0005 + 4e-6
    else:
        assert np.array_equal(found, depth, equal_nan=True)


@same_folder
@given(disparity=maps(-10, 300), colour=st.booleans(), farthest=st.sampled_from(
    [None, 7.5, 0.0]))
def test_each_point_lies_on_the_ray_of_its_pixel_at_its_depth_and_has_its_colour(
        disparity, colour, farthest):
    """As far as it is seen to a third of its disparity, unless a distance, or 0, is given."""
    rows, columns = disparity.shape
    image = np.arange(rows * columns * 3, dtype=np.uint8).reshape(rows, columns, 3)
    image = image if colour else image[:, :, 0]
    write_disparity('a.npy', disparity)
    write_image('left.png', image)
    done('a.npy', 'b.ply', *CAMERAS, '--image', 'left.png', *(
        () if farthest is None else ('--points-max-depth', farthest)))
    points = read_points('b.ply')
    with np.errstate(divide='ignore'):
        depth = np.float32(FOCAL * BASELINE) / (disparity - np.float32(OFFSET))
    limit = {None: FOCAL * BASELINE / 3, 0.0: INF}.get(farthest, farthest)
    down, across = np.nonzero((disparity > OFFSET) & (depth <= limit))
    assert points.dtype.names == ('x', 'y', 'z', 'red', 'green', 'blue')
    assert len(points) == len(down)
    z = FOCAL * BASELINE / (disparity[down, across].astype(float) - OFFSET)
    assert np.allclose(points['z'], z, rtol=1e-6, atol=0)
    for name, pixel, middle in (('x', across, (columns - 1) / 2), ('y', down, (rows - 1) / 2)):
        assert np.allclose(points[name], z * (pixel - middle) / FOCAL, rtol=1e-5, atol=0)
    for channel, name in enumerate(('blue', 'green', 'red')):
        levels = image[:, :, channel] if colour else image
        assert np.array_equal(points[name], levels[down, across])


def test_points_come_from_depth_with_a_focal_length_alone_and_need_no_colours():
    write_depth('a.npy', np.array([[2.0, NAN, INF, 4.0]], np.float32))
    done('a.npy', 'b.ply', '--from', 'depth', '--focal', 2, '--principal-point', 1, -1)
    points = read_points('b.ply')
    assert points.dtype.names == ('x', 'y', 'z')
    assert points.tolist() == [(-1, 1, 2), (4, 2, 4)]


def test_disparities_come_back_from_depth_and_the_cameras_may_stand_in_files():
    disparity = np.array([[1.0, 2.0, 17.0, NAN]], np.float32)
    write_disparity('a.npy', disparity)
    calibration = centred_calibration(FOCAL, BASELINE, OFFSET, 1, 4)
    for side, camera in rectified_cameras(calibration, 1, 4).items():
        write_camera(f'{side}.yaml', camera, side)
    write_middlebury_calibration('calib.txt', calibration, (1, 4), 0, 20)
    for offset, words in (
            (OFFSET, CAMERAS), (OFFSET, ['--calibration', 'calib.txt']),
            (OFFSET, ['--calibration', 'left.yaml', 'right.yaml']),
            (OFFSET, ['--calibration', 'right.yaml', '--offset', OFFSET]),
            (0, ['--calibration', 'right.yaml'])):
        done('a.npy', 'b.npy', '--to', 'depth', *words)
        assert np.allclose(np.load('b.npy'), FOCAL * BASELINE / (disparity - offset),
                           rtol=1e-6, atol=0, equal_nan=True)
        done('b.npy', 'c.npy', '--from', 'depth', '--to', 'disparity', *words)
        assert np.allclose(read_disparity('c.npy'), disparity, atol=1e-5, equal_nan=True)
    write_disparity('a.npy', np.full((2, 3), OFFSET, np.float32))
    done('a.npy', 'b.npy', '--to', 'depth', *CAMERAS)
    assert (read_depth('b.npy') == INF).all()
