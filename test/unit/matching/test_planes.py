# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Genes that are planes: costs, exchange, fits, segments, evidence, against plain twins."""
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.evolution import Random
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.planes.costs import (
    LARGEST_DIFFERENCE, LEAST, PRICE, reject_unfounded)
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import compare_views
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, OUTSIDE
from fuzzy_stereo_ros.matching.quality import planes
from fuzzy_stereo_ros.matching.quality.fitness import (
    PlaneFitness, SUPPORT_RADIUS, SUPPORT_STRIDE)
from fuzzy_stereo_ros.matching.quality.planes import region_planes
from fuzzy_stereo_ros.matching.quality.population import EvolvingView
from fuzzy_stereo_ros.matching.quality.result import averaged_with_planes
from fuzzy_stereo_ros.matching.quality.scanlines import cut_strips
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

ROWS, COLUMNS, LABELS = 14, 23, 9
POOL = ThreadPool(1)


def random_planes(draw, slope=0.2):
    """Return a plane for each pixel whose disparity there lies around the labels."""
    planes = draw.uniform(-slope, slope, (ROWS, 3, COLUMNS)).astype(np.float32)
    row, column = np.indices((ROWS, COLUMNS))
    wanted = draw.uniform(-1, LABELS, (ROWS, COLUMNS))
    planes[:, 2] = wanted - planes[:, 0] * column - planes[:, 1] * row
    return planes


def looked(seed, origin=None):
    """Return a fitness that has seen a random view, its volume and its colours."""
    draw = np.random.default_rng(seed)
    volume = draw.integers(0, 256, (ROWS, COLUMNS, LABELS)).astype(np.uint8)
    colour = draw.integers(0, 60, (ROWS, COLUMNS, 3)).astype(np.uint8)
    fitness = PlaneFitness(ROWS, COLUMNS, LABELS)
    fitness.set_view(POOL, volume, origin, colour, colour.astype(np.float32) / 8,
                     draw.uniform(0, 1, (ROWS, COLUMNS)).astype(np.float32))
    return fitness, volume, colour, draw


def cost_at(volume, row, column, label, column_step):
    """Return the cost of a whole label, beyond the other image what the last one inside costs."""
    place = column + column_step * label
    while place >= COLUMNS and label > 0:
        place, label = place - 1, label - 1
        if place == COLUMNS - 1:
            return max(float(volume[row, place, label]), 128.0)
    if not 0 <= place < COLUMNS:
        return 128.0
    return float(volume[row, place, label])


def unlikeness(colour, one, other):
    """Return the difference of the colours of two pixels, summed over channels."""
    return abs(colour[one].astype(int) - colour[other]).sum()


def purity(colour, row, column):
    """Return how much of the 5 x 5 pixels around one is of its colour, at least 0.1."""
    inside = [(y, x) for y in range(row - 2, row + 3) for x in range(column - 2, column + 3)
              if 0 <= y < ROWS and 0 <= x < COLUMNS]
    return max(sum(int(255 * np.exp(-unlikeness(colour, (row, column), other) / 20) + 0.5)
                   for other in inside) / (255 * 25), 0.1)


def plane_cost(volume, colour, plane, row, column, origin):
    """Return what a plane costs over its support, from the definition."""
    column_step = 0 if origin is None else 1
    total = mass = 0.0
    for down in range(-SUPPORT_RADIUS, SUPPORT_RADIUS + 1):
        for right in range(-SUPPORT_RADIUS, SUPPORT_RADIUS + 1):
            y, x = row + SUPPORT_STRIDE * down, column + SUPPORT_STRIDE * right
            if not (0 <= y < ROWS and 0 <= x < COLUMNS):
                continue
            unlike = unlikeness(colour, (row, column), (y, x))
            away = (down * down + right * right) * SUPPORT_STRIDE**2
            weight = int(255 * np.exp(-unlike / 20) * np.exp(-away / 128)
                         * purity(colour, y, x) + 0.5)
            disparity = plane[0] * x + plane[1] * y + plane[2]
            mass += weight
            if disparity < -0.5 or disparity > LABELS - 0.5:
                total += 255 * weight
                continue
            within = min(max(disparity, 0), LABELS - 1)
            label = int(within)
            place = x if origin is None else origin - x
            cost = cost_at(volume, y, place, label, column_step)
            if within > label:
                next_cost = cost_at(volume, y, place, label + 1, column_step)
                cost += (within - label) * (next_cost - cost)
            total += weight * cost
    return total / mass * 1024 / 255


