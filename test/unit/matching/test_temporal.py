# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From frame to frame: pictures averaged, how they moved, where the previous best counts."""
from census_scene import padded, random_map
import cv2
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility.features import SLACK
from fuzzy_stereo_ros.matching.kernels.temporal import unchanged_tiles as rules
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    blend, compare_tiles, roughness, TILE, UNITS)
from fuzzy_stereo_ros.matching.kernels.temporal.motion import (
    move_ages, move_map, previous_prior, tile_strengths, trusted_cells)
from fuzzy_stereo_ros.matching.kernels.temporal.unchanged_tiles import (
    add_drifts, ages_of_both, changes_alike, choose_tiles, reject_alike, reject_drifting,
    tile_noises)
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
from fuzzy_stereo_ros.matching.over_frames.averaging import Averaging, History, PictureShift
from fuzzy_stereo_ros.matching.over_frames.pictures import NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.possibility import CensusPicture
from hypothesis import example, given, settings, strategies as st
from made_scenes import noisy
import numpy as np
import pytest
import reference_averaging as twins
from reference_census import eight_bits
from reference_search import doubled
from reference_warp import origins_of_tiles

SHAPES = st.tuples(st.integers(1, 50), st.integers(1, 50))
SHIFTS = st.tuples(st.integers(-20, 20), st.integers(-20, 20)) | st.sampled_from([
    (0, 0), (0, 2), (0, 900), (-900, 0), (5, -900)])


def pictures(shape, seed=0, step=700, top=2**16):
    """Return uint16 luminance (R, C) and another that differs by random steps."""
    random = np.random.default_rng([seed, *shape])
    one = random.integers(0, top, shape)
    return (np.clip(one + random.integers(-step, step + 1, shape), 0, top - 1).astype(np.uint16),
            one.astype(np.uint16))


