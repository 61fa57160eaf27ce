# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The kernels of quality: costs over supports, scanlines along a parent, maps between pixels."""
from census_scene import random_map
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.kernels.genetic import surface_cost
from fuzzy_stereo_ros.matching.kernels.planes import fits
from fuzzy_stereo_ros.matching.kernels.possibility import fuzzy_costs
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.scanlines import eight_directions
from fuzzy_stereo_ros.matching.quality.scanlines import SurfaceScanlines
from fuzzy_stereo_ros.matching.quality.seed import cross, measure
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from reference_crossover import change_of
import reference_quality as twins

SHAPES = [(1, 9), (9, 1), (2, 2), (7, 33), (5, 70)]


@pytest.mark.parametrize('shape', SHAPES)
def test_the_census_is_that_of_the_twin(shape):
    fine = random_map((shape[0] + 4, shape[1] + 4), 20, dtype=np.float32)
    codes = np.zeros((shape[0], 2, shape[1]), np.uint16)
    fuzzy_costs.census(fine, 2, codes, 0, shape[0])
    np.testing.assert_array_equal(codes, twins.census(fine, 2))


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 3), st.integers(1, 40),
       st.integers(1, 40) | st.sampled_from([255, 256, 257, 512]), st.integers(0, 4),
       st.sampled_from([12, 1021]),
       st.sampled_from([(5, 3, 16, 4), (0, 1, 1, 0), (1, 0, 0, 1), (37, 1, 64, 11)]))
