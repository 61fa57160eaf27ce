# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The rectangle in which no pixel is missing."""
import cv2
from fuzzy_stereo_ros.pairs.pair_reader import largest_window
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

masks = arrays.arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12)))


@given(masks)
def test_nothing_is_missing_in_the_window(there):
    window = largest_window(there)
    assert there[window].all()
    assert there[window].size > 0 or window == (slice(0, 0), slice(0, 0))


@given(st.integers(0, 4), st.integers(0, 4), st.integers(0, 4), st.integers(0, 4))
def test_whole_borders_that_are_missing_are_cut_and_no_more(top, bottom, left, right):
    there = np.zeros((10 + top + bottom, 12 + left + right), bool)
    there[top:top + 10, left:left + 12] = True
    assert largest_window(there) == (slice(top, top + 10), slice(left, left + 12))


def test_the_side_that_misses_the_largest_share_goes_first_however_short_it_is():
    there = np.ones((10, 100), bool)
    there[:9, :12] = False
    assert largest_window(there) == (slice(0, 10), slice(12, 100))


def largest_area(there):
    """Return the area of the largest rectangle in which nothing is missing."""
    best, heights = 0, np.zeros(there.shape[1], int)
    for row in there:
        heights = (heights + 1) * row
        for first in range(heights.size):
            lowest = np.minimum.accumulate(heights[first:])
            best = max(best, int((lowest * np.arange(1, lowest.size + 1)).max()))
    return best


@pytest.mark.parametrize('degrees', [-6, -2, 1, 4, 8])
@pytest.mark.parametrize('shift', [(0, 0), (5, -3)])
def test_the_window_of_a_turned_image_is_nearly_the_largest_there_is(degrees, shift):
    turn = cv2.getRotationMatrix2D((60, 40), degrees, 1)
    turn[:, 2] += shift
    there = cv2.warpAffine(np.full((80, 120), 255, np.uint8), turn, (120, 80)) == 255
    window = largest_window(there)
    assert there[window].size >= 0.9 * largest_area(there)
