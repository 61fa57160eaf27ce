# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The conditions are what they are called, and always the same."""
from dataclasses import replace

from bench.conditions import CONDITIONS, under_condition
from made_scenes import known as made_known
import numpy as np
import pytest

SIZE = 120, 160, 16
UNCHANGED = ('clean', *(f'rows {rows} px lower' for rows in ('0.5', '1', '1.5')),
             'gain 0.7, 8 levels less', 'gamma 1.4', 'blur of 1.2 px')


def level(grey, shape=SIZE[:2]):
    """Return a pair whose images have one grey level."""
    image = np.full(shape, grey, np.uint8)
    return replace(made_known(size=(*shape, 16)), left=image, right=image)


@pytest.mark.parametrize('colour', [False, True])
@pytest.mark.parametrize('name', CONDITIONS)
def test_a_condition_is_the_same_each_time_and_keeps_shape_truth_and_dtype(name, colour):
    pair = made_known(size=SIZE, colour=colour)
    first, again = under_condition(pair, name), under_condition(pair, name)
    for side in ('left', 'right'):
        image = getattr(first, side)
        assert image.shape == getattr(pair, side).shape and image.dtype == np.uint8
        np.testing.assert_array_equal(image, getattr(again, side))
    assert first.truth is pair.truth
    assert np.array_equal(first.left, pair.left) == (name in UNCHANGED)
    assert np.array_equal(first.right, pair.right) == (name == 'clean')


def test_the_content_of_the_right_image_lies_as_many_rows_lower_as_the_name_says():
    pair = made_known(size=SIZE)
    lower = under_condition(pair, 'rows 1 px lower').right
    np.testing.assert_array_equal(lower[1:], pair.right[:-1])
    ramp = replace(pair, right=np.repeat(np.arange(120, dtype=np.uint8)[:, None] * 2, 160, 1))
    for name, fall in (('rows 0.5 px lower', 1), ('rows 1.5 px lower', 3)):
        moved = under_condition(ramp, name).right.astype(int)
        np.testing.assert_array_equal((ramp.right - moved)[5:-5], fall)


@pytest.mark.parametrize(('name', 'left', 'right'), [
    ('gain 0.7, 8 levels less', 200, 132), ('gamma 1.4', 200, round(255 * (200 / 255)**1.4)),
    ('both times 0.75', 150, 150), ('blur of 1.2 px', 200, 200), ('both JPEG 50', 200, 200)])
def test_grey_levels_become_what_the_name_says(name, left, right):
    pair = under_condition(level(200), name)
    assert (pair.left == left).all() and (pair.right == right).all()
