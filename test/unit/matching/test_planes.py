# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Genes that are planes: costs, exchange, fits, segments, evidence, against plain twins."""
from types import SimpleNamespace

from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.evolution import Random
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.planes.costs import (
    LARGEST_DIFFERENCE, LEAST, PRICE, reject_unfounded)
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import compare_views
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, OUTSIDE
from fuzzy_stereo_ros.matching.quality.fitness import (
    PlaneFitness, SUPPORT_RADIUS, SUPPORT_STRIDE)
from fuzzy_stereo_ros.matching.quality.planes import listed, region_planes
from fuzzy_stereo_ros.matching.quality.result import averaged_with_planes
from fuzzy_stereo_ros.matching.quality.scanlines import cut_strips
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from reference_crossover import change_of, pairs_of

ROWS, COLUMNS, LABELS = 14, 23, 9
POOL = ThreadPool(1)


def looked(seed, origin=None):
    """Return a fitness that has seen a random view, its volume and colours, planes, and draws."""
    draw = np.random.default_rng(seed)
    volume = draw.integers(0, 256, (ROWS, COLUMNS, LABELS)).astype(np.uint8)
    colour = draw.integers(0, 60, (ROWS, COLUMNS, 3)).astype(np.uint8)
    fitness = PlaneFitness(ROWS, COLUMNS, LABELS)
    fitness.set_view(POOL, volume, origin, colour, colour.astype(np.float32) / 8,
                     draw.uniform(0, 1, (ROWS, COLUMNS)).astype(np.float32))
    planes = draw.uniform(-0.2, 0.2, (2, ROWS, 3, COLUMNS)).astype(np.float32)
    row, column = np.indices((ROWS, COLUMNS))       # around the labels at their own pixels
    planes[:, :, 2] = draw.uniform(-1, LABELS, (2, ROWS, COLUMNS)) - planes[:, :, 0] * column \
        - planes[:, :, 1] * row
    return fitness, volume, colour, planes, draw


def cost_at(volume, row, column, label, slanted):
    """Return the cost of a whole label, beyond the other image what the last one inside costs."""
    last = COLUMNS - 1 - column if slanted else label
    if slanted and 0 <= last < label:
        return max(float(volume[row, COLUMNS - 1, last]), 128.0)
    place = column + slanted * label
    return float(volume[row, place, label]) if 0 <= place < COLUMNS else 128.0


def plane_costs(volume, colour, planes, origin):
    """Return what planes, (R, 3, C), cost over their supports, from the definition: (R, C)."""
    away = abs(colour.astype(int)[:, :, None, None] - colour).sum(axis=4)
    row, column = np.indices((ROWS, COLUMNS))
    down, right = (abs(places - places[..., None, None]) for places in (row, column))
    alike = np.floor(255 * np.exp(-away / 20) + 0.5)
    pure = np.maximum((alike * (np.maximum(down, right) <= 2)).sum(axis=(2, 3)) / (255 * 25), 0.1)
    reach = SUPPORT_RADIUS * SUPPORT_STRIDE
    support = ((np.maximum(down, right) <= reach) & (down % SUPPORT_STRIDE == 0)
               & (right % SUPPORT_STRIDE == 0))
    weights = support * np.floor(
        255 * np.exp(-away / 20) * np.exp(-(down**2 + right**2) / 128) * pure + 0.5)
    found = np.zeros((ROWS, COLUMNS))
    for y, x in np.ndindex(ROWS, COLUMNS):
        a, b, c = planes[y, :, x].astype(float)
        disparity = a * column + b * row + c
        within = np.clip(disparity, 0, LABELS - 1)
        costs = np.where((disparity < -0.5) | (disparity > LABELS - 0.5), 255.0, 0.0)
        for place in zip(*np.nonzero((weights[y, x] > 0) & (costs == 0))):
            at = place[0], place[1] if origin is None else origin - place[1]
            costs[place] = np.interp(within[place], range(LABELS), [
                cost_at(volume, *at, label, origin is not None) for label in range(LABELS)])
        found[y, x] = (weights[y, x] * costs).sum() / weights[y, x].sum()
    return found * 1024 / 255


