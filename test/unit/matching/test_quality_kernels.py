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


@settings(max_examples=40)
@given(st.integers(1, 3), st.integers(1, 40),
       st.integers(1, 40) | st.sampled_from([255, 256, 257, 512]), st.integers(0, 4),
       st.sampled_from([12, 1021]),
       st.sampled_from([(5, 3, 16, 4), (0, 1, 1, 0), (1, 0, 0, 1), (37, 1, 64, 11)]))
def test_census_and_costs_are_those_of_the_twin(
        rows, columns, disparities, first_inside, spread, weights):
    labels, shape = -(-disparities // 32) * 32, (rows, columns)
    fine = [random_map((rows + 4, columns + 4), 20, seed, np.float32) for seed in (1, 2)]
    codes = np.zeros((2, rows, 2, columns), np.uint16)
    for image, found in zip(fine, codes):
        fuzzy_costs.census(image, 2, found, 0, rows)
        np.testing.assert_array_equal(found, twins.census(image, 2))
    planes = [random_map((rows, fuzzy_costs.PLANES, columns), spread, seed, np.uint16)
              + np.uint16(16384) for seed in (3, 4)]
    padded = [np.concatenate([kind[..., ::-1], np.repeat(kind[..., :1], labels, axis=2)], axis=2)
              for kind in (codes[1], planes[1])]
    costs = np.zeros((*shape, labels), np.uint16)
    fuzzy_costs.fill_costs(
        np.concatenate([codes[0], planes[0]], axis=1), np.concatenate(padded, axis=1),
        np.uint16(weights), disparities, first_inside, costs, 0, rows)
    np.testing.assert_array_equal(costs, twins.costs(
        *codes, *planes, weights, disparities, first_inside, labels))


@settings(max_examples=10)
@given(st.integers(1, 22) | st.just(70), st.integers(1, 34), st.sampled_from([0, 3]),
       st.sampled_from([4, 34]), st.sampled_from([0, FULL]), st.integers(0, 99))
def test_arms_and_means_over_them_are_those_of_the_twin(
        rows, columns, steps, longest, least, seed):
    """Arms end at edges of colour and of the parent."""
    shape = rows, columns
    colours = random_map((*shape, 3), 18 if steps else 14, seed)
    surface = random_map(shape, steps + 1, seed, np.float32) / np.float32(4)
    arms = np.zeros((*shape, 4), np.uint8)
    fuzzy_costs.fill_arms(colours, surface, arms, 0, rows)
    np.testing.assert_array_equal(arms, twins.arms(colours, 8, 4, 14, 8, surface, 0.4))

    costs = np.maximum(random_map((*shape, 64), FULL + 1, seed, np.uint16), np.uint16(least))
    row, column = np.indices(shape)
    room = np.stack([column, columns - 1 - column, row, rows - 1 - row], axis=2)
    arms = np.minimum(random_map((*shape, 4), longest + 1, seed), room).astype(np.uint8)
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
    away = np.clip(abs(np.arange(labels) - surface[..., np.newaxis]) - 1, 0, 4)
    assert (abs(reliance - costs - weights[..., np.newaxis] * away) <= 1).all()
    fuzzy_costs.add_prior(reliance, surface, weights, *numbers, True, 0, 4)
    np.testing.assert_array_equal(reliance, costs)


@settings(max_examples=60)
@given(st.integers(1, 6), st.integers(1, 9),
       st.integers(1, 40) | st.sampled_from([64, 255, 256, 257, 288, 512]), st.booleans(),
       st.sampled_from([0, 2, 5]), st.integers(0, 99))
def test_paths_and_what_they_choose_from_both_sides_are_those_of_the_twin(
        rows, columns, disparities, upwards, steepest, seed):
    shape, labels = (rows, columns), -(-disparities // 32) * 32
    costs = random_map((*shape, labels), FULL + 1, seed, np.uint16)
    parent, steps = random_map(shape, 6, seed, np.int16), random_map((4, *shape), 256, seed)
    small, jump = (np.linspace(high, high / 8, 256).astype(np.uint16) for high in (90, 700))
    sums = random_map(costs.shape, 9, seed, np.uint16)
    before = sums.astype(int) if upwards else 0
    eight_directions.sum_paths(costs, (parent, steepest), (steps, small, jump), sums, upwards,
                               rows - 1 if upwards else 0, 0)
    np.testing.assert_array_equal(sums, before + twins.summed_paths(
        costs, parent, steepest, steps, small, jump, upwards))

    sums = random_map(costs.shape, 90, seed + 1, np.uint16)
    extra = seed % disparities
    found = [np.zeros(shape, kind) for kind in (np.int16, np.float32, np.uint16)]
    found.append(np.zeros((rows, extra + columns), np.int16))
    eight_directions.choose_labels(sums, disparities, tuple(found), 0)
    for one, wanted in zip(found, twins.chosen_labels(sums.astype(int), disparities, extra)):
        np.testing.assert_allclose(one, wanted, atol=1e-6)


@pytest.mark.parametrize('here', [slice(0, 150), slice(20, 60), slice(70, 149), slice(74, 76)])
def test_some_rows_are_chosen_as_among_all_and_the_others_stay(here):
    costs, chosen = random_map((150, 20, 32), FULL, dtype=np.uint16), []
    guess = SurfaceScanlines(costs.shape)
    guess.set_colour(random_map((150, 20, 3), 30, 7))
    for rows in (slice(None), here):
        chosen.append([np.zeros((150, 20), kind)
                       for kind in (np.int16, np.float32, np.uint16, np.int16)])
        guess.search(ThreadPool(1), costs, 24, 0.1, np.zeros((150, 20), np.int16), 2,
                     tuple(chosen[-1]), rows)
    for wanted, found in zip(*chosen):
        wanted[:here.start] = wanted[here.stop:] = 0
        np.testing.assert_array_equal(found, wanted)


BY_COLOUR = np.exp(-np.arange(766) / 20).astype(np.float32)


def surface_of(shape, seed=0, limit=8):
    return random_map(shape, 16 * limit, seed, np.float32) / np.float32(16)


@settings(max_examples=60)
@given(st.integers(1, 9), st.integers(1, 11), st.sampled_from([1, 8, 255, 256, 257, 512]),
       st.integers(0, 99))
def test_weighted_medians_and_local_planes_are_those_of_the_twins(rows, columns, labels, seed):
    """The map reaches from label to label, whose places the histogram just holds."""
    shape = rows, columns
    surface, colours = random_map(shape, labels, seed, np.float32), random_map((*shape, 3), 60, 1)
    surface = np.minimum(surface + surface_of(shape, seed, 1), np.float32(labels - 1))
    selected, result = random_map(shape, 2, seed + 1) == 1, np.zeros_like(surface)
    distance = np.exp(-np.arange(-3, 4)**2 / 8).astype(np.float32)
    fits.weighted_median(surface, selected, colours, BY_COLOUR, distance, result, 0, rows)
    np.testing.assert_allclose(result, twins.weighted_median(
        surface, selected, colours, 3, BY_COLOUR, distance, fits.BINS), atol=1e-5)

    surface = surface_of(shape, seed, 3) + np.float32(max(labels - 3, 0))
    fits.smooth(
        surface, colours, (2, BY_COLOUR, np.float32(1), np.float32(0.25)), result, 0, rows)
    np.testing.assert_allclose(result, twins.local_planes(
        surface, colours, 2, BY_COLOUR, 1.0, 0.25), atol=2e-3)


@settings(max_examples=60)
@given(st.integers(1, 37), st.integers(1, 11), st.integers(0, 999))
def test_a_child_costs_no_more_than_its_parents_and_saves_what_crossover_returns(
        rows, columns, seed):
    shape = rows, columns
    across, down = (random_map(shape, 9, seed + k, np.float32) / np.float32(8) for k in (1, 2))
    costs = random_map((*shape, 32), FULL, seed, np.uint16)
    trust = np.where(random_map(shape, 2, seed + 3) == 1, np.float32(0.1), np.float32(1))

    def genes(surface):
        found = [np.interp(surface[place], range(9), costs[place][:9] >> 1)
                 for place in np.ndindex(shape)]
        return np.reshape(found, shape) * trust

    def cost(surface):
        return twins.surface_cost(surface, genes(surface), across, down, surface_cost)

    first, other = surface_of(shape, seed), surface_of(shape, seed + 9)
    differs = (random_map(shape, 3, seed) == 0) & (abs(other - first) > surface_cost.APART)
    second = np.where(differs, other, first)
    maps, prices, half = (first.copy(), second), np.zeros((2, *shape), np.float32), rows // 2
    for top, part in ((0, costs[:half]), (half, costs[half:])):
        measure(ThreadPool(1), part, top, 9, trust, maps, list(prices))
    for surface, price in zip(maps, prices):
        np.testing.assert_allclose(price, genes(surface), atol=1e-3)
    saved = cross(maps[0], prices[0], second, prices[1], np.stack([across, down]))
    np.testing.assert_allclose(prices[0], genes(maps[0]), atol=1e-3)
    assert cost(maps[0]) == pytest.approx(
        cost(first) - saved / surface_cost.COST_PARTS, abs=0.01 * first.size)
    assert cost(maps[0]) <= min(cost(first), cost(second)) + 0.01 * first.size


@settings(max_examples=100)
@given(st.integers(1, 9), st.integers(1, 9), st.sampled_from([1, 3, 512]),
       st.sampled_from([0, 3, 6, 9]), st.sampled_from([1, 16, 200]), st.integers(0, 10**6))
def test_an_exchange_has_the_change_of_cost_from_the_first_parent_to_the_child(
        rows, columns, limit, alike, most, seed):
    shape, apart = (rows, columns), surface_cost.APART
    first, second = (surface_of(shape, seed + k, limit) for k in range(2))
    agree = random_map(shape, 10, seed + 2) < alike
    second[agree] = first[agree]
    prices = [random_map(shape, most, seed + k, np.float32) for k in (3, 4)]
    across, down = (random_map(shape, 9, seed + k, np.float32) / np.float32(8) for k in (5, 6))

    def cost(surface):
        return twins.surface_cost(
            surface, np.where(surface == first, *prices), across, down, surface_cost)

    exchange = Exchange(*shape, 4)
    exchange.set_cells(abs(first - second) > apart)
    exchange.pairs[:] = 99
    surface_cost.exchange_changes(
        first, prices[0], second, prices[1], np.stack([across, down]), exchange.changes())
    for share in (2, 5, 10):
        taken, child = random_map((exchange.cells.size,), 10, share) < share, first.copy()
        child.flat[exchange.cells[taken]] = second.flat[exchange.cells[taken]]
        assert change_of(exchange, taken) == surface_cost.COST_PARTS * (cost(child) - cost(first))
