# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How the picture moved: one shift of all of it, and which tiles are others now."""
import cv2
from fuzzy_stereo_ros.matching.motion import Motion
import numpy as np
import pytest

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


def glances(motion, *images):
    return [motion.glance(np.ascontiguousarray(image)) for image in images]


@pytest.mark.parametrize('down, right', [(0, 0), (0, 2), (3, -7), (-12, 16), (20, 30)])
@pytest.mark.parametrize('noise', [0, 6])
def test_the_shift_of_a_picture_is_found_within_a_pixel(down, right, noise):
    motion, picture = Motion(*SHAPE), landscape(1).astype(np.float32)
    chance = np.random.default_rng(2)
    before, now = (np.clip(image + noise * chance.standard_normal(SHAPE), 0, 255).astype(np.uint8)
                   for image in (seen(picture, 0, 0), seen(picture, down, right)))
    found = motion.between(*glances(motion, before, now))
    assert abs(found[0] - down) <= 1
    assert abs(found[1] - right) <= 1


@pytest.mark.parametrize('rows, columns', [(300, 470), (301, 473), (480, 640), (375, 1242)])
def test_a_picture_that_stays_has_not_moved_whatever_its_size(rows, columns):
    motion = Motion(rows, columns)
    one, = glances(motion, landscape(3, (rows, columns))[40:40 + rows, 40:40 + columns])
    assert motion.between(one, one.copy()) == (0, 0)


def test_comparing_leaves_the_glances_as_they_were():
    motion, picture = Motion(*SHAPE), landscape(4)
    before, now = glances(motion, seen(picture, 0, 0), seen(picture, 4, 4))
    copies = before.copy(), now.copy()
    motion.between(before, now)
    motion.change(before, now, 4, 4, (19, 30))
    np.testing.assert_array_equal(before, copies[0])
    np.testing.assert_array_equal(now, copies[1])


def test_no_tile_changed_where_the_picture_moved_or_grew_brighter():
    motion, picture = Motion(*SHAPE), landscape(5)
    before, now = glances(motion, seen(picture, 0, 0) // 2, seen(picture, 0, 8) // 2 + 30)
    change = motion.change(before, now, 0, 8, (19, 30))
    assert change[:, 1:].max() < 1
    assert motion.change(before, now, 0, 0, (19, 30)).max() > 3


def test_the_tiles_of_a_new_object_changed_and_no_others():
    motion, before = Motion(*SHAPE), seen(landscape(6), 0, 0)
    now = before.copy()
    now[100:180, 200:300] = 250
    change = motion.change(*glances(motion, before, now), 0, 0, (19, 30))
    assert change[7:11, 14:18].min() > 10
    assert np.delete(change, range(5, 13), axis=0).max() < 1


@pytest.mark.parametrize('rows, columns', [(2, 2), (63, 400), (400, 63)])
def test_images_too_small_for_a_glance_never_move(rows, columns):
    motion = Motion(rows, columns)
    one, = glances(motion, np.zeros((rows, columns), np.uint8))
    assert motion.between(one, one) == (0, 0)
    assert not motion.change(one, one, 0, 0, (1, 1)).any()