@pytest.mark.parametrize('origin', [None, COLUMNS - 1, COLUMNS + 2, COLUMNS - 5])
def test_the_cost_of_a_plane_is_the_mean_over_its_support(origin):
    fitness, volume, colour, draw = looked(0 if origin is None else origin, origin)
    planes = random_planes(draw)
    expected = [[plane_cost(volume, colour, planes[row, :, column].astype(float), row, column,
                            origin)
                 for column in range(COLUMNS)] for row in range(ROWS)]
    np.testing.assert_allclose(fitness.match_costs(POOL, planes), expected, atol=1.5)


def test_only_selected_planes_are_measured():
    fitness, _, _, draw = looked(0)
    planes, selected = random_planes(draw), draw.random((ROWS, COLUMNS)) < 0.5
    np.testing.assert_array_equal(fitness.match_costs(POOL, planes, selected),
                                  np.where(selected, fitness.match_costs(POOL, planes), 0))


def smoothness(fitness, planes):
    """Return what neighbours' differences cost, from the definition, before rounding."""
    row, column = np.indices((ROWS, COLUMNS)).astype(float)
    wide = np.moveaxis(planes, 1, 2).astype(float)

    def at(plane, y, x):
        return plane[..., 0] * x + plane[..., 1] * y + plane[..., 2]
    total = 0.0
    for axis, weight in zip((1, 0), fitness._smoothness):
        one, other = np.delete(wide, 0, axis), np.delete(wide, -1, axis)
        y1, x1 = np.delete(row, 0, axis), np.delete(column, 0, axis)
        y2, x2 = np.delete(row, -1, axis), np.delete(column, -1, axis)
        apart = abs(at(one, y1, x1) - at(other, y1, x1)) + abs(
            at(one, y2, x2) - at(other, y2, x2))
        total += (np.delete(weight, 0, axis) * np.minimum(apart, LARGEST_DIFFERENCE)).sum()
    return total


def test_a_map_costs_its_matches_and_the_differences_of_neighbours():
    fitness, _, _, draw = looked(1)
    planes = random_planes(draw)
    matches = fitness.match_costs(POOL, planes)
    assert fitness.total(POOL, planes, matches) == pytest.approx(
        matches.sum() + smoothness(fitness, planes), abs=2 * ROWS * COLUMNS)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_an_exchange_has_the_exact_change_of_any_choice_of_cells(seed):
    fitness, _, _, draw = looked(seed)
    fitness.trust_consistent(draw.random((ROWS, COLUMNS)) < 0.7)
    first, second = random_planes(draw), random_planes(draw)
    selected = draw.random((ROWS, COLUMNS)) < 0.6
    priced = [(planes, fitness.trusted_costs(fitness.match_costs(POOL, planes)))
              for planes in (first, second)]
    exchange = Exchange(ROWS, COLUMNS, 4)
    fitness.fill(exchange, *priced, selected)
    np.testing.assert_array_equal(exchange.cells, np.flatnonzero(selected))
    chosen = draw.random(exchange.cells.size) < 0.5
    change = int(exchange.alone[chosen].sum())
    place = {cell: chosen[index] for index, cell in enumerate(exchange.cells)}
    for index, cell in enumerate(exchange.cells):
        left, up = cell - 1 if cell % COLUMNS else -1, cell - COLUMNS
        for side, neighbour in enumerate((left, up)):
            if chosen[index] and place.get(neighbour):
                change += int(exchange.pairs[index, side])
            if neighbour not in place:
                assert exchange.pairs[index, side] == 0
    before = fitness.total(POOL, *priced[0])
    row, column = np.divmod(exchange.cells[chosen], COLUMNS)
    for ours, theirs in zip(*priced):
        ours[row, ..., column] = theirs[row, ..., column]
    assert fitness.total(POOL, *priced[0]) - before == change


