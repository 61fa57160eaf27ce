# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The label of least summed cost, its sub-pixel offset and margin, and the target's choice."""
from fuzzy_stereo_ros.matching.kernels.scanlines.winner_takes_all import (
    best_label, choose_of_target, fit_offsets, least_elsewhere, MIDDLE, NEAR, STEPS)
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
@given(sums_of_a_pixel(), st.integers(0, 40))
def test_the_winner_is_the_first_of_the_least_and_its_rival_is_not_beside_it(sums, at):
    blocks, around = sums.size // LANES, np.zeros(at + sums.size, np.uint8)
    around[at:] = sums
    best, least = best_label(around, at, blocks)
    assert (best, least, least_elsewhere(around, at, blocks, best)) == twins.winner(sums)


@pytest.mark.parametrize('best', [0, 1, 30, 31, 32, 33, 63, 64, 95])
def test_the_rival_next_to_a_block_s_edge_is_not_counted(best):
    sums = np.full(96, 50, np.uint8)
    sums[best] = 3
    sums[max(best - 1, 0):best] = sums[best + 1:best + 2] = 9
    assert least_elsewhere(sums, 0, 3, best) == 50
    far = best - 2 if best >= 2 else best + 2
    sums[far] = 20
    assert least_elsewhere(sums, 0, 3, best) == 20


@pytest.mark.parametrize('lanes', [LANES, 2 * LANES])
@pytest.mark.parametrize('best', range(2 * LANES))
def test_the_lanes_beside_the_best_are_marked_as_near(best, lanes):
    best %= lanes
    marked = NEAR[MIDDLE - best:MIDDLE - best + lanes]
    assert np.flatnonzero(marked).tolist() == [
        lane for lane in (best - 1, best, best + 1) if 0 <= lane < lanes]
    assert set(marked) == {0, 255}


def offsets_of(below, least, above):
    """Return what `fit_offsets` writes for a row; nothing else may change."""
    width = len(least)
    rows = [np.array(row, np.uint8) for row in (below, least, above)]
    offsets = np.full(width + 8, 99, np.int8)
    fit_offsets(*(row.ctypes.data for row in rows), width, offsets.ctypes.data + 4)
    assert np.all(offsets[:4] == 99)
    assert np.all(offsets[width + 4:] == 99)
    return offsets[4:width + 4].tolist()


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(costs | few_values, costs | few_values, costs | few_values), min_size=1))
def test_the_offset_is_the_crossing_of_two_lines_of_equal_slope_rounded(triples):
    """The sum in the middle is the least, as that of the chosen label is."""
    triples = [(below, min(below, here, above), above) for below, here, above in triples]
    below, least, above = zip(*triples)
    offsets = offsets_of(below, least, above)
    assert offsets == [twins.equiangular(*triple) for triple in triples]
    assert offsets_of(above, least, below) == [-offset for offset in offsets]


def test_every_offset_of_two_sums_above_nothing_is_that_of_the_twin():
    below, above = (values.reshape(-1) for values in np.indices((256, 256)))
    expected = [twins.equiangular(int(low), 0, int(high)) for low, high in zip(below, above)]
    assert offsets_of(below, np.zeros_like(below), above) == expected


@settings(max_examples=200, deadline=None)
@given(st.integers(-STEPS // 2, STEPS // 2), st.integers(1, 6))
def test_the_offset_of_exact_lines_is_exact(steps, slope):
    """The cost falls and rises by STEPS * slope a pixel around the true minimum."""
    below, here, above = (slope * abs(STEPS * label - steps) for label in (-1, 0, 1))
    assert offsets_of([below], [here], [above]) == [steps]


@settings(max_examples=300, deadline=None)
@given(st.sampled_from([1, 2]), st.integers(1, 60), st.integers(1, 700), st.randoms(),
       st.sampled_from([0, 2, 20, 300]))
def test_the_target_takes_the_label_of_the_cheapest_and_of_equals_the_nearest(
        label_bytes, columns, limit, random, extra):
    limit = min(limit, 256**label_bytes, columns + 5 if random.random() < 0.7 else limit)
    labels = np.array([random.randrange(limit) for _ in range(columns)],
                      np.uint8 if label_bytes == 1 else np.uint16)
    sums = np.array([random.choice([3, 4, 200, 255]) for _ in range(columns)], np.uint8)
    check_target(labels, sums, extra)


def check_target(labels, sums, extra=0):
    """Check a row against the twin; nothing else may change."""
    columns, size = labels.size, extra + labels.size
    target, rivals = np.full(size + 6, 99, np.uint8), np.full(size + 6, 999, np.uint16)
    choose_of_target(labels.ctypes.data, labels.itemsize, sums.ctypes.data, columns,
                     rivals.ctypes.data + 2 * 3, target.ctypes.data + 3, size)
    expected = twins.chosen_by_target(labels[None], sums[None], extra)[0]
    assert target.tolist() == [99] * 3 + expected.tolist() + [99] * 3
    assert np.all(rivals[:3] == 999)
    assert np.all(rivals[-3:] == 999)


def test_pixels_farther_than_256_labels_apart_compete_for_the_target_too():
    labels = np.zeros(600, np.uint16)
    labels[[10, 267, 523, 599]] = 5, 262, 518, 599 - 5
    for dearer in ([5, 5, 5, 5], [4, 5, 5, 5], [5, 5, 4, 5], [255, 255, 255, 255]):
        sums = np.full(600, 7, np.uint8)
        sums[[10, 267, 523, 599]] = dearer
        check_target(labels, sums)
