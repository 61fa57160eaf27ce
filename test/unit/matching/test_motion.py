# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How the picture moved: one shift of all of it; and moving what is known of it."""
from census_scene import random_map
import cv2
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.temporal.motion import (
    best_shift, move_ages, move_map, thumbnail)
from fuzzy_stereo_ros.matching.realtime.averaging import Motion
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_averaging as twins

SHAPE = 300, 470


def landscape(seed, shape=SHAPE, margin=40):
    """Return smooth random grey, larger than a shape by a margin on each side."""
    chance = np.random.default_rng(seed)
    size = shape[0] + 2 * margin, shape[1] + 2 * margin
    fine = cv2.GaussianBlur(chance.uniform(0, 255, size).astype(np.float32), (0, 0), 6)
    return np.clip(127 + 12 * (fine - fine.mean()), 0, 255).astype(np.uint8)


def seen(picture, down, right, margin=40):
    """Return the picture moved by a number of pixels."""
    return picture[margin - down:margin - down + SHAPE[0],
                   margin - right:margin - right + SHAPE[1]]


def fine(image):
    """Return an image as fine grey, and the same with padding around."""
    grey = image.astype(np.uint16) * np.uint16(256)
    return grey, np.pad(grey, ((MARGIN, MARGIN), (MARGIN, MARGIN + SLACK)), 'edge')


def found_between(motion, before, now):
    return motion.between(fine(before)[0], fine(now)[1])


@pytest.mark.parametrize('down, right', [(0, 0), (0, 2), (3, -7), (-12, 16), (20, 30)])
@pytest.mark.parametrize('noise', [0, 6])
def test_the_shift_of_a_picture_is_found(down, right, noise):
    motion, picture = Motion(*SHAPE), landscape(1).astype(np.float32)
    chance = np.random.default_rng(2)
    before, now = (np.clip(image + noise * chance.standard_normal(SHAPE), 0, 255).astype(np.uint8)
                   for image in (seen(picture, 0, 0), seen(picture, down, right)))
    assert found_between(motion, before, now) == (down, right)


@pytest.mark.parametrize('rows, columns', [(300, 470), (301, 473), (480, 640), (375, 1242)])
def test_a_picture_that_stays_has_not_moved_whatever_its_size(rows, columns):
    image = landscape(3, (rows, columns))[40:40 + rows, 40:40 + columns]
    assert found_between(Motion(rows, columns), image, image) == (0, 0)


@pytest.mark.parametrize('rows, columns', [(2, 2), (15, 400), (400, 15)])
def test_images_too_small_for_a_glance_never_move(rows, columns):
    image = np.zeros((rows, columns), np.uint8)
    assert found_between(Motion(rows, columns), image, image) == (0, 0)


@pytest.mark.parametrize('size', [1, 4, 7])
@pytest.mark.parametrize('margin', [0, MARGIN])
def test_a_glance_is_the_mean_of_squares(size, margin):
    picture = fine(landscape(4))[margin > 0]
    small = np.zeros((30, 40), np.float32)
    thumbnail(picture, margin, size, small)
    inside = picture[margin:margin + 30 * size, margin:margin + 40 * size]
    np.testing.assert_allclose(
        small, inside.reshape(30, size, 40, size).mean(axis=(1, 3)), rtol=1e-5)


@pytest.mark.parametrize('known', [(2, -3), (3, -6), (2, -4), (0, -2)])
def test_a_shift_that_is_nearly_known_becomes_exact(known):
    picture = landscape(5)
    before, now = fine(seen(picture, 0, 0))[0], fine(seen(picture, 2, -4))[1]
    assert best_shift(now, before, *known, 2, 16) == (2, -4)


@pytest.mark.parametrize('known', [(0, 0), (5, -7), (900, 900)])
def test_a_shift_of_a_picture_without_texture_stays_as_it_is_known(known):
    flat = np.full(SHAPE, 9, np.uint8)
    assert best_shift(fine(flat)[1], fine(flat)[0], *known, 2, 16) == known


# ---- what moves with it ----


@pytest.mark.parametrize('shape', [(1, 1), (1, 5), (4, 1), (5, 6)])
@pytest.mark.parametrize('shift', [(0, 0), (TILE, -2 * TILE), (8, 4), (-3, 900), (-1, -1)])
def test_moved_ages_lie_on_lines_between_the_tiles_centres(shape, shift):
    ages = np.random.default_rng(1).integers(0, 9, shape).astype(np.float32)
    moved = np.full_like(ages, 99)
    move_ages(ages, *shift, moved)
    np.testing.assert_allclose(moved, twins.moved_ages(ages, *shift), atol=1e-5)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(-50, 50), st.integers(-50, 50),
       st.integers(0, 99))
def test_a_map_moves_but_for_the_tiles_that_stayed(rows, columns, down, right, seed):
    source = random_map((rows, columns), 200, seed)
    tiles = -(-rows // TILE), -(-columns // TILE)
    choices = random_map(tiles, 3, seed + 1).astype(np.int8) - np.int8(1)
    moved = np.full_like(source, 7)
    for first, last in ((0, 1), (1, tiles[0])):
        move_map(source, choices, down, right, 255, moved, first, last)
    np.testing.assert_array_equal(
        moved, twins.brought_forward(source, choices, down, right, 255))
