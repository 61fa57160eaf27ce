# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Eq. 3 and Eq. 4."""
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.genetic.literal_reading import fill_row_fitness
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_fitness import FRAME
from fuzzy_stereo_ros.matching.paper.fitness import (
    gradient_by_index, gradient_norm, inside, LiteralFitness)
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference

SHAPES = [(7, 11), (1, 9), (9, 1)]
# Pairs of disparities and min_disparity; in the last four no match lies inside the image.
RANGES = [(4, 0), (5, -3), (6, 2), (30, 0), (3, 40), (3, -40), (3, 12), (14, -27)]


def scene(shape, disparities, min_disparity, seed=0):
    """Return a pair, a chromosome and Eq. 2 in 255ths."""
    generator = np.random.default_rng(seed)
    left, right = generator.integers(0, 256, (2, *shape)).astype(np.uint8)
    chromosome = generator.integers(0, disparities, shape).astype(np.uint16)
    volume = reference.possibility_volume(left, right, disparities, min_disparity, 54.0)
    return left, right, chromosome, volume


def measure(left, right, disparities, min_disparity, neighbourhood):
    config = MatcherConfig.from_profile(
        'paper', disparities=disparities, min_disparity=min_disparity,
        neighbourhood=neighbourhood, reading='literal')
    found = LiteralFitness(config, *left.shape[:2])
    found.set_pair(ThreadPool(1), left, right)
    return found


def rows_of(measured, chromosome, first=0, last=None):
    rows, columns = chromosome.shape
    framed = np.zeros((rows + 2, columns + FRAME), np.uint16)
    inside(framed)[:] = chromosome
    found = np.full(rows, -1, np.int64)
    total = measured.evaluate(framed, np.zeros(framed.shape, np.uint8), found, first,
                              rows if last is None else last)
    assert total == found.sum()
    return found


@pytest.mark.parametrize('shape', [(5, 7), (1, 6), (6, 1), (1, 1), (2, 2)])
def test_the_gradient_norm_is_that_of_the_twin(shape):
    grey = np.random.default_rng(3).integers(0, 256, shape).astype(np.uint8)
    norm = np.zeros(shape, np.uint16)
    gradient_norm(grey, norm)
    np.testing.assert_array_equal(norm, reference.sobel_norm(grey))


def test_the_gradient_norm_of_the_strongest_corner_fits():
    grey = np.zeros((3, 3), np.uint8)
    grey[1:, 1:] = grey[0, 2] = grey[2, 0] = 255
    norm = np.zeros((3, 3), np.uint16)
    gradient_norm(grey, norm)
    assert norm[1, 1] == round(255 * np.hypot(3, 3))


@pytest.mark.parametrize('disparities, min_disparity', RANGES)
def test_the_gradient_of_each_match_is_found_and_is_0_outside(disparities, min_disparity):
    norm = np.arange(1, 15, dtype=np.uint16).reshape(2, 7)
    by_index = np.full((2, 7 + disparities - 1), 99, np.uint16)
    gradient_by_index(norm, min_disparity, by_index)
    for row, column, index in np.ndindex(2, 7, disparities):
        seen = reference.target_column(column, index, min_disparity, 7, 'left')
        expected = 0 if seen is None else norm[row, seen]
        assert by_index[row, column - index + disparities - 1] == expected


@pytest.mark.parametrize('neighbourhood', [1, 3, 5, 31])
@pytest.mark.parametrize('disparities, min_disparity', RANGES)
@pytest.mark.parametrize('shape', SHAPES)
def test_the_fitness_of_each_row_is_that_of_the_twin(
        shape, disparities, min_disparity, neighbourhood):
    left, right, chromosome, volume = scene(shape, disparities, min_disparity)
    found = rows_of(measure(left, right, disparities, min_disparity, neighbourhood), chromosome)
    whole = np.rint(255 * volume).astype(np.int64)
    assert found.tolist() == reference.row_fitness(
        whole, chromosome, reference.sobel_norm(left), reference.sobel_norm(right),
        min_disparity, neighbourhood)


def test_whole_numbers_cost_less_than_a_255th_of_eq_3():
    left, right, chromosome, volume = scene((9, 13), 5, 0)
    found = rows_of(measure(left, right, 5, 0, 5), chromosome).sum() / LiteralFitness.unit
    exact = reference.fitness(volume, chromosome, reference.sobel_norm(left),
                              reference.sobel_norm(right), 0, 5)
    assert found == pytest.approx(exact, rel=1 / 255)


@pytest.mark.parametrize('min_disparity', [0, -2, 3])
def test_the_right_reference_is_the_left_one_of_the_mirrored_and_exchanged_pair(min_disparity):
    """The paper pairs (r, c) of the right image with (r, c + d) of the left."""
    left, right, chromosome, _ = scene((6, 12), 5, min_disparity)
    measured = measure(np.ascontiguousarray(right[:, ::-1]),
                       np.ascontiguousarray(left[:, ::-1]), 5, min_disparity, 3)
    found = rows_of(measured, np.ascontiguousarray(chromosome[:, ::-1]))
    volume = reference.possibility_volume(left, right, 5, min_disparity, 54.0, 'right')
    assert found.tolist() == reference.row_fitness(
        np.rint(255 * volume).astype(np.int64), chromosome, reference.sobel_norm(left),
        reference.sobel_norm(right), min_disparity, 3, 'right')


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 12), st.integers(1, 9), st.sampled_from([1, 3, 5, 9]), st.data())
def test_rows_that_n_reaches_from_a_range_are_as_in_the_whole_and_others_stay(
        rows, columns, neighbourhood, data):
    first = data.draw(st.integers(0, rows))
    last = data.draw(st.integers(first, rows))
    left, right, chromosome, _ = scene((rows, columns), 3, 0)
    measured = measure(left, right, 3, 0, neighbourhood)
    part, whole = rows_of(measured, chromosome, first, last), rows_of(measured, chromosome)
    first, last = max(first - neighbourhood // 2, 0), last + neighbourhood // 2
    np.testing.assert_array_equal(part[first:last], whole[first:last])
    assert np.all(part[:first] == -1)
    assert np.all(part[last:] == -1)


def test_uniform_images_have_no_fitness_at_all():
    grey = np.full((5, 6), 90, np.uint8)
    assert not rows_of(measure(grey, grey, 3, 0, 3), np.zeros((5, 6), np.uint16)).any()


def test_the_largest_sums_do_not_overflow():
    columns, side = 400, 31
    chosen = np.full((side, columns), 255, np.uint8)
    gradient = np.full((side, columns), 1443, np.uint16)
    found = np.zeros(side, np.int64)
    fill_row_fitness(chosen, np.zeros((side, columns), np.uint16), gradient, gradient, side,
                     np.zeros(columns + side - 1, np.int32), np.zeros(columns, np.int32),
                     0, side, found)
    in_full = 255 * side * side * 1443**2
    missing = 2 * sum(255 * side * 1443**2 * short for short in range(1, side // 2 + 1))
    assert found[side // 2] == in_full * columns - missing
