# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Eq. 1, Eq. 2, the possibility volume and the levels they are defined on."""
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import FRAME
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_classes import (
    average_over_uniform, fill_class_possibility, fill_largest_elsewhere, fill_planes,
    most_possible, REACH)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.paper.fitness import inside
from fuzzy_stereo_ros.matching.paper.possibility import (
    BENT, class_levels, GRADIENT_CENTRES, GRADIENT_SIGMA, gradient_table, LiteralPossibility,
    nearness, RISE_REACH, shared_membership, slopes_of, uniform_membership)
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference


@settings(max_examples=40)
@given(st.integers(1, 9), st.integers(1, 12),
       st.sampled_from([(1, 40), (30, 0), (255, -130), (256, -2048), (257, 2048), (512, -260)])
       | st.tuples(st.integers(1, 20), st.integers(-20, 20)), st.integers(0, 99))
def test_the_planes_are_those_of_the_twin(rows, columns, searched, seed):
    disparities, min_disparity = searched
    left, right = np.random.default_rng(seed).integers(0, 256, (2, rows, columns)).astype(np.uint8)
    found = LiteralPossibility(MatcherConfig(
        disparities=disparities, min_disparity=min_disparity), rows, columns)
    for images in ((right, left), (left, right)):      # nothing is left of the pair before
        found.set_pair(*images)
    exact = reference.possibility_volume(left, right, disparities, min_disparity, 54.0)
    np.testing.assert_array_equal(np.moveaxis(inside(found.planes), 0, 2),
                                  np.rint(255 * exact).astype(np.uint8))


@given(st.floats(-6, 6), st.floats(-6, 6))
def test_shared_membership_is_the_share_of_minima_in_maxima(first, second):
    both = np.array([[reference.membership(level, centre, GRADIENT_SIGMA)
                      for centre in GRADIENT_CENTRES] for level in (first, second)])
    found = shared_membership(first, second, GRADIENT_SIGMA, GRADIENT_CENTRES)
    assert found == pytest.approx(both.min(axis=0).sum() / both.max(axis=0).sum(), rel=1e-9)


def test_the_table_of_gradients_is_symmetric_and_full_where_levels_are_equal():
    table = gradient_table()
    np.testing.assert_array_equal(table, table.T)
    assert (table.diagonal() == 255).all()      # also between two centres, unlike Eq. 2
    assert table[160, 96] < table[160, 128] < table[160, 152] < 255


def test_levels_are_grey_and_compressed_gradients():
    ramp = np.tile(np.arange(0, 200, 4, dtype=np.uint16), (6, 1))
    grey, across, down = class_levels(ramp << 8)
    np.testing.assert_array_equal(grey, ramp)
    assert set(across[:, 1:-1].ravel()) == {round(128 + 8 * np.log(1 + 8))}
    assert set(down.ravel()) == {128}


@settings(max_examples=40)
@given(st.integers(1, 5), st.integers(1, 40), st.integers(1, 9),
       st.integers(-9, 9) | st.just(-40), st.integers(0, 999))
def test_possibility_by_classes_its_planes_and_their_best_are_those_of_the_twin(
        rows, columns, disparities, min_disparity, seed):
    generator = np.random.default_rng(seed)
    tables = generator.integers(0, 256, (3, 256, 256)).astype(np.uint8)
    left, right = generator.integers(0, 256, (2, 3, rows, columns)).astype(np.uint8)
    found = np.full((rows, columns, disparities + 2), 99, np.uint8)
    fill_class_possibility(tables, (left, right), min_disparity, disparities, 1, rows, found)
    assert np.all(found[0] == 99) and np.all(found[:, :, disparities:] == 99)
    seen = np.arange(columns)[:, None] - min_disparity - np.arange(disparities)
    there, seen = (seen >= 0) & (seen < columns), np.clip(seen, 0, columns - 1)
    expected = 255 * np.prod([tables[part][left[part][:, :, None], right[part][:, seen]] / 255
                              for part in range(3)], axis=0)
    apart = abs(found[1:, :, :disparities] - np.where(there, expected, 40)[1:])
    assert apart.max(initial=0) <= 0.5001

    volume = generator.integers(0, 4, (rows, columns, disparities)).astype(np.uint8)
    planes = np.zeros((disparities, rows + 2, columns + FRAME), np.uint8)
    fill_planes(volume, (255 - np.arange(256)).astype(np.uint8), 0, rows, planes)
    np.testing.assert_array_equal(inside(planes), 255 - volume.transpose(2, 0, 1))
    best, elsewhere = (np.full(planes.shape[1:], 9, kind) for kind in (np.uint16, np.uint8))
    most_possible(planes, np.zeros(planes.shape[2], np.uint8), best)
    np.testing.assert_array_equal(inside(best), volume.argmin(axis=2))
    fill_largest_elsewhere(planes, best, 1, 0, rows, elsewhere)
    apart = abs(np.arange(disparities)[:, None, None] - inside(best).astype(int))
    np.testing.assert_array_equal(
        inside(elsewhere), np.where(apart > 1, inside(planes), 0).max(axis=0))