@pytest.mark.parametrize('origin', [None, COLUMNS - 1, COLUMNS + 2, COLUMNS - 5])
def test_planes_cost_means_over_their_supports_and_maps_the_differences_of_neighbours_too(origin):
    fitness, volume, colour, (planes, _), draw = looked(origin or 0, origin)
    costs = fitness.match_costs(POOL, planes)
    np.testing.assert_allclose(costs, plane_costs(volume, colour, planes, origin), atol=1.5)
    selected = draw.random((ROWS, COLUMNS)) < 0.5
    np.testing.assert_array_equal(fitness.match_costs(POOL, planes, selected),
                                  np.where(selected, costs, 0))
    total, place = costs.sum(), np.indices((ROWS, COLUMNS)).astype(float)
    for axis, weights in zip((1, 0), fitness._smoothness):
        (one, y1, x1), (other, y2, x2) = (
            (np.delete(np.moveaxis(planes, 1, 0).astype(float), end, axis + 1),
             *np.delete(place, end, axis + 1)) for end in (0, -1))
        apart = sum(abs((one[0] - other[0]) * x + (one[1] - other[1]) * y + one[2] - other[2])
                    for y, x in ((y1, x1), (y2, x2)))
        total += (np.delete(weights, 0, axis) * np.minimum(apart, LARGEST_DIFFERENCE)).sum()
    assert fitness.total(POOL, planes, costs) == pytest.approx(total, abs=2 * ROWS * COLUMNS)


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_an_exchange_has_the_exact_change_of_any_choice_of_cells(seed):
    fitness, _, _, parents, draw = looked(seed)
    fitness.trusted[:] = draw.random((ROWS, COLUMNS)) < 0.7
    selected = draw.random((ROWS, COLUMNS)) < 0.6
    priced = [(planes, fitness.trusted_costs(fitness.match_costs(POOL, planes)))
              for planes in parents]
    exchange = Exchange(ROWS, COLUMNS, 4)
    fitness.fill(exchange, *priced, selected)
    np.testing.assert_array_equal(exchange.cells, np.flatnonzero(selected))
    pairs = np.zeros(exchange.pairs.shape, bool)
    for index, _, side in pairs_of(exchange):
        pairs[index, side] = True
    assert not exchange.pairs[~pairs].any()
    taken, before = draw.random(exchange.cells.size) < 0.5, fitness.total(POOL, *priced[0])
    row, column = np.divmod(exchange.cells[taken], COLUMNS)
    for ours, theirs in zip(*priced):
        ours[row, ..., column] = theirs[row, ..., column]
    assert fitness.total(POOL, *priced[0]) - before == change_of(exchange, taken)


