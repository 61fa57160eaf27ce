# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The label of least summed cost, its sub-pixel offset and margin, and the target's choice."""
from fuzzy_stereo_ros.matching.kernels.choice import (
    best_label, equiangular, least_elsewhere, offer_to_target, STEPS)
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
import reference_census as twins

costs = st.integers(0, 255)
few_values = st.sampled_from([0, 1, 7, 254, 255])


@st.composite
def sums_of_a_pixel(draw):
    """Return uint8 sums of one to four blocks of labels, often with equals."""
    size = LANES * draw(st.integers(1, 4))
    return draw(arrays.arrays(np.uint8, size, elements=draw(st.sampled_from([costs, few_values])),
                              fill=few_values))


@settings(max_examples=200, deadline=None)
@given(sums_of_a_pixel())
def test_the_winner_is_the_first_of_the_least_and_its_rival_is_not_beside_it(sums):
    blocks = sums.size // LANES
    best, least = best_label(sums, blocks)
    assert (best, least, least_elsewhere(sums, blocks, best)) == twins.winner(sums)


@pytest.mark.parametrize('best', [0, 1, 30, 31, 32, 33, 63, 64, 95])
def test_the_rival_next_to_a_block_s_edge_is_not_counted(best):
    sums = np.full(96, 50, np.uint8)
    sums[best] = 3
    sums[max(best - 1, 0):best] = sums[best + 1:best + 2] = 9
    assert least_elsewhere(sums, 3, best) == 50
    far = best - 2 if best >= 2 else best + 2
    sums[far] = 20
    assert least_elsewhere(sums, 3, best) == 20


@settings(max_examples=300, deadline=None)
@given(costs, costs, costs)
def test_the_offset_is_the_crossing_of_two_lines_of_equal_slope_rounded(below, here, above):
    offset = equiangular(below, here, above)
    assert offset == twins.equiangular(below, here, above)
    assert equiangular(above, here, below) == -offset


@settings(max_examples=200, deadline=None)
@given(st.integers(-STEPS // 2, STEPS // 2), st.integers(1, 6))
def test_the_offset_of_exact_lines_is_exact(steps, slope):
    """The cost falls and rises by STEPS * slope a pixel around the true minimum."""
    below, here, above = (slope * abs(STEPS * label - steps) for label in (-1, 0, 1))
    assert equiangular(below, here, above) == steps


@settings(max_examples=100, deadline=None)
@given(st.integers(1, 2), st.integers(1, 30), st.integers(0, 300), st.randoms())
def test_the_target_takes_the_cheapest_label_and_of_equals_that_of_the_last_pixel(
        blocks, columns, low, random):
    labels = LANES * blocks
    sums = np.array([[random.choice([3, 4, 200, 254]) for _ in range(labels)]
                     for _ in range(columns)], np.uint8)
    size = columns + low + labels + 64
    best_sums, best_labels = np.full(size, 255, np.uint8), np.zeros(size, np.uint8)
    for column in range(columns):
        offer_to_target(sums[column], blocks, low, columns - 1 - column + low, best_sums,
                        best_labels)
    wide = np.full((1, columns, low + labels), 255, np.int64)
    wide[0, :, low:] = sums
    whole = np.array([[low]]), np.array([[low + labels]]), max(columns, 1)
    expected = twins.chosen_by_target(wide, *whole)[0]
    for pointed in np.flatnonzero(expected >= 0):
        assert best_labels[columns - 1 - pointed] == expected[pointed] % 256