def test_the_costs_are_those_of_the_twin(
        rows, columns, disparities, first_inside, spread, weights):
    labels = -(-disparities // 32) * 32
    codes, target_codes = (random_map((rows, 2, columns), 65536, seed, np.uint16)
                           for seed in (1, 2))
    planes, target_planes = (
        random_map((rows, fuzzy_costs.PLANES, columns), spread, seed, np.uint16)
        + np.uint16(16384)
        for seed in (3, 4))
    padded = [np.concatenate([kind[..., ::-1], np.repeat(kind[..., :1], labels, axis=2)], axis=2)
              for kind in (target_codes, target_planes)]
    costs = np.zeros((rows, columns, labels), np.uint16)
    fuzzy_costs.fill_costs(
        np.concatenate([codes, planes], axis=1), np.concatenate(padded, axis=1),
        np.uint16(weights), disparities, first_inside, costs, 0, rows)
    np.testing.assert_array_equal(costs, twins.costs(
        codes, target_codes, planes, target_planes, weights, disparities, first_inside, labels))


@pytest.mark.parametrize('steps', [0, 3])
@pytest.mark.parametrize('shape', [*SHAPES, (21, 25)])
def test_arms_end_at_edges_of_colour_and_of_the_parent(shape, steps):
    colours = random_map((*shape, 3), 14 if not steps else 18)
    surface = random_map(shape, steps + 1, 1, np.float32) / np.float32(4)
    arms = np.zeros((*shape, 4), np.uint8)
    fuzzy_costs.fill_arms(colours, surface, arms, 0, shape[0])
    np.testing.assert_array_equal(arms, twins.arms(colours, 8, 4, 14, 8, surface, 0.4))


@pytest.mark.parametrize('least', [0, fuzzy_costs.FULL])
@pytest.mark.parametrize('longest', [4, 34])
@pytest.mark.parametrize('shape', [*SHAPES, (70, 3)])
def test_means_over_rows_and_columns_are_those_of_the_twin(shape, longest, least):
    rows, columns = shape
    labels = 64
    costs = np.maximum(
        random_map((*shape, labels), fuzzy_costs.FULL + 1, dtype=np.uint16), np.uint16(least))
    places = np.indices(shape)
    room = [places[1], columns - 1 - places[1], places[0], rows - 1 - places[0]]
    arms = random_map((*shape, 4), longest + 1)
    arms = np.minimum(arms, np.stack(room, axis=2)).astype(np.uint8)
    by_rows, by_columns = costs.copy(), costs.copy()
    fuzzy_costs.mean_over_rows(by_rows, arms, 0, rows)
    for first, last in ((0, columns // 2), (columns // 2, columns)):
        fuzzy_costs.mean_over_columns(by_columns, arms, longest, first, last)
    np.testing.assert_array_equal(by_rows, twins.mean_over_arms(costs, arms, 1))
    np.testing.assert_array_equal(by_columns, twins.mean_over_arms(costs, arms, 0))


@pytest.mark.parametrize('labels', [32, 64, 512])
def test_a_prior_makes_labels_far_from_the_surface_cost_more_and_can_be_undone(labels):
    costs = random_map((4, 5, labels), fuzzy_costs.FULL + 1, dtype=np.uint16)
    surface = random_map((4, 5), 10 * labels, 1, np.float32) / np.float32(10)
    weights = random_map((4, 5), 60, 2, np.float32)
    reliance, numbers = costs.copy(), (np.float32(1), np.float32(4))
    fuzzy_costs.add_prior(reliance, surface, weights, *numbers, False, 0, 4)
    assert (abs(reliance - twins.costs_with_prior(costs, surface, weights, 1.0, 4.0)) <= 1).all()
    fuzzy_costs.add_prior(reliance, surface, weights, *numbers, True, 0, 4)
    np.testing.assert_array_equal(reliance, costs)


PATH_SHAPES = [(1, 5), (5, 1), (4, 7), (9, 13)]


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 6), st.integers(1, 9), st.sampled_from([32, 32, 64, 256, 288, 512]),
       st.booleans(), st.sampled_from([0, 2, 5]))
def test_paths_follow_the_parent_as_the_twin_does(rows, columns, labels, upwards, steepest):
    shape = rows, columns
    costs = random_map((*shape, labels), FULL + 1, dtype=np.uint16)
    parent, steps = random_map(shape, 6, 1, np.int16), random_map((4, *shape), 256, 2)
    small, jump = (np.linspace(high, high / 8, 256).astype(np.uint16) for high in (90, 700))
    sums = random_map(costs.shape, 9, 3, np.uint16)
    before = sums.astype(int) if upwards else 0
    eight_directions.sum_paths(costs, (parent, steepest), (steps, small, jump), sums, upwards,
                               rows - 1 if upwards else 0, 0)
    np.testing.assert_array_equal(sums, before + twins.summed_paths(
        costs, parent, steepest, steps, small, jump, upwards))


@pytest.mark.parametrize('disparities', [1, 2, 20, 33, 64, 255, 256, 257, 512])
@pytest.mark.parametrize('shape', PATH_SHAPES)
def test_labels_are_chosen_from_both_sides_as_by_the_twin(shape, disparities):
    rows, columns = shape
    sums = random_map((*shape, -(-disparities // 32) * 32), 90, dtype=np.uint16)
    labels, target = (np.zeros(shape, np.int16) for _ in range(2))
    offsets, margins = np.zeros(shape, np.float32), np.zeros(shape, np.uint16)
    expected = twins.chosen_labels(sums.astype(int), disparities)
    eight_directions.choose_labels(
        sums, disparities, (labels, offsets, margins, target), 0)
    for found, wanted in zip((labels, offsets, margins, target), expected):
        np.testing.assert_allclose(found, wanted, atol=1e-6)


def guessed(costs, parent, threads=1, here=slice(None)):
    guess, shape = SurfaceScanlines(costs.shape), costs.shape[:2]
    guess.set_colour(random_map((*shape, 3), 30, 7))
    chosen = tuple(np.zeros(shape, kind)
                   for kind in (np.int16, np.float32, np.uint16, np.int16))
    guess.search(ThreadPool(threads), costs, 24, 0.1, parent, 2, chosen, here)
    return chosen


@pytest.mark.parametrize('here', [slice(0, 150), slice(20, 60), slice(70, 149), slice(74, 76)])
def test_some_rows_are_chosen_as_among_all_and_the_others_stay(here):
    costs = random_map((150, 20, 32), FULL, dtype=np.uint16)
    parent = np.zeros((150, 20), np.int16)
    every, some = (guessed(costs, parent, here=rows) for rows in (slice(None), here))
    for found, wanted in zip(some, every):
        wanted[:here.start] = wanted[here.stop:] = 0
        np.testing.assert_array_equal(found, wanted)


MAP_SHAPES = [(1, 1), (1, 9), (9, 1), (8, 11)]
BY_COLOUR = np.exp(-np.arange(766) / 20).astype(np.float32)


def surface_of(shape, seed=0, limit=8):
    return random_map(shape, 16 * limit, seed, np.float32) / np.float32(16)


@pytest.mark.parametrize('labels', [1, 8, 255, 256, 257, 512])
@pytest.mark.parametrize('shape', MAP_SHAPES)
def test_selected_pixels_take_the_median_weighted_by_colour_and_distance(shape, labels):
    """The map reaches from label to label, whose places the histogram just holds."""
    surface, colours = random_map(shape, labels, 0, np.float32), random_map((*shape, 3), 60, 1)
    surface = np.minimum(surface + surface_of(shape, 3, 1), np.float32(labels - 1))
    selected = random_map(shape, 2, 2) == 1
    distance = np.exp(-np.arange(-3, 4)**2 / 8).astype(np.float32)
    result = np.zeros_like(surface)
    fits.weighted_median(surface, selected, colours, BY_COLOUR, distance, result, 0, shape[0])
    np.testing.assert_allclose(result, twins.weighted_median(
        surface, selected, colours, 3, BY_COLOUR, distance, fits.BINS), atol=1e-5)


@pytest.mark.parametrize('nearest', [0, 254, 509])
@pytest.mark.parametrize('shape', MAP_SHAPES)
def test_local_planes_are_those_of_the_twin(shape, nearest):
    surface, colours = surface_of(shape, limit=3) + nearest, random_map((*shape, 3), 60, 1)
    result = np.zeros_like(surface)
    fits.smooth(surface, colours, (2, BY_COLOUR, np.float32(1), np.float32(0.25)), result, 0,
                shape[0])
    np.testing.assert_allclose(result, twins.local_planes(
        surface, colours, 2, BY_COLOUR, 1.0, 0.25), atol=2e-3)


def joined(shape, seed, change):
    """
    Join two random maps; return the child, what it is said to save, and a measure of maps.

    change: makes the second map of the first one
    """
    across, down = (random_map(shape, 9, seed + 1 + side, np.float32) / np.float32(8)
                    for side in range(2))
    costs = random_map((*shape, 32), FULL, seed, np.uint16)
    rejected = random_map(shape, 2, seed + 3) == 1
    trust = np.where(rejected, np.float32(0.1), np.float32(1))

    def genes(surface):
        found = np.array([twins.cost_at(costs[place] >> 1, surface[place], 9)
                          for place in np.ndindex(shape)]).reshape(shape)
        return found * np.where(rejected, 0.1, 1)

    def cost(surface):
        return twins.surface_cost(surface, genes(surface), across, down, surface_cost)
    first = surface_of(shape, seed)
    second = change(first)
    maps, prices = (first.copy(), second), [np.zeros(shape, np.float32) for _ in range(2)]
    half = shape[0] // 2
    for top, rows in ((0, costs[:half]), (half, costs[half:])):
        measure(ThreadPool(1), rows, top, 9, trust, maps, prices)
    for surface, price in zip(maps, prices):
        np.testing.assert_allclose(price, genes(surface), atol=1e-3)
    saved = cross(maps[0], prices[0], second, prices[1], np.stack([across, down]))
    np.testing.assert_allclose(prices[0], genes(maps[0]), atol=1e-3)
    return first, second, maps[0], saved / surface_cost.COST_PARTS, cost


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('shape', [*MAP_SHAPES, (37, 3)])
def test_a_child_costs_no_more_than_its_parents_and_saves_what_crossover_returns(shape, seed):
    first, second, child, saved, cost = joined(
        shape, seed, lambda surface: np.where(
            (random_map(shape, 3, seed) == 0)
            & (abs(surface_of(shape, seed + 9) - surface) > surface_cost.APART),
            surface_of(shape, seed + 9), surface))
    assert cost(child) == pytest.approx(cost(first) - saved, abs=0.01 * child.size)
    assert cost(child) <= min(cost(first), cost(second)) + 0.01 * child.size


@st.composite
def crossings(draw):
    """Return first, second, what their genes cost, weights of steps; all without rounding."""
    shape, seed = (draw(st.integers(1, 9)), draw(st.integers(1, 9))), draw(st.integers(0, 10**6))
    first, second = (surface_of(shape, seed + k, draw(st.sampled_from([1, 3, 512])))
                     for k in range(2))
    agree = random_map(shape, 10, seed + 2) < draw(st.sampled_from([0, 3, 6, 9]))
    second[agree] = first[agree]
    most = draw(st.sampled_from([1, 16, 200]))
    across, down = (random_map(shape, 9, seed + k, np.float32) / np.float32(8) for k in (5, 6))
    return first, second, *(random_map(shape, most, seed + k, np.float32) for k in (3, 4)), \
        across, down


@settings(max_examples=200, deadline=None)
@given(crossings())
def test_an_exchange_has_the_change_of_cost_from_the_first_parent_to_the_child(crossing):
    first, second, first_costs, second_costs, across, down = crossing
    apart = surface_cost.APART

    def cost(surface):
        genes = np.where(surface == first, first_costs, second_costs)
        return twins.surface_cost(surface, genes, across, down, surface_cost)

    exchange = Exchange(*first.shape, 4)
    exchange.set_cells(abs(first - second) > apart)
    np.testing.assert_array_equal(exchange.cells, np.flatnonzero(abs(first - second) > apart))
    exchange.pairs[:] = 99
    surface_cost.exchange_changes(
        first, first_costs, second, second_costs, np.stack([across, down]),
        exchange.changes())
    for share in (2, 5, 10):
        exchange.taken[:] = random_map((exchange.cells.size,), 10, share) < share
        child = first.copy()
        taken = exchange.cells[exchange.taken]
        child.flat[taken] = second.flat[taken]
        assert change_of(exchange, exchange.taken) == surface_cost.COST_PARTS * (
            cost(child) - cost(first))
