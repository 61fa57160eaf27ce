# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pictures averaged over frames: which tiles show the same, and what becomes of them."""
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    blend, choose_tiles, compare_tiles, roughness, TILE)
from fuzzy_stereo_ros.matching.realtime.averaging import Averaging, RULES
from fuzzy_stereo_ros.matching.realtime.possibility import View
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference_averaging as twins
from reference_census import eight_bits

SHAPES = [(2, 2), (1, 40), (40, 1), (16, 16), (17, 33), (33, 50)]
SHIFTS = [(0, 0), (0, 2), (3, -7), (-16, 20), (0, 900), (-900, 0), (5, -900)]


def pictures(shape, seed=0, step=700, top=2**16):
    """Return uint16 fine grey (R, C) and another that differs by random steps."""
    chance = np.random.default_rng([seed, *shape])
    one = chance.integers(0, top, shape)
    return (np.clip(one + chance.integers(-step, step + 1, shape), 0, top - 1).astype(np.uint16),
            one.astype(np.uint16))


def padded(fine):
    around = np.pad(fine, MARGIN, 'edge')
    return np.pad(around, ((0, 0), (0, SLACK)), 'edge')


def tiles_of(shape):
    return -(-shape[0] // TILE), -(-shape[1] // TILE)


# ---- the kernels ----


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('shift', SHIFTS)
@pytest.mark.parametrize('step', [700, 65535])
def test_the_differences_of_tiles_are_those_of_the_twin(shape, shift, step):
    now, before = pictures(shape, 1, step)
    tiles = tiles_of(shape)
    found = np.full((4, *tiles), 99, np.float32)
    for first, last in ((0, 1), (1, tiles[0])):
        compare_tiles(padded(now), before, *shift, found, first, last)
    expected = twins.tile_differences(now, before, *shift)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize('shape', SHAPES)
def test_roughness_is_that_of_the_twin(shape):
    fine, _ = pictures(shape)
    found = np.full(tiles_of(shape), 99, np.float32)
    for first, last in ((0, 1), (1, found.shape[0])):
        roughness(padded(fine), shape[1], found, first, last)
    np.testing.assert_allclose(found, twins.roughness(fine), rtol=1e-5)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 4), st.integers(1, 4), st.integers(1, 20), st.integers(0, 99))
def test_which_tiles_are_the_same_is_as_in_the_twin(rows, columns, noise, seed):
    chance = np.random.default_rng(seed)
    # 0.07: no difference lies just on a rule's border, where rounding decides.
    differences = (chance.integers(0, 30, (2, 4, rows, columns)) / 4 + 0.07).astype(np.float32)
    ages = chance.integers(0, 10, (2, rows, columns)).astype(np.float32)
    choices = np.zeros((rows, columns), np.int8)
    new_ages, sizes = (np.zeros((rows, columns), np.float32) for _ in range(2))
    share = choose_tiles(differences, ages, noise / 4, tuple(RULES), choices, new_ages, sizes)
    expected = twins.chosen_tiles(differences, ages, noise / 4, RULES)
    np.testing.assert_array_equal(choices, expected[0])
    np.testing.assert_array_equal(new_ages, expected[1])
    np.testing.assert_array_equal(sizes, differences[:, 0].min(axis=0))
    assert share == np.mean(choices >= 0)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(SHAPES), st.sampled_from(SHIFTS), st.sampled_from([300, 65535]),
       st.integers(0, 999))
def test_a_blended_picture_is_that_of_the_twin(shape, shift, step, seed):
    now, before = pictures(shape, seed, step)
    chance, tiles = np.random.default_rng(seed), tiles_of(shape)
    shifts = np.array([(0, 0), shift], np.int64)
    choices = chance.integers(-1, 2, tiles).astype(np.int8)
    ages = chance.integers(1, 9, tiles).astype(np.float32)
    limits = chance.choice([0, 0.5, 3, 300], tiles).astype(np.float32)
    after = np.zeros_like(now)
    fine, grey = padded(now), np.full((shape[0], shape[1] + SLACK), 7, np.uint8)
    grey[:, :shape[1]] = eight_bits(now)
    for first, last in ((0, 1), (1, tiles[0])):
        blend(fine, grey, before, shifts, choices, ages, limits, after, first, last)
    expected = twins.blended(now, before, shifts, choices, ages, limits)
    np.testing.assert_array_equal(fine, padded(expected))
    np.testing.assert_array_equal(after, expected)
    np.testing.assert_array_equal(grey[:, :shape[1]], eight_bits(expected))
    assert np.all(grey[:, shape[1]:] == 7)