def test_planes_of_regions_are_found_among_outliers():
    draw = np.random.default_rng(2)
    row, column = np.indices((40, 60))
    labels = (column // 30).astype(np.int32)
    truth = np.array([[0.1, -0.05, 9], [-0.2, 0.1, 20]])
    disparity = (truth[labels, 0] * column + truth[labels, 1] * row
                 + truth[labels, 2]).astype(np.float32)
    disparity[draw.random(disparity.shape) < 0.3] = 60
    found = region_planes(POOL, disparity, np.ones(disparity.shape, bool),
                          planes.listed(labels, 2), Random((3,)))
    np.testing.assert_allclose(found, truth, atol=0.02)


def plain_segments(values, scale, smallest):
    """Return segments by the paper's rule, sets joined edge by edge."""
    rows, columns = values.shape[:2]
    edges = []
    for row in range(rows):
        for column in range(columns):
            for side, (y, x) in enumerate(((row, column - 1), (row - 1, column))):
                if y >= 0 and x >= 0:
                    apart = np.sqrt(((values[row, column] - values[y, x])**2).sum())
                    edges.append((int(apart * 16 + 0.5), 2 * (row * columns + column) + side,
                                  row * columns + column, y * columns + x))
    label, inner = list(range(rows * columns)), {}
    for few in (False, True):
        for level, _, one, other in sorted(edges):
            one, other = label[one], label[other]
            if one == other:
                continue
            size, size2 = label.count(one), label.count(other)
            if few:
                join = min(size, size2) < smallest
            else:
                join = level / 16 <= min(inner.get(one, 0) + scale / size,
                                         inner.get(other, 0) + scale / size2)
            if join:
                inner[one] = max(level / 16 if not few else 0, inner.get(one, 0))
                label = [one if mine == other else mine for mine in label]
    return np.unique(label, return_inverse=True)[1].reshape(rows, columns)


@pytest.mark.parametrize('scale, smallest', [(10, 1), (40, 4), (200, 9)])
def test_segments_are_those_of_the_plain_rule(scale, smallest):
    draw = np.random.default_rng(scale)
    values = np.repeat(np.repeat(draw.integers(0, 50, (3, 4, 3)), 4, 0), 4, 1).astype(np.float32)
    values += draw.integers(0, 4, values.shape)
    size = values.shape[0] * values.shape[1]
    differences, order = np.zeros(2 * size, np.int16), np.zeros(2 * size, np.int32)
    number = segments.sort_edges(values, differences, np.zeros(segments.LEVELS + 1, np.int32),
                                 order)
    assert number == 2 * size - sum(values.shape[:2])
    assert (np.diff(differences[order[:number]]) >= 0).all()
    labels = np.zeros(values.shape[:2], np.int32)
    count = segments.join_pixels(
        order[:number], differences, np.float32(scale), smallest,
        *(np.zeros(size, np.int32) for _ in range(2)), np.zeros(size, np.float32), labels)
    expected = plain_segments(values, scale, smallest)
    assert count == expected.max() + 1 == labels.max() + 1
    pairs = set(zip(labels.flat, expected.flat))
    assert len(pairs) == count
    assert list(np.unique(labels, return_index=True)[1]) == sorted(
        np.unique(labels, return_index=True)[1])


@given(st.integers(0, 10**6))
def test_regions_list_each_pixel_once(seed):
    labels = np.random.default_rng(seed).permutation(np.arange(17 * 23) % 9).reshape(17, 23)
    regions = planes.listed(labels.astype(np.int32), 9)
    np.testing.assert_array_equal(np.sort(regions.pixels), np.arange(17 * 23))
    for region in range(regions.number):
        pixels = regions.pixels[regions.starts[region]:regions.starts[region + 1]]
        assert pixels.size and (labels.reshape(-1)[pixels] == region).all()


def rejected(dearer, trusted=(True,) * 5, labels=(0,) * 5, rows=LEAST):
    """Return which columns of cells may move; dearer: their costs, in tenths of the price."""
    def repeated(values, kind):
        return np.repeat(np.array([values]).astype(kind), rows, axis=0)
    selected = repeated([True] * 5, bool)
    old, moved = repeated([0] * 5, np.float32), np.where(np.array(dearer) == 0, 0.1, 2)
    reject_unfounded(repeated(labels, np.int32), (old, old.astype(np.int32)),
                     (repeated(moved, np.float32), repeated(np.multiply(dearer, PRICE / 10),
                                                            np.int32)),
                     repeated(trusted, bool), selected)
    assert (selected == selected[0]).all()
    return (~selected[0]).tolist()


@pytest.mark.parametrize('dearer, moves, options', [
    ([3, -5, 0, 4, 4], '000xx', {}), ([3, -2, 0, 4, -4], 'xx000', {}),
    ([9, 99, 0, 11, 99], '000xx', {'trusted': [True, False, True, True, False]}),
    ([3, 3, 0, 4, 4], '00000', {'rows': LEAST // 2 - 1}),
    ([5, -9, 7, 7, 7], '00xxx', {'labels': [0, 0, 1, 1, 1]})],
    ids=['cheaper', 'dearer', 'where the views disagree', 'small', 'of other labels'])
def test_a_region_moves_only_without_evidence_against_it(dearer, moves, options):
    """Where the views disagree it may lose something; small ones are not asked."""
    assert rejected(dearer, **options) == [move == 'x' for move in moves]


def test_views_are_compared_where_they_meet():
    own = np.array([[0, 1, 2, 2, 1, 5]], np.float32)
    other = np.array([[0, 1.5, 4, 2, 2.5, 0]], np.float32)[:, ::-1].copy()
    validity = np.zeros((1, 6), np.uint8)
    compare_views(own, other, 0, np.float32(1), validity, 0, 1)
    assert validity[0].tolist() == [CONSISTENT, CONSISTENT, INVALID, CONSISTENT, CONSISTENT,
                                    INVALID]
    compare_views(own, other, 1, np.float32(1), validity, 0, 1)
    assert validity[0, 0] == OUTSIDE


@given(st.integers(1, 900), st.integers(1, 60), st.integers(1, 50000))
def test_strips_cover_all_rows_once_with_rows_around_them(rows, reach, most):
    strips = cut_strips(rows, 10, reach, most)
    assert [row for strip in strips for row in range(strip.first, strip.last)] == list(range(rows))
    assert len({strip.end - strip.begin for strip in strips}) == 1
    for strip in strips:
        assert strip.begin <= max(strip.first - reach, 0)
        assert strip.end >= min(strip.last + reach, rows)
        assert strip.begin >= 0 and strip.end <= rows


def test_a_segment_in_a_plane_is_averaged_with_it_and_a_curved_one_is_not():
    row, column = np.indices((40, 60))
    labels = (column // 30).astype(np.int32)
    truth = np.where(labels == 0, 9 + 0.1 * column - 0.05 * row, 0.02 * (column - 45.0)**2)
    noise = np.random.default_rng(0).uniform(-0.2, 0.2, truth.shape)
    disparity = (truth + noise).astype(np.float32)
    disparity[3:6, 3:6] += 2
    fitness = PlaneFitness(40, 60, 16)
    view = EvolvingView(POOL, fitness, None, [None, planes.listed(labels, 2)], (None, None, None))
    found = averaged_with_planes(view, disparity, disparity, Random((0,)))
    np.testing.assert_array_equal(found[labels == 1], disparity[labels == 1])
    np.testing.assert_array_equal(found[3:6, 3:6], disparity[3:6, 3:6])
    flat = labels == 0
    flat[3:6, 3:6] = False
    np.testing.assert_allclose((found - truth)[flat], noise[flat] / 2, atol=0.03)