def test_planes_are_found_among_outliers_and_averaged_with_segments_that_are_not_curved():
    draw, (row, column) = np.random.default_rng(2), np.indices((40, 60))
    labels = (column // 30).astype(np.int32)
    planes = np.array([[0.1, -0.05, 9], [-0.2, 0.1, 20]])
    truth = np.einsum('rci,irc->rc', planes[labels], (column, row, np.ones_like(row)))
    disparity = np.where(draw.random(truth.shape) < 0.3, 60, truth).astype(np.float32)
    found = region_planes(POOL, disparity, np.ones(disparity.shape, bool), listed(labels, 2),
                          Random((3,)))
    np.testing.assert_allclose(found, planes, atol=0.02)

    truth[:, 30:] = 0.02 * (column[:, 30:] - 45.0)**2
    noise = draw.uniform(-0.2, 0.2, truth.shape)
    disparity, flat = (truth + noise).astype(np.float32), labels == 0
    disparity[3:6, 3:6] += 2
    flat[3:6, 3:6] = False
    view = SimpleNamespace(pool=POOL, fitness=PlaneFitness(40, 60, 16),
                           segments=[None, listed(labels, 2)])
    found = averaged_with_planes(view, disparity, disparity, Random((0,)))
    np.testing.assert_array_equal(found[~flat], disparity[~flat])
    np.testing.assert_allclose((found - truth)[flat], noise[flat] / 2, atol=0.03)


def plain_segments(values, scale, smallest):
    """Return segments by the paper's rule, sets joined edge by edge."""
    rows, columns = values.shape[:2]
    edges = [(int(np.sqrt(((values[row, column] - values[y, x])**2).sum()) * 16 + 0.5),
              2 * (row * columns + column) + side, row * columns + column, y * columns + x)
             for row, column in np.ndindex(rows, columns)
             for side, (y, x) in enumerate(((row, column - 1), (row - 1, column)))
             if y >= 0 and x >= 0]
    label, inner = np.arange(rows * columns), {}
    for few in (False, True):
        for level, _, one, other in sorted(edges):
            one, other = label[one], label[other]
            sizes = (label == one).sum(), (label == other).sum()
            join = min(sizes) < smallest if few else level / 16 <= min(
                inner.get(mine, 0) + scale / size for mine, size in zip((one, other), sizes))
            if one != other and join:
                inner[one] = max(0 if few else level / 16, inner.get(one, 0))
                label[label == other] = one
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
    assert len(set(zip(labels.flat, expected.flat))) == count
    assert (np.diff(np.unique(labels, return_index=True)[1]) > 0).all()


@given(st.integers(0, 10**6))
def test_regions_list_each_pixel_once(seed):
    labels = np.random.default_rng(seed).permutation(np.arange(17 * 23) % 9).reshape(17, 23)
    regions = listed(labels.astype(np.int32), 9)
    np.testing.assert_array_equal(np.sort(regions.pixels), np.arange(17 * 23))
    for region in range(regions.number):
        pixels = regions.pixels[regions.starts[region]:regions.starts[region + 1]]
        assert pixels.size and (labels.reshape(-1)[pixels] == region).all()


def rejected(dearer, trusted=True, labels=0, rows=LEAST):
    """Return which columns of cells may move; dearer: their costs, in tenths of the price."""
    def repeated(values, kind):
        return np.broadcast_to(values, (rows, 5)).astype(kind)

    selected, old = repeated(True, bool), repeated(0, np.float32)
    reject_unfounded(
        repeated(labels, np.int32), (old, old.astype(np.int32)),
        (repeated(np.where(np.array(dearer) == 0, 0.1, 2), np.float32),
         repeated(np.multiply(dearer, PRICE / 10), np.int32)), repeated(trusted, bool), selected)
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
    own, other = np.array([[[0, 1, 2, 2, 1, 5]], [[0, 2.5, 2, 4, 1.5, 0]]], np.float32)
    for most, expected in ((0, [CONSISTENT] * 2 + [INVALID] + [CONSISTENT] * 2 + [INVALID]),
                           (1, [OUTSIDE])):
        validity = np.zeros((1, 6), np.uint8)
        compare_views(own, other, most, np.float32(1), validity, 0, 1)
        assert validity[0].tolist()[:len(expected)] == expected


@given(st.integers(1, 900), st.integers(1, 60), st.integers(1, 50000))
def test_strips_cover_all_rows_once_with_rows_around_them(rows, reach, most):
    strips, height = cut_strips(rows, 10, reach, most)
    all_rows = range(rows)
    assert [row for strip in strips for row in all_rows[strip.rows]] == list(all_rows)
    for strip in strips:
        around = all_rows[strip.around]
        assert len(around) == height and around[strip.here] == all_rows[strip.rows]
        assert around[0] <= max(strip.rows.start - reach, 0)
        assert around[-1] + 1 >= min(strip.rows.stop + reach, rows)