# ---- the whole: noise goes, what changed stays ----

SIZE = 96, 160


def scene(seed=0, shape=SIZE):
    """Return smooth grey with fine texture, in grey levels."""
    chance = np.random.default_rng(seed)
    coarse = chance.uniform(60, 190, (shape[0] // 8, shape[1] // 8))
    return coarse.repeat(8, 0).repeat(8, 1) + chance.uniform(-9, 9, shape)


def follow(scenes, noise):
    """Average views of scenes, noise added to each; return Averaging once all are seen."""
    chance, averaging, pool = np.random.default_rng(7), Averaging(*SIZE), ThreadPool(1)
    for number, shown in enumerate(scenes):
        views = View(*SIZE, False, 0), View(*SIZE, True, 0)
        for view in views:
            image = np.clip(np.rint(shown + noise * chance.standard_normal(SIZE)), 0, 255)
            view.read(image.astype(np.uint8), 0, 8, 0, SIZE[0])
        if number == 0:
            averaging.begin(pool, views)
        else:
            averaging.average(pool, views, averaging.pictures, averaging.ages)
    return averaging


def images_of(averaging):
    """Return what both pictures show in grey levels, the right one not mirrored."""
    left, right = averaging.pictures / 256
    return left, right[:, ::-1]


@pytest.mark.parametrize('noise', [1.0, 3.0, 8.0])
def test_noise_goes_where_nothing_changes(noise):
    averaging = follow([scene()] * 6, noise)
    for image in images_of(averaging):
        left = image - scene()
        assert left.std() < 0.55 * np.hypot(noise, 0.3)
        assert abs(left.mean()) < 0.3
    assert averaging.ages.mean() > 5
    assert 0.6 * noise < averaging.noise < 1.3 * noise


def test_noise_goes_where_all_moves_alike():
    wide = scene(1, (SIZE[0] + 16, SIZE[1] + 16))
    scenes = [wide[frame:frame + SIZE[0], 3 * frame:3 * frame + SIZE[1]] for frame in range(5)]
    averaging = follow(scenes, 4.0)
    assert averaging.shift == (-1, -3)
    for image in images_of(averaging):
        assert (image - scenes[-1])[:64, :128].std() < 0.6 * 4.0


def test_without_noise_pictures_stay_as_they_are():
    averaging = follow([scene()] * 3, 0.0)
    for image in images_of(averaging):
        np.testing.assert_array_equal(image, np.rint(scene()))
    assert averaging.noise == 0
    assert averaging.ages.max() == 3


def test_a_tile_is_the_mean_of_no_more_than_so_many_frames():
    assert follow([scene()] * (RULES.oldest + 3), 2.0).ages.max() == RULES.oldest


@pytest.mark.parametrize('noise', [0.0, 2.0, 6.0])
def test_another_scene_is_seen_as_it_is(noise):
    averaging = follow([scene(1)] * 3 + [scene(2)], noise)
    assert all((seen.choices == -1).all() for seen in averaging.seen)
    assert (averaging.ages == 1).all()
    np.testing.assert_array_equal(averaging.pictures % 256, 0)


@pytest.mark.parametrize('noise', [0.0, 2.0, 6.0])
@pytest.mark.parametrize('place, step', [
    (np.s_[16:48, 32:80], 12.0), (np.s_[40:44, 70:74], 60.0), (np.s_[0:96, 50:52], 60.0)])
def test_the_tiles_of_what_is_new_are_seen_as_they_are(noise, place, step):
    new = scene(3)
    new[place] += step
    averaging = follow([scene(3)] * 3 + [new], noise)
    touched = np.zeros(SIZE, bool)
    touched[place] = True
    rows, columns = (size // TILE for size in SIZE)
    touched = touched.reshape(rows, TILE, columns, TILE).any(axis=(1, 3))
    same = averaging.seen[0].choices == 0
    assert not same[touched].any()
    assert same[~touched].mean() > 0.9


def test_texture_that_moves_by_itself_is_seen_as_it_is():
    new = scene(4)
    new[32:64, 48:96] = np.roll(scene(4), 1, axis=1)[32:64, 48:96]
    same = follow([scene(4)] * 2 + [new], 1.0).seen[0].choices == 0
    assert not same[2:4, 3:6].any()
    assert same.mean() > 0.8