def tiles_of(shape):
    return -(-shape[0] // TILE), -(-shape[1] // TILE)


# ---- the kernels ----


@settings(max_examples=80)
@given(SHAPES, SHIFTS, st.sampled_from([700, 65535]), st.booleans(), st.integers(0, 99))
def test_what_is_measured_of_tiles_is_that_of_the_twins(shape, shift, step, mirrored, seed):
    (now, before), tiles = pictures(shape, seed, step), tiles_of(shape)
    cells, offset = [side // 2 for side in shape], shape[1] % 2 * mirrored
    found, rough = (np.full((*measures, *tiles), 99, np.float32) for measures in ((8,), ()))
    half_rough = np.full(tiles_of(cells), 99, np.float32)
    for rows in ((0, 1), (1, tiles[0])):
        compare_tiles(padded(now), before, *shift, found, *rows)
    for first in range(0, shape[0], 2 * TILE):
        roughness(padded(now), shape[1], offset, rough, half_rough, first,
                  min(first + 2 * TILE, shape[0]))
    np.testing.assert_allclose(rough, twins.roughness(now), rtol=1e-5)
    if min(cells) > 0:
        halved = now[:2 * cells[0], offset:offset + 2 * cells[1]].astype(int)
        halved = halved.reshape(cells[0], 2, cells[1], 2).sum((1, 3)) // 4
        np.testing.assert_allclose(half_rough, twins.roughness(halved), rtol=1e-5)
    expected = twins.tile_differences(now, before, *shift)
    np.testing.assert_allclose(found[:4], expected[:4], rtol=1e-5, atol=1e-5)
    # float32 leaves the rest of large sums that cancel
    scale = np.sqrt(expected[5] * TILE**2) + 1
    np.testing.assert_array_less(abs(found[4] - expected[4]), 1e-3 * scale)
    np.testing.assert_allclose(found[5:], expected[5:], rtol=1e-3, atol=1)


@settings(max_examples=60)
@given(st.integers(1, 6), st.integers(1, 6), st.integers(1, 2), st.sampled_from([1, 200]),
       st.integers(0, 99))
def test_the_noise_of_tiles_is_that_of_the_twin(rows, columns, shifts, levels, seed):
    random = np.random.default_rng(seed)
    differences = random.uniform(0, 9, (shifts, 8, rows, columns)).astype(np.float32)
    differences[:, 7] = random.integers(0, levels, (rows, columns))
    rough = random.uniform(0, 9, (rows, columns)).astype(np.float32)
    noises = np.zeros((rows, columns), np.float32)
    noise = tile_noises(differences, rough, noises)
    expected = twins.tile_noises(differences, rough)
    np.testing.assert_allclose(noises, expected[0], rtol=1e-5)
    assert noise == pytest.approx(expected[1])


@settings(max_examples=60)
@given(st.integers(1, 4), st.integers(1, 4), st.integers(1, 80), st.integers(0, 99))
def test_which_tiles_are_the_same_is_as_in_the_twin(rows, columns, noise, seed):
    random = np.random.default_rng(seed)
    # 0.07: no difference lies just on a rule's border, where rounding decides.
    differences = (random.integers(0, 30, (2, 8, rows, columns)) / 4 + 0.07).astype(np.float32)
    ages = random.integers(0, rules.OLDEST + 2, (2, rows, columns)).astype(np.float32)
    choices = np.zeros((rows, columns), np.int8)
    new_ages, sizes = (np.zeros((rows, columns), np.float32) for _ in range(2))
    noises = (noise * random.uniform(0.1, 0.4, (rows, columns))).astype(np.float32)
    choose_tiles(differences, ages, noises, choices, new_ages, sizes)
    expected = twins.chosen_tiles(differences, ages, noises, rules)
    np.testing.assert_array_equal(choices, expected[0])
    np.testing.assert_array_equal(new_ages, expected[1])
    np.testing.assert_array_equal(sizes, differences[:, 0].min(axis=0))


@settings(max_examples=60)
@given(SHAPES, SHIFTS, st.sampled_from([300, 65535]), st.integers(0, 999))
def test_a_blended_picture_is_that_of_the_twin(shape, shift, step, seed):
    now, before = pictures(shape, seed, step)
    random, tiles = np.random.default_rng(seed), tiles_of(shape)
    shifts = np.array([(0, 0), shift], np.int64)
    choices = random.integers(-1, 2, tiles).astype(np.int8)
    ages = random.integers(1, 9, tiles).astype(np.float32)
    limits = random.choice([0, 0.5, 3, 300], tiles).astype(np.float32)
    after = np.zeros_like(now)
    luminance, grey = padded(now), np.full((shape[0], shape[1] + SLACK), 7, np.uint8)
    grey[:, :shape[1]] = eight_bits(now)
    for first, last in ((0, 1), (1, tiles[0])):
        blend((luminance, grey), before, shifts, (choices, ages, limits), after, first, last)
    expected = twins.blended(now, before, shifts, choices, ages, limits)
    np.testing.assert_array_equal(luminance, padded(expected))
    np.testing.assert_array_equal(after, expected)
    np.testing.assert_array_equal(grey[:, :shape[1]], eight_bits(expected))
    assert np.all(grey[:, shape[1]:] == 7)


@settings(max_examples=60)
@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 99))
def test_what_tiles_drift_adds_up_and_is_rejected_as_in_the_twin(rows, columns, seed):
    random = np.random.default_rng(seed)
    differences = random.uniform(0, 4, (2, 7, rows, columns)).astype(np.float32)
    differences[:, 4] = random.normal(0, 90, (2, rows, columns))
    differences[:, 5] = random.uniform(0, 900, (2, rows, columns))
    then = np.stack([random.normal(0, 90, (2, rows, columns)),
                     random.uniform(0, 900, (2, rows, columns))], axis=1).astype(np.float32)
    choices = random.integers(-1, 2, (rows, columns)).astype(np.int8)
    drifts = np.full((2, rows, columns), 9, np.float32)
    add_drifts(differences, choices, then, drifts)
    expected = twins.added_drifts(differences, rules, choices, then)
    np.testing.assert_allclose(drifts, expected, rtol=1e-4, atol=1e-2)
    drifting = twins.drifting(rules, choices, drifts.astype(np.float64))
    left, ages = choices.copy(), np.full(choices.shape, 5, np.float32)
    reject_drifting(left, ages, drifts)
    np.testing.assert_array_equal(left, np.where(drifting, -1, choices))
    np.testing.assert_array_equal(ages, np.where(drifting, 1, 5))
    assert not drifts[:, drifting].any()


@settings(max_examples=40)
@given(st.sampled_from([(2, 2), (5, 40), (33, 50)]), SHIFTS, st.sampled_from([0, -6]),
       st.integers(0, 999))
