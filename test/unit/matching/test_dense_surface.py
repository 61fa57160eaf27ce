# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Maps in parts of a pixel: medians, local planes, fitness, crossover."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.refinement import dense_map
from fuzzy_stereo_ros.matching.quality.seed import Steps, SurfaceFitness
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from reference_crossover import change_of
import reference_quality as twins

SHAPES = [(1, 1), (1, 9), (9, 1), (8, 11)]
BY_COLOUR = np.exp(-np.arange(766) / 20).astype(np.float32)
STEPS = Steps(slope=0.2, free=0.25, jump=2.0, apart=0.5)


def surface_of(shape, seed=0, limit=8):
    return random_map(shape, 16 * limit, seed, np.float32) / np.float32(16)


@pytest.mark.parametrize('labels', [1, 8, 255, 256, 257, 512])
@pytest.mark.parametrize('shape', SHAPES)
def test_selected_pixels_take_the_median_weighted_by_colour_and_distance(shape, labels):
    """The map reaches from label to label, whose places the histogram just holds."""
    surface, colours = random_map(shape, labels, 0, np.float32), random_map((*shape, 3), 60, 1)
    surface = np.minimum(surface + surface_of(shape, 3, 1), np.float32(labels - 1))
    selected = random_map(shape, 2, 2)
    distance = np.exp(-np.arange(-3, 4)**2 / 8).astype(np.float32)
    result = np.zeros_like(surface)
    dense_map.weighted_median(surface, selected, colours, 3, BY_COLOUR, distance,
                              np.zeros(dense_map.BINS * labels + 1, np.float32), result, 0,
                              shape[0])
    np.testing.assert_allclose(result, twins.weighted_median(
        surface, selected, colours, 3, BY_COLOUR, distance, dense_map.BINS), atol=1e-5)


@pytest.mark.parametrize('nearest', [0, 254, 509])
@pytest.mark.parametrize('shape', SHAPES)
def test_local_planes_are_those_of_the_twin(shape, nearest):
    surface, colours = surface_of(shape, limit=3) + nearest, random_map((*shape, 3), 60, 1)
    result = np.zeros_like(surface)
    dense_map.local_planes(surface, colours, 2, BY_COLOUR, np.float32(1), np.float32(0.25),
                           result, 0, shape[0])
    np.testing.assert_allclose(result, twins.local_planes(
        surface, colours, 2, BY_COLOUR, 1.0, 0.25), atol=2e-3)


def test_a_plane_stays_itself_under_local_planes():
    rows, columns = np.indices((20, 30))
    plane = (5 + 0.2 * columns + 0.1 * rows).astype(np.float32)
    result = np.zeros_like(plane)
    dense_map.local_planes(plane, np.zeros((20, 30, 3), np.uint8), 4, BY_COLOUR, np.float32(1.5),
                           np.float32(0.25), result, 0, 20)
    np.testing.assert_allclose(result[5:-5, 5:-5], plane[5:-5, 5:-5], atol=1e-3)


@pytest.mark.parametrize('disparities', [1, 2, 7, 32])
def test_costs_between_labels_lie_between_theirs(disparities):
    cells = random_map((1, 1, 32), FULL, disparities, np.uint16)
    for disparity in np.linspace(-1, disparities + 1, 19, dtype=np.float32):
        assert surface_cost.cost_at(cells, 0, 0, disparity, disparities) == pytest.approx(
            twins.cost_at(cells[0, 0], disparity, disparities), abs=1e-3)


