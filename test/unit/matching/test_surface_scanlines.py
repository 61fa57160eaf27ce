# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scanline optima from eight directions, along a parent's surface."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import cut_bands, ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.scanlines import eight_directions
from fuzzy_stereo_ros.matching.quality.scanlines import OVERLAP, Smoothness, SurfaceScanlines
import numpy as np
import pytest
import reference_quality as twins

SHAPES = [(1, 5), (5, 1), (4, 7), (9, 13)]
SMOOTHNESS = Smoothness(jump=4.0, small=0.1, at_edge=0.1, edge=20.0)


@pytest.mark.parametrize('steepest', [0, 2])
@pytest.mark.parametrize('upwards', [False, True])
@pytest.mark.parametrize('shape', SHAPES)
def test_paths_follow_the_parent_as_the_twin_does(shape, upwards, steepest):
    check_paths(shape, 32, upwards, steepest)


@pytest.mark.parametrize('upwards', [False, True])
@pytest.mark.parametrize('labels', [64, 256, 288, 512])
def test_paths_of_many_labels_are_those_of_the_twin(labels, upwards):
    check_paths((3, 4), labels, upwards, 5)


def check_paths(shape, labels, upwards, steepest):
    rows, columns = shape
    costs = random_map((*shape, labels), FULL + 1, dtype=np.uint16)
    parent, steps = random_map(shape, 6, 1, np.int16), random_map((4, *shape), 256, 2)
    small, jump = (np.linspace(high, high / 8, 256).astype(np.uint16) for high in (90, 700))
    sums = random_map(costs.shape, 9, 3, np.uint16)
    before = sums.astype(int) if upwards else 0
    paths = np.zeros((2, 4, columns, labels + 2 * eight_directions.PAD), np.uint16)
    eight_directions.sum_paths(costs, parent, steepest, steps, small, jump, sums, upwards,
                               rows - 1 if upwards else 0, 0, rows, paths,
                               np.zeros((2, 4, columns), np.uint16))
    np.testing.assert_array_equal(sums, before + twins.summed_paths(
        costs, parent, steepest, steps, small, jump, upwards))


@pytest.mark.parametrize('disparities', [1, 2, 20, 33, 64, 255, 256, 257, 512])
@pytest.mark.parametrize('shape', SHAPES)
def test_labels_are_chosen_from_both_sides_as_by_the_twin(shape, disparities):
    rows, columns = shape
    sums = random_map((*shape, -(-disparities // 32) * 32), 90, dtype=np.uint16)
    labels, target = (np.zeros(shape, np.int16) for _ in range(2))
    offsets, margins = np.zeros(shape, np.float32), np.zeros(shape, np.uint16)
    expected = twins.chosen_labels(sums.astype(int), disparities)
    eight_directions.choose_labels(
        sums, disparities, np.zeros((2, columns + sums.shape[2]), np.uint16),
        np.arange(sums.shape[2], dtype=np.uint16), labels, offsets, margins, target, 0, rows)
    for found, wanted in zip((labels, offsets, margins, target), expected):
        np.testing.assert_allclose(found, wanted, atol=1e-6)


def guessed(costs, parent, threads=1, here=slice(None)):
    guess = SurfaceScanlines(costs.shape)
    guess.look(random_map((*costs.shape[:2], 3), 30, 7))
    guess.search(ThreadPool(threads), costs, 24, SMOOTHNESS, parent, 2, here)
    return guess


def test_two_threads_give_the_bits_of_one():
    costs = random_map((150, 40, 32), FULL, dtype=np.uint16)
    parent = np.zeros((150, 40), np.int16)
    one, two = guessed(costs, parent), guessed(costs, parent, threads=2)
    for name in ('labels', 'offsets', 'margins', 'target'):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.parametrize('here', [slice(0, 150), slice(20, 60), slice(70, 149), slice(74, 76)])
def test_some_rows_are_chosen_as_among_all_and_the_others_stay(here):
    costs = random_map((150, 20, 32), FULL, dtype=np.uint16)
    parent = np.zeros((150, 20), np.int16)
    every, some = (guessed(costs, parent, here=rows) for rows in (slice(None), here))
    for name in ('labels', 'offsets', 'margins', 'target'):
        found, wanted = getattr(some, name), getattr(every, name).copy()
        wanted[:here.start] = wanted[here.stop:] = 0
        np.testing.assert_array_equal(found, wanted)


def test_the_overlap_of_bands_reaches_beyond_the_memory_of_a_path():
    assert len(cut_bands(150)) == 2 and OVERLAP >= 32


def test_a_slanted_surface_that_the_parent_knows_costs_no_steps():
    """On costs that say nothing but at a few pixels, the labels between follow the parent."""
    slope = np.repeat(np.arange(40, dtype=np.int16)[np.newaxis] // 2, 30, axis=0)
    costs = np.full((30, 40, 32), 200, np.uint16)
    costs[:, ::8] = FULL
    np.put_along_axis(costs[:, ::8], slope[:, ::8, np.newaxis].astype(int), 0, axis=2)
    np.testing.assert_array_equal(guessed(costs, slope).labels, slope)
