# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a Match says of itself in Python, and its metres by a camera that knows them."""
import cv2
from fuzzy_stereo_ros.matching import Match
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
import numpy as np
import pytest

CAMERA = Calibration(200.0, 0.5, 2.0, Projection(200.0, 100.0, 1.0, 0.5))
DISPARITY = np.float32([[12, 7, np.nan], [4, 2, 1]])


def made(disparity=DISPARITY, **fields):
    return Match(**{'disparity': disparity, 'confidence': np.full(disparity.shape, 0.5),
                    'history': [], 'times': {'search': 3.0, 'total': 4.26}, 'warm': True,
                    **fields})


def test_a_match_shows_in_one_line_what_tells_most():
    assert repr(made()) == 'Match(3x2, 83.3 % valid, mean confidence 0.50, 4.3 ms, warm)'
    assert repr(made(times={}, warm=False)).endswith('0.0 ms, cold)')


@pytest.mark.parametrize('disparity, low, high', [
    (DISPARITY, 1, 12), (np.full((2, 3), np.nan, np.float32), 0, 0)])
def test_a_notebook_shows_the_disparities_in_colours_from_end_to_end(disparity, low, high):
    picture = cv2.imdecode(np.frombuffer(made(disparity)._repr_png_(), np.uint8),
                           cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(picture, colour_disparity(disparity, low, high))


def test_metres_come_from_the_camera_that_is_given():
    depth = made().depth(CAMERA)
    np.testing.assert_array_equal(depth, np.float32([[10, 20, np.nan], [50, np.inf, np.inf]]))
    points = made().points(CAMERA)
    assert points.dtype == np.float32 and points.shape == (2, 3, 3)
    np.testing.assert_allclose(points[0, 0], [-0.05, -0.05, 10])
    np.testing.assert_allclose(points[1, 0], [-0.25, 0.25, 50])
    assert np.isnan(points[1, 1:]).all()