def joined(shape, seed, father, apart):
    """
    Join two random maps; return the child, what it is said to save, and a measure of maps.

    father: makes the second map of the first one; apart: of STEPS
    """
    fitness = SurfaceFitness(*shape, 9)
    across, down = (random_map(shape, 9, seed + 1 + side, np.float32) / np.float32(8)
                    for side in range(2))
    costs = random_map((*shape, 32), FULL, seed, np.uint16)
    rejected = random_map(shape, 2, seed + 3) == 1
    fitness.trust(rejected)
    fitness.look(across, down)

    def genes(surface):
        found = np.array([twins.cost_at(costs[place] >> 1, surface[place], 9)
                          for place in np.ndindex(shape)]).reshape(shape)
        return found * np.where(rejected, 0.1, 1)

    def cost(surface):
        return twins.surface_cost(surface, genes(surface), across, down, 0.2 * FULL / 2, 0.25,
                                  FULL)
    mother = surface_of(shape, seed)
    father = father(mother)
    maps, prices = (mother.copy(), father), [np.zeros(shape, np.float32) for _ in range(2)]
    half = shape[0] // 2
    for first, rows in ((0, costs[:half]), (half, costs[half:])):
        fitness.price(ThreadPool(1), rows, first, maps, prices)
    for surface, price in zip(maps, prices):
        np.testing.assert_allclose(price, genes(surface), atol=1e-3)
    saved = fitness.join(maps[0], prices[0], father, prices[1], STEPS._replace(apart=apart))
    np.testing.assert_allclose(prices[0], genes(maps[0]), atol=1e-3)
    return mother, father, maps[0], saved / surface_cost.PARTS, cost


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('shape', [*SHAPES, (37, 3)])
def test_a_child_costs_no_more_than_its_parents_and_saves_what_is_said(shape, seed):
    mother, father, child, saved, cost = joined(
        shape, seed, lambda surface: np.where(random_map(shape, 3, seed) == 0,
                                              surface_of(shape, seed + 9), surface), 0.0)
    assert cost(child) == pytest.approx(cost(mother) - saved, abs=0.01 * child.size)
    assert cost(child) <= min(cost(mother), cost(father)) + 0.01 * child.size


def test_genes_that_hardly_differ_stay_those_of_the_mother():
    mother, _, child, saved, _ = joined(
        (6, 9), 0, lambda surface: surface + np.float32(0.3), 0.5)
    np.testing.assert_array_equal(mother, child)
    assert saved == 0


@st.composite
def crossings(draw):
    """Return mother, father, what their genes cost, weights of steps; all without rounding."""
    shape, seed = (draw(st.integers(1, 9)), draw(st.integers(1, 9))), draw(st.integers(0, 10**6))
    mother, father = (surface_of(shape, seed + k, draw(st.sampled_from([1, 3, 512])))
                      for k in range(2))
    agree = random_map(shape, 10, seed + 2) < draw(st.sampled_from([0, 3, 6, 9]))
    father[agree] = mother[agree]
    most = draw(st.sampled_from([1, 16, 200]))
    across, down = (random_map(shape, 9, seed + k, np.float32) / np.float32(8) for k in (5, 6))
    return mother, father, *(random_map(shape, most, seed + k, np.float32) for k in (3, 4)), \
        across, down


@settings(max_examples=200, deadline=None)
@given(crossings(), st.sampled_from([0, 0.25, 1]), st.sampled_from([0, 0.125, 0.5]))
def test_an_exchange_says_what_the_child_costs_more_than_the_first_parent(
        crossing, free, apart):
    first, second, first_costs, second_costs, across, down = crossing
    numbers, apart = [np.float32(number) for number in (8, free, 20)], np.float32(apart)

    def cost(surface):
        genes = np.where(surface == first, first_costs, second_costs)
        return twins.surface_cost(surface, genes, across, down, *numbers)

    exchange = Exchange(*first.shape, 4)
    exchange.hold(surface_cost.cells_apart(first, second, apart, exchange.all_cells))
    np.testing.assert_array_equal(exchange.cells, np.flatnonzero(abs(first - second) > apart))
    exchange.pairs[:] = 99
    surface_cost.exchange_changes(
        first, first_costs, second, second_costs, across, down, *numbers, apart, exchange.cells,
        exchange.alone, exchange.pairs)
    for share in (2, 5, 10):
        exchange.taken[:] = random_map((exchange.cells.size,), 10, share) < share
        child = first.copy()
        taken = exchange.cells[exchange.taken]
        child.flat[taken] = second.flat[taken]
        assert change_of(exchange, exchange.taken) == surface_cost.PARTS * (
            cost(child) - cost(first))