@settings(max_examples=40)
@given(st.integers(1, 9), st.integers(1, 14), st.integers(1, 70), st.booleans(),
       st.sampled_from([0.0, REACH / 3]), st.integers(0, 99))
def test_averages_are_over_uniform_cells_of_a_sloping_line_in_parts_of_256(
        rows, columns, disparities, along_columns, steepest, seed):
    generator, shape = np.random.default_rng(seed), (rows, columns)
    volume = generator.integers(0, 256, (*shape, disparities)).astype(np.uint8)
    colours = generator.integers(90, 120, (3, *shape)).astype(np.uint8)
    slopes = generator.uniform(-steepest, steepest, shape).astype(np.float32)
    framed = np.pad(colours, ((0, 0), (1, 1), (1, FRAME - 1)))
    weights = np.outer(nearness(7), np.append(uniform_membership(), np.float32(0)))
    depth = max(disparities, LANES) + REACH
    memory = np.full((2, REACH + rows * columns * depth), 40, np.uint8)
    cells, found = (one[REACH:].reshape(*shape, depth) for one in memory)
    cells[..., :disparities] = volume
    average_over_uniform(
        cells, framed, weights, slopes, disparities, along_columns, 0, rows, found)
    assert (found[..., disparities:] == 40).all() and (memory[1, :REACH] == 40).all()
    around = np.pad(volume, ((0, 0), (0, 0), (REACH, REACH)), constant_values=40).astype(int)
    for row, column in np.ndindex(shape):
        steps = [step for step in range(-3, 4)
                 if 0 <= (row if along_columns else column) + step < shape[not along_columns]]
        others = [(row + step, column) if along_columns else (row, column + step)
                  for step in steps]
        aparts = [np.sum((colours[:, row, column].astype(int) - colours[:, y, x])**2) // 4
                  for y, x in others]
        degrees = [weights[abs(step), min(apart, weights.shape[1] - 1)]
                   for step, apart in zip(steps, aparts)]
        rises = [REACH + int(np.floor(slopes[row, column] * step + 0.5)) for step in steps]
        scale = np.float32(256) / np.sum(degrees, dtype=np.float32)
        parts = np.floor(np.array(degrees) * scale + np.float32(0.5)).astype(int)
        parts[steps.index(0)] += 256 - parts.sum()
        total = sum(part * around[other][rise:rise + disparities]
                    for part, other, rise in zip(parts, others, rises))
        np.testing.assert_array_equal(found[row, column, :disparities], (total + 128) // 256)
        assert np.abs(parts - 256 * np.array(degrees) / np.sum(degrees)).max() < 4


@given(across=st.floats(-0.6, 0.6), down=st.floats(-0.6, 0.6), seed=st.integers(0, 9))
def test_the_slopes_of_a_plane_are_its_own_where_cells_are_unknown_too(across, down, seed):
    rows, columns = np.mgrid[:30, :40]
    plane = (40 + across * columns + down * rows).astype(np.float32)
    plane[np.random.default_rng(seed).random(plane.shape) < 0.2] = np.nan
    found = slopes_of(plane, 25)
    assert found.dtype == np.float32 and found.flags.c_contiguous
    np.testing.assert_allclose(found[0], across, atol=1e-5)
    np.testing.assert_allclose(found[1], down, atol=1e-5)


@pytest.mark.parametrize('shape', [(1, 1), (5, 60), (60, 5), (13, 13)])
def test_a_step_between_surfaces_has_no_slope(shape):
    for axis, step in np.ndindex(2, 2):
        walls = np.zeros(shape, np.float32)
        np.moveaxis(walls, axis, 0)[shape[axis] // 2:] = BENT + step
        assert slopes_of(walls, 25).any() == (step == 0 and shape[axis] > 2 * RISE_REACH)
