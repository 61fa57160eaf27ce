# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Crossover by a line, by regions and by a minimum cut, over exchanges made up."""
from contextlib import suppress

from fuzzy_stereo_ros.matching import crossover
from fuzzy_stereo_ros.matching.crossover import Cut, Exchange, LARGEST_CHANGE, PartitionCrossover
from hypothesis import given, settings, strategies as st
import networkx
import numpy as np
import pytest
import reference_crossover as twins


def exchange_of(shape, neighbours, seed, share=1.0, alone=(-10, 31), together=(-20, 1)):
    """Return an Exchange of random cells; alone, together: the range of changes of cost."""
    random = np.random.default_rng([seed, *shape])
    exchange = Exchange(*shape, neighbours)
    cells = np.flatnonzero(random.random(shape[0] * shape[1]) < share)
    exchange.all_cells[:cells.size] = cells
    exchange.set_size(cells.size)
    exchange.alone[:], exchange.pairs[:] = random.integers(*alone, cells.size), 0
    for one, _, side in twins.pairs_of(exchange):
        exchange.pairs[one, side] = random.integers(*together)
    return exchange


@st.composite
def exchanges(draw, together=(-20, 1), most=7):
    """Draw an Exchange of at most so many rows and columns."""
    return exchange_of((draw(st.integers(1, most)), draw(st.integers(1, most))),
                       draw(st.sampled_from([4, 8])), draw(st.integers(0, 10**6)),
                       draw(st.sampled_from([0, 0.2, 0.5, 0.8, 1])),
                       draw(st.sampled_from([(-10, 31), (-30, 11), (0, 31), (0, 61), (0, 1)])),
                       together)


def crossed(crossover, exchange):
    """Return which cells a crossover takes; what it returns is the change of cost."""
    exchange.taken[:] = False
    change = crossover(exchange)
    assert change == twins.change_of(exchange, exchange.taken)
    return exchange.taken.copy()


def cut(exchange):
    return crossed(Cut(*exchange.shape, exchange.neighbours), exchange)


def least_cost_by_flow(exchange):
    """
    Return the change of cost of the best choice, and how many cells it takes at least: networkx.

    For pairs that are not above 0; a cell costs a little, so that of equal choices few cells win.
    """
    graph, constant, unit = networkx.DiGraph(), 0, exchange.cells.size + 1
    graph.add_nodes_from(['first', 'second'])
    alone = [int(change) * unit + 1 for change in exchange.alone]
    for one, other, side in twins.pairs_of(exchange):
        weight = -int(exchange.pairs[one, side]) * unit
        alone[one] -= weight
        graph.add_edge(one, other, capacity=weight)
    for index, change in enumerate(alone):
        if change < 0:
            constant += change
            graph.add_edge('second', index, capacity=-change)
        else:
            graph.add_edge(index, 'first', capacity=change)
    change, cells = divmod(constant + networkx.minimum_cut_value(graph, 'second', 'first'), unit)
    return change, cells


@settings(max_examples=100)
@given(exchanges((-20, 21), most=12), st.sampled_from([0, 1, 5]))
def test_regions_are_taken_as_by_trying_each(exchange, advantage):
    taken = crossed(PartitionCrossover(*exchange.shape, advantage), exchange)
    np.testing.assert_array_equal(taken, twins.regions(exchange, advantage))


@settings(max_examples=75)
@given(exchanges(most=14) | st.builds(
    exchange_of, st.sampled_from([(1, 40), (40, 1), (2, 30), (30, 2)]), st.sampled_from([4, 8]),
    st.integers(0, 99), st.just(0.9), st.just((-LARGEST_CHANGE, LARGEST_CHANGE + 1)),
    st.just((-LARGEST_CHANGE, 1))))
def test_a_cut_costs_what_another_maximum_flow_says_and_takes_the_fewest_cells(exchange):
    """Also of the widest changes; pairs with what is no cell, left in memory, do not count."""
    expected, used = cut(exchange), Cut(*exchange.shape, exchange.neighbours)
    assert (twins.change_of(exchange, expected), expected.sum()) == least_cost_by_flow(exchange)
    there = np.zeros(exchange.pairs.shape, bool)
    for one, _, side in twins.pairs_of(exchange):
        there[one, side] = True
    exchange.pairs[~there] = -9
    for _ in range(2):
        np.testing.assert_array_equal(crossed(used, exchange), expected)


@settings(max_examples=40)
@given(exchanges(most=12), st.integers(0, 999), st.sampled_from(['load', 'maximum_flow']))
def test_a_cut_that_was_interrupted_leaves_nothing_for_the_next_one(exchange, seed, where):
    whole = getattr(crossover, where)

    def interrupted(*arguments):
        whole(*arguments)
        raise KeyboardInterrupt

    used = Cut(*exchange.shape, exchange.neighbours)
    with pytest.MonkeyPatch.context() as patch, suppress(KeyboardInterrupt):
        patch.setattr(crossover, where, interrupted)
        used(exchange)
    other = exchange_of(exchange.shape, exchange.neighbours, seed, 0.8)
    np.testing.assert_array_equal(crossed(used, other), cut(other))


@settings(max_examples=100)
@given(exchanges((-20, 31)))
def test_a_cut_counts_pairs_above_0_as_0_and_then_leaves_the_regions_that_lose(exchange):
    taken, pairs = cut(exchange), exchange.pairs.copy()
    exchange.pairs[:] = np.minimum(pairs, 0)
    cut(exchange)
    exchange.pairs[:] = pairs
    change = PartitionCrossover(*exchange.shape).keep_gains(exchange)
    assert change == twins.change_of(exchange, taken) <= 0
    np.testing.assert_array_equal(exchange.taken, taken)


@pytest.mark.parametrize('change', [LARGEST_CHANGE + 1, -LARGEST_CHANGE - 1, -2**31, 2**31 - 1])
@pytest.mark.parametrize('memory', ['alone', 'pairs'])
def test_changes_beyond_the_largest_are_rejected(change, memory):
    exchange = exchange_of((3, 4), 4, 0)
    getattr(exchange, memory)[-1] = change
    with pytest.raises(ValueError, match=f'is beyond {LARGEST_CHANGE}'):
        cut(exchange)