def test_how_alike_both_views_change_their_ages_and_what_is_rejected_are_as_in_the_twins(
        shape, shift, offset, seed):
    views, before = zip(*(pictures(shape, seed + side) for side in (0, 1)))
    random, tiles = np.random.default_rng(seed), tiles_of(shape)
    labels, shifts = random_map(shape, 25, seed), np.array([(0, 0), shift], np.int64)
    choices = random.integers(-1, 2, tiles).astype(np.int8)
    tested = random.integers(0, 2, tiles).astype(bool)
    # contrast as large as the differences, or none
    differences = np.ones((2, 7, *tiles), np.float32)
    differences[:, 6] = np.where(tested, 2 * TILE**2 * (UNITS / 0.8)**2, 0)
    found = np.full(tiles, 9, np.float32)
    changes_alike(tuple(map(padded, views)), np.stack(before), labels, offset,
                  (shifts, differences, choices), found)
    np.testing.assert_allclose(found, twins.alike(
        views, before, labels, offset, shifts, tested, choices), atol=1e-6)
    ages = random.integers(1, 33, (2, *tiles)).astype(np.float32)
    ages_of_both(ages, labels, offset, shifts, choices, found)
    np.testing.assert_allclose(
        found, twins.ages_of_both(ages, labels, offset, shifts, choices), rtol=1e-5)
    both, limit = np.stack([choices, np.zeros_like(choices)]), random.uniform(0, 20)
    ages_then = ages.copy()
    reject_alike(found, limit, labels, offset, shifts, both, ages)
    rejected = twins.rejected_alike(found, limit, labels, offset, shifts, choices)
    np.testing.assert_array_equal(both, np.where(rejected, -1, [choices, 0 * choices]))
    np.testing.assert_array_equal(ages, np.where(rejected, 1, ages_then))


# ---- the whole: noise goes, what changed stays ----

SIZE = 96, 160


