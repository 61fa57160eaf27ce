# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Layers of like contrast: their truth matches both images, pans and comes nearer as asked."""
from fuzzy_stereo_ros.synthetic.layers import BACKGROUND, make_layers
import numpy as np
import pytest

SIZE = 200, 260


def layers(frames, **options):
    return list(make_layers(*SIZE, frames, seed=1, **{'contrast': 20, 'blur': 1.5, **options}))


def test_visible_pixels_are_equal_in_both_images():
    pair, = layers(1)
    column = np.arange(SIZE[1]) - pair.truth.astype(int)
    there = np.take_along_axis(pair.right, np.maximum(column, 0), axis=1)
    assert (there[pair.visible] == pair.left[pair.visible]).all()
    assert 0.5 < pair.visible.mean() < 1


def test_a_pan_moves_image_and_truth_to_the_left():
    first, second = layers(2, pan=3)
    np.testing.assert_array_equal(second.left[:, :-3], first.left[:, 3:])
    np.testing.assert_array_equal(second.truth[:, :-3], first.truth[:, 3:])


def test_objects_come_nearer_in_the_right_image_alone():
    first, *_, last = layers(11, approach=0.05)
    np.testing.assert_array_equal(first.left, last.left)
    nearer = last.truth - first.truth
    assert nearer[first.truth > BACKGROUND] == pytest.approx(0.5, abs=1e-4)
    assert (nearer[first.truth == BACKGROUND] == 0).all()


def test_each_frame_has_noise_of_its_own():
    clean, first, second = layers(1)[0], *layers(2, noise=2.0)
    for noisy in (first, second):
        assert (noisy.left.astype(float) - clean.left).std() == pytest.approx(2, rel=0.1)
    assert (first.left != second.left).mean() > 0.5
