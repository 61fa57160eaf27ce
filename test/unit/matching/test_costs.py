# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What candidates cost: census and gradient, priors, labels that do not exist, box sums."""
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.kernels.possibility.costs import (
    box_row, cost_rows, match_cost, raw_row)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.possibility import HALF_SIZE
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type, prior_of, Scanlines
from hypothesis import given, settings, strategies as st
from numba import njit
import numpy as np
import pytest
import reference_census as twins

DISPARITIES = [1, 2, 31, 32, 33, 64, 255, 256, 257, 512]
RULES = (2, 4), (0, 4)      # dead zone and cut of the weights 1 and 2


def no_prior(shape, disparities):
    return prior_of(np.zeros(shape, gene_type(disparities)), np.zeros(shape, np.uint8),
                    disparities)


def some_prior(shape, disparities, seed):
    return prior_of(random_map(shape, disparities, seed, gene_type(disparities)),
                    random_map(shape, len(RULES) + 1, seed + 1), disparities, *RULES)


def costs_of_rows(possibility, priors, row, count, begin, end, low, blocks):
    """Return what `cost_rows` writes: (count, end - begin, 32 * blocks), and nothing else."""
    width, pixel, slack = end - begin, LANES * blocks, 5
    search = Scanlines(possibility, 16).search_by(*priors)
    costs = np.full((count + 2, width * pixel + slack), 99, np.uint8)
    codes, priors = (np.full(planes * count * width + 3, 7, np.uint32) for planes in (4, 2))
    cost_rows(search, row, count, begin, end, low, blocks, costs.ctypes.data, costs.shape[1],
              costs.shape[1], codes.ctypes.data, priors.ctypes.data)
    assert np.all(costs[[0, -1]] == 99)
    assert np.all(costs[:, width * pixel:] == 99)
    assert codes[-3:].tolist() == priors[-3:].tolist() == [7, 7, 7]
    return costs[1:-1, :width * pixel].reshape(count, width, pixel)


def costs_of_row(possibility, priors, row, begin, end, low, blocks):
    return costs_of_rows(possibility, priors, row, 1, begin, end, low, blocks)[0]


@pytest.mark.parametrize('disparities', DISPARITIES)
def test_the_costs_of_every_label_are_those_of_the_twin(disparities):
    left, right = small_pair(3, min(disparities, 70) + 5, channels=3)
    shape, blocks = left.shape[:2], -(-disparities // LANES)
    possibility = seen(left, right, disparities)
    priors = [no_prior(shape, disparities)] * 2
    expected = twin_costs(left, right, disparities)
    for row in range(shape[0]):
        found = costs_of_row(possibility, priors, row, 0, shape[1], 0, blocks)
        np.testing.assert_array_equal(found[:, :disparities], expected[row])
        assert np.all(found[:, disparities:] == 255)


@settings(max_examples=60, deadline=None)
@given(st.integers(33, 300), st.data())
def test_any_window_of_any_columns_costs_what_the_whole_does(disparities, data):
    blocks = data.draw(st.integers(1, -(-disparities // LANES)))
    low = data.draw(st.integers(0, max(disparities - LANES * blocks, 0)))
    begin = data.draw(st.integers(0, 19))
    end = data.draw(st.integers(begin, 20))
    left, right = small_pair(2, 20)
    possibility = seen(left, right, disparities)
    priors = [some_prior((2, 20), disparities, seed) for seed in (1, 7)]
    found = costs_of_row(possibility, priors, 1, begin, end, low, blocks)
    labels = LANES * -(-disparities // LANES)
    expected = twin_costs(left, right, labels)[1]
    for prior in priors:
        expected = expected + twins.prior_costs(
            prior.labels[1:], prior.weights[1:], RULES, labels)[0]
    expected[:, disparities:] = 255
    np.testing.assert_array_equal(found, expected[begin:end, low:low + LANES * blocks])


@pytest.mark.parametrize('disparities', [1, 33, 300])
def test_both_priors_are_added_by_weight_and_distance(disparities):
    left, right = small_pair(4, 21)
    possibility = seen(left, right, disparities)
    half, previous = (some_prior((4, 21), disparities, seed) for seed in (3, 5))
    expected = twin_costs(left, right, disparities) + sum(
        twins.prior_costs(prior.labels, prior.weights, RULES, disparities)
        for prior in (half, previous))
    blocks = -(-disparities // LANES)
    for row, count in ((0, 4), (1, 2), (3, 1)):
        found = costs_of_rows(possibility, (half, previous), row, count, 0, 21, 0, blocks)
        np.testing.assert_array_equal(found[..., :disparities], expected[row:row + count])


@njit
def candidate_costs(features, costs):
    """Write what `match_cost` says of all candidates: (R, C, D)."""
    for row, column, label in np.ndindex(costs.shape):
        costs[row, column, label] = match_cost(features, row, column, label)


@pytest.mark.parametrize('min_disparity', [-200, -20, -3, 2])
def test_the_cost_of_one_candidate_is_that_of_its_row(min_disparity):
    left, right = small_pair(5, 40, disparity=6)
    costs = np.zeros((5, 40, 40), np.int64)
    possibility = seen(left, right, 40, min_disparity)
    candidate_costs(possibility.features, costs)
    np.testing.assert_array_equal(costs, twin_costs(left, right, 40, min_disparity))


@pytest.mark.parametrize('shape', [(1, 1), (1, 9), (2, 2), (3, 8), (5, 33)])
@pytest.mark.parametrize('disparities', [1, 31, 32, 33, 65])
def test_box_costs_are_sums_of_3_by_3_pixels_with_the_border_repeated(shape, disparities):
    left, right = small_pair(*shape)
    possibility = seen(left, right, disparities, model=HALF_SIZE)
    (rows, columns), blocks = shape, -(-disparities // LANES)
    size = columns * LANES * blocks
    search = Scanlines(possibility, 16).search_by(*[no_prior(shape, disparities)] * 2)
    raw = np.full((rows, size + 5), 99, np.uint8)
    codes = np.full(4 * columns + 3, 7, np.uint32)
    for row in range(rows):
        raw_row(search, row, blocks, raw.ctypes.data, row * raw.shape[1], codes.ctypes.data)
    assert np.all(raw[:, size:] == 99)
    assert codes[-3:].tolist() == [7, 7, 7]
    raw_expected = twin_costs(left, right, LANES * blocks, model=HALF_SIZE)
    np.testing.assert_array_equal(raw[:, :size].reshape(raw_expected.shape), raw_expected)
    expected = twins.box_costs(raw_expected, HALF_SIZE.box)
    for row in range(rows):
        costs = np.full(size + 14, 99, np.uint8)
        near = raw[max(row - 1, 0)], raw[row], raw[min(row + 1, rows - 1)]
        box_row(search, *(line.ctypes.data for line in near), blocks, costs.ctypes.data, 7)
        found = costs[7:-7].reshape(columns, -1)
        np.testing.assert_array_equal(found[:, :disparities], expected[row, :, :disparities])
        assert np.all(found[:, disparities:] == 255)
        assert np.all(costs[:7] == 99)
        assert np.all(costs[-7:] == 99)
