# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Colours of disparities: far is blue, near is red, invalid is grey."""
from fuzzy_stereo_ros.matching.match import colour_disparity, INVALID_GREY
import numpy as np


def test_far_is_blue_near_is_red_and_invalid_is_dark_grey():
    far, near, invalid, endless = colour_disparity(np.array([[12, 52, np.nan, np.inf]]), 0, 63)[0]
    assert far[0] > 200 > 100 > far[2]
    assert near[2] > 200 > 100 > near[0]
    assert invalid.tolist() == endless.tolist() == [INVALID_GREY] * 3


def test_what_lies_outside_the_range_takes_the_colour_of_its_end():
    below, low, high, above = colour_disparity(np.array([[-9.0, 5, 20, 99]]), 5, 20)[0]
    assert np.array_equal(below, low) and np.array_equal(above, high)
    assert not np.array_equal(low, high)


def test_a_range_of_one_disparity_has_a_colour():
    assert colour_disparity(np.full((2, 2), 3.0), 3, 3).shape == (2, 2, 3)
