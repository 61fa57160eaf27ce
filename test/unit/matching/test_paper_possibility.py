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

SHAPES = [(7, 11), (1, 9), (9, 1)]
RANGES = [(4, 0), (5, -3), (6, 2), (30, 0), (3, 40), (3, -40),    # disparities, min_disparity
          (255, -130), (256, -2048), (257, 2048), (512, -260)]


def pair(shape, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (2, *shape)).astype(np.uint8)


@pytest.mark.parametrize('disparities, min_disparity', RANGES)
@pytest.mark.parametrize('shape', SHAPES)
def test_the_planes_are_those_of_the_twin(shape, disparities, min_disparity):
    left, right = pair(shape)
    found = LiteralPossibility(MatcherConfig(
        disparities=disparities, min_disparity=min_disparity), *shape)
    for images in ((right, left), (left, right)):      # nothing is left of the pair before
        found.set_pair(*images)
    exact = reference.possibility_volume(left, right, disparities, min_disparity, 54.0)
    np.testing.assert_array_equal(np.moveaxis(inside(found.planes), 0, 2),
                                  np.rint(255 * exact).astype(np.uint8))


# ---- the uniform reading ----

gradients = st.floats(-6, 6)


@given(gradients, gradients)
def test_shared_membership_is_the_share_of_minima_in_maxima(first, second):
    smaller = larger = 0.0
    for centre in GRADIENT_CENTRES:
        both = [reference.membership(level, centre, GRADIENT_SIGMA) for level in (first, second)]
        smaller, larger = smaller + min(both), larger + max(both)
    found = shared_membership(first, second, GRADIENT_SIGMA, GRADIENT_CENTRES)
    assert found == pytest.approx(smaller / larger, rel=1e-9)


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


@pytest.mark.parametrize('disparities, min_disparity', [(4, 0), (5, -3), (3, 9), (3, -40)])
def test_possibility_by_classes_is_the_product_of_three_tables(disparities, min_disparity):
    generator = np.random.default_rng(4)
    tables = generator.integers(0, 256, (3, 256, 256)).astype(np.uint8)
    left, right = generator.integers(0, 256, (2, 3, 5, 7)).astype(np.uint8)
    found = np.full((5, 7, disparities + 2), 99, np.uint8)
    fill_class_possibility(tables, (left, right), min_disparity, disparities, 1, 5, found)
    assert np.all(found[0] == 99)
    assert np.all(found[:, :, disparities:] == 99)
    for row, column, index in np.ndindex(4, 7, disparities):
        row += 1
        seen = column - min_disparity - index
        expected = 40
        if 0 <= seen < 7:
            expected = np.prod([tables[part, left[part, row, column], right[part, row, seen]] / 255
                                for part in range(3)]) * 255
        assert abs(int(found[row, column, index]) - expected) <= 0.5001


@pytest.mark.parametrize('steepest', [0.0, REACH / 3])
@pytest.mark.parametrize('along_columns', [False, True])
@pytest.mark.parametrize('shape', [(9, 14, 32), (1, 5, 45), (5, 1, 64), (5, 6, 3), (1, 1, 32)])
def test_averages_are_over_uniform_cells_of_a_sloping_line_in_parts_of_256(
        shape, along_columns, steepest):
    generator = np.random.default_rng(5)
    volume = generator.integers(0, 256, shape).astype(np.uint8)
    colours = generator.integers(90, 120, (3, *shape[:2])).astype(np.uint8)
    slopes = generator.uniform(-steepest, steepest, shape[:2]).astype(np.float32)
    framed = np.pad(colours, ((0, 0), (1, 1), (1, FRAME - 1)))
    weights = np.outer(nearness(7), np.append(uniform_membership(), np.float32(0)))
    depth = max(shape[2], LANES) + REACH
    memory = np.full((2, REACH + shape[0] * shape[1] * depth), 40, np.uint8)
    cells, found = (one[REACH:].reshape(*shape[:2], depth) for one in memory)
    cells[..., :shape[2]] = volume
    average_over_uniform(cells, framed, weights, slopes, shape[2], along_columns, 0, shape[0],
                         found)
    assert (found[..., shape[2]:] == 40).all() and (memory[1, :REACH] == 40).all()
    around = np.pad(volume, ((0, 0), (0, 0), (REACH, REACH)), constant_values=40).astype(int)
    for row, column in np.ndindex(shape[:2]):
        others, degrees, rises = [], [], []
        for step in range(-3, 4):
            other = (row + step, column) if along_columns else (row, column + step)
            if 0 <= other[0] < shape[0] and 0 <= other[1] < shape[1]:
                apart = np.sum((colours[:, row, column].astype(int)
                                - colours[:, other[0], other[1]])**2)
                others.append(other)
                degrees.append(weights[abs(step), min(apart // 4, weights.shape[1] - 1)])
                rises.append(REACH + int(np.floor(slopes[row, column] * step + 0.5)))
        scale = np.float32(256) / np.sum(degrees, dtype=np.float32)
        parts = np.floor(np.array(degrees) * scale + np.float32(0.5)).astype(int)
        middle = others.index((row, column))
        parts[middle] += 256 - parts.sum()
        total = sum(part * around[other][rise:rise + shape[2]]
                    for part, other, rise in zip(parts, others, rises))
        np.testing.assert_array_equal(found[row, column, :shape[2]], (total + 128) // 256)
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


@settings(max_examples=40, deadline=None)
@given(rows=st.integers(1, 5), columns=st.integers(1, 40), disparities=st.integers(1, 9),
       seed=st.integers(0, 999))
def test_the_best_match_elsewhere_is_that_of_the_twin(rows, columns, disparities, seed):
    generator = np.random.default_rng(seed)
    planes = np.zeros((disparities, rows + 2, columns + FRAME), np.uint8)
    inside(planes)[:] = generator.integers(0, 256, (disparities, rows, columns))
    genes = np.zeros(planes.shape[1:], np.uint16)
    inside(genes)[:] = generator.integers(0, disparities, (rows, columns))
    found = np.full(genes.shape, 9, np.uint8)
    fill_largest_elsewhere(planes, genes, 1, 0, rows, found)
    apart = abs(np.arange(disparities)[:, None, None] - inside(genes).astype(int))
    np.testing.assert_array_equal(
        inside(found), np.where(apart > 1, inside(planes), 0).max(axis=0))


def test_planes_are_the_volume_by_a_table_and_their_best_is_its_first_maximum():
    volume = np.random.default_rng(6).integers(0, 4, (5, 7, 6)).astype(np.uint8)
    planes = np.zeros((6, 7, 7 + 34), np.uint8)
    fill_planes(volume, (255 - np.arange(256)).astype(np.uint8), 0, 5, planes)
    np.testing.assert_array_equal(planes[:, 1:-1, 1:8], 255 - volume.transpose(2, 0, 1))
    best = np.full((7, 41), 9, np.uint16)
    most_possible(planes, 0, 5, np.zeros(41, np.uint8), best)
    np.testing.assert_array_equal(best[1:-1, 1:8], volume.argmin(axis=2))