def scene(seed=0, shape=SIZE):
    """Return smooth grey with fine texture, in grey levels."""
    random = np.random.default_rng(seed)
    coarse = random.uniform(60, 190, (shape[0] // 8, shape[1] // 8))
    return coarse.repeat(8, 0).repeat(8, 1) + random.uniform(-9, 9, shape)


def follow(scenes, noise):
    """Average views of scenes, noise added to each; return Averaging once all are seen."""
    random, averaging, pool = np.random.default_rng(7), Averaging(*SIZE, 0), ThreadPool(1)
    noises = [NoiseEstimate(*SIZE) for _ in range(2)]
    for number, shown in enumerate(scenes):
        views = CensusPicture(*SIZE, False, 0), CensusPicture(*SIZE, True, 0)
        for view, measured in zip(views, noises):
            view.read(*noisy([shown], noise, random), 0, 8, 0, SIZE[0])
            measured.measure(view, 0, SIZE[0])
        averaging.average(pool, views, noises, History(
            *averaging.kept, np.zeros(SIZE, np.uint8)) if number else None)
    return averaging


def images_of(averaging):
    """Return what both pictures show in grey levels, the right one not mirrored."""
    left, right = averaging.pictures / 256
    return left, right[:, ::-1]


@pytest.mark.parametrize('noise, down, right', [
    (1.0, 0, 0), (3.0, 0, 0), (8.0, 0, 0), (4.0, 1, 3)])
def test_noise_goes_where_nothing_changes_and_where_all_moves_alike(noise, down, right):
    wide = scene(1, (SIZE[0] + 16, SIZE[1] + 16))
    scenes = [wide[down * frame:down * frame + SIZE[0], right * frame:right * frame + SIZE[1]]
              for frame in range(6)]
    averaging = follow(scenes, noise)
    assert averaging.shift == (-down, -right)
    for image in images_of(averaging):
        left = (image - scenes[-1])[:SIZE[0] - 32 * down, :SIZE[1] - 11 * right]
        assert left.std() < 0.55 * np.hypot(noise, 0.3)
        assert abs(left.mean()) < 0.3
    assert right or averaging.kept[1].mean() > 5
    assert 0.6 * noise < averaging.noise < 1.3 * noise


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
    same = averaging.tiles[0].choices == 0
    assert not same[touched].any()
    assert same[~touched].mean() > 0.9


@pytest.mark.parametrize('speed', [0.02, 0.05, 0.2])
def test_an_average_does_not_lag_behind_what_moves_slowly_in_little_contrast(speed):
    texture = cv2.GaussianBlur(np.random.default_rng(5).normal(0, 1, SIZE), (0, 0), 2)
    texture = 120 + 6 * texture / texture.std()
    slope = np.gradient(texture, axis=1)
    lags = []
    for frames in range(8, 40, 4):
        scenes = [cv2.warpAffine(
            texture, np.float32([[1, 0, speed * frame], [0, 1, 0]]), SIZE[::-1],
            flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE) for frame in range(frames)]
        lags.append([((scenes[-1] - image) * slope).sum() / (slope**2).sum()
                     for image in images_of(follow(scenes, 2.0))])
    assert abs(np.mean(lags)) < 0.08
    assert np.max(np.abs(lags)) < 0.2


@pytest.mark.parametrize('right', [1, 2, 3])
@pytest.mark.parametrize('contrast, noise', [(30, 0.0), (8, 0.0), (10, 1.5)])
def test_texture_as_sharp_as_a_pixel_that_pans_is_no_noise(right, contrast, noise):
    texture = 120 + contrast * np.random.default_rng(6).normal(0, 1, (SIZE[0], SIZE[1] + 20))
    scenes = [texture[:, right * frame:right * frame + SIZE[1]] for frame in range(6)]
    averaging = follow(scenes, noise)
    assert averaging.noise < noise + 0.5
    for image in images_of(averaging):
        assert (image - scenes[-1])[:, :128].std() < noise + 0.5


@settings(max_examples=20)
@given(st.integers(-20, 20), st.integers(-30, 30), st.sampled_from([0, 6]))
@example(0, 0, 6)
def test_the_shift_of_a_picture_is_found(down, right, noise):
    wide, size = scene(1, (344, 536)), (300, 470)
    before, now = (image.astype(np.uint16) << 8 for image in noisy(
        [wide[20 - y:20 - y + size[0], 30 - x:30 - x + size[1]] for y, x in (
            (0, 0), (down, right))], noise, np.random.default_rng(2)))
    assert PictureShift(*size).between(before, padded(now)) == (down, right)


# ---- what moves with it ----


@settings(max_examples=60)
@given(SHAPES, SHIFTS, st.integers(0, 99))
def test_maps_and_ages_move_but_for_the_tiles_that_stayed(shape, shift, seed):
    source, tiles = random_map(shape, 200, seed), tiles_of(shape)
    choices = random_map(tiles, 3, seed + 1).astype(np.int8) - np.int8(1)
    moved = np.full_like(source, 7)
    for first, last in ((0, 1), (1, tiles[0])):
        move_map(source, choices, *shift, 255, moved, first, last)
    origins = origins_of_tiles(abs(choices), *shift, shape)
    np.testing.assert_array_equal(moved, np.where(origins < 0, 255, source.flat[origins]))
    ages = random_map(tiles, 9, seed).astype(np.float32)
    moved = np.full_like(ages, 99)
    move_ages(ages, *shift, moved)
    np.testing.assert_allclose(moved, twins.moved_ages(ages, *shift), atol=1e-5)


@settings(max_examples=100)
@given(st.integers(2, 65), st.integers(2, 65), st.integers(1, 9), st.integers(0, 3),
       st.booleans(), st.sampled_from([1, 3]), st.integers(0, 5), st.integers(0, 999))
def test_the_prior_is_where_labels_are_trusted_and_flat_and_counts_more_with_the_age_of_the_tile(
        rows, columns, spread, distance, wide, most, searched, seed):
    """Trusted is what was consistent and agrees with the half map; not beside what changed."""
    offset, dtype = (300, np.uint16) if wide else (0, np.uint8)
    shape, cells = (rows, columns), np.s_[:rows // 2 * 2:2, :columns // 2 * 2:2]
    labels = random_map(shape, spread, seed, dtype) + dtype(offset)
    validity = random_map(shape, 3, seed + 4)
    half = random_map((rows // 2, columns // 2), -(-spread // 2), seed + 1, dtype) + dtype(
        offset // 2)
    smooth, tiles = random_map(half.shape, 2, seed + 2), tiles_of(shape)
    choices = np.minimum(random_map(tiles, 12, seed), 2).astype(np.int8) - np.int8(1)
    ages = random_map(tiles, 60, seed + 3).astype(np.float32) / 6
    half_labels, trusted = np.full(half.shape, 99, dtype), np.full(half.shape, 9, np.uint8)
    strengths, weights = np.full(tiles, 9, np.uint8), np.full(shape, 9, np.uint8)
    for first, last in ((0, 1), (1, len(half))):
        trusted_cells(labels, validity, half, distance, half_labels, trusted, first, last)
    seen = np.full(tiles, 9, np.int8)
    tile_strengths(choices, ages, searched, most, seen, strengths)
    choices = np.where(ages > searched, choices, -1)
    np.testing.assert_array_equal(seen, choices)
    for first, last in ((0, 1), (1, tiles[0])):
        previous_prior(trusted, smooth, strengths, weights, first, last)
    np.testing.assert_array_equal(half_labels, labels[cells])
    np.testing.assert_array_equal(trusted, (validity[cells] == CONSISTENT) & (
        abs(labels[cells].astype(int) - 2 * half.astype(int)) <= distance))
    np.testing.assert_array_equal(strengths, twins.strengths(choices, ages, most))
    strength = strengths.repeat(TILE, 0).repeat(TILE, 1)[:rows, :columns // 2 * 2]
    expected = doubled(trusted & smooth, shape)[:, :columns // 2 * 2] * strength
    np.testing.assert_array_equal(weights, np.pad(expected, ((0, 0), (0, columns % 2)), 'edge'))
