# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mutation of realtime: regions of weak texture, their planes, and which of them stay."""

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, STEPS
from fuzzy_stereo_ros.matching.realtime.matcher import Stages
from fuzzy_stereo_ros.matching.realtime.operators import GreyRegions, NotMutated
from hypothesis import example, given, settings, strategies as st
import numpy as np
import pytest
import reference_regions as twins

DISPARITIES = 24


def padded(grey):
    """Return a half-size picture as the matcher has it, with its margin."""
    return np.pad(grey, MARGIN, 'edge')


def patches(seed, rows, columns):
    """Return grey of patches with noise, uint16 (r, c), and flags of weak texture, uint8."""
    draw = np.random.default_rng(seed)
    grey = draw.integers(0, 6, (rows // 3 + 1, columns // 5 + 1)).repeat(3, 0).repeat(5, 1)
    grey = 500 * grey[:rows, :columns] + draw.integers(0, 500, (rows, columns))
    return grey.astype(np.uint16), (draw.random((rows, columns)) < 0.95).astype(np.uint8)


def grown(grey, weak, least=6, overlap=3):
    """Return the regions of a picture, as kernels write them, and how many there are."""
    grown = GreyRegions(*grey.shape, (400, overlap), least)
    grown.grow(ThreadPool(1), padded(grey), weak)
    return grown.regions, grown.number


def as_map(regions, shape):
    """Return the number of each pixel's region, -1 for none: int (r, c)."""
    (begin, end, _, region), row_runs = regions
    numbers = np.full(shape, -1)
    for row in range(shape[0]):
        for run in range(*row_runs[row]):
            numbers[row, begin[run]:end[run]] = region[run]
    return numbers


@settings(max_examples=60)
@given(st.integers(0, 2**20), st.integers(1, 12), st.integers(1, 25))
@example(3, 130, 7)     # two bands
def test_regions_are_the_joined_runs_of_the_twin(seed, rows, columns):
    grey, weak = patches(seed, rows, columns)
    regions, number = grown(grey, weak)
    expected = twins.regions(grey, weak, 400, 200, 3, 6)
    np.testing.assert_array_equal(as_map(regions, grey.shape), expected)
    assert number == expected.max() + 1


@settings(max_examples=40)
@given(st.integers(0, 2**20), st.sampled_from([1, 3, 7, 200]), st.integers(1, 5))
def test_points_are_consistent_matches_evenly_spread_however_rows_are_cut(seed, most, parts):
    shape, draw = (8, 21), np.random.default_rng(seed)
    grey, weak = patches(seed, *shape)
    bands = [(index, rows[0], rows[-1] + 1) for index, rows in enumerate(
        np.array_split(np.arange(shape[0]), parts))]
    regions, number = grown(grey, weak)
    full = 2 * shape[0] + 1, 2 * shape[1] + 1
    labels = draw.integers(0, DISPARITIES, full).astype(np.uint8)
    offsets = draw.integers(-STEPS // 2, STEPS // 2 + 1, full).astype(np.int8)
    validity = draw.integers(0, 3, full).astype(np.uint8)
    counts, places = np.full((2, len(bands), number), -1, np.int32)
    every, starts = np.zeros(number, np.int32), np.zeros(number + 1, np.int32)
    found = np.zeros((3, grey.size), np.float32)
    for index, first, last in bands:
        segments.count_matches(regions, validity, counts[index], first, last)
    segments.place_points(most, counts, every, places, starts)
    for index, first, last in bands:
        segments.gather_points(regions, every, counts[index], places[index],
                               (labels, offsets, validity), found, first, last)
    numbers = as_map(regions, shape)
    for region in range(number):
        mine = found[:, starts[region]:starts[region + 1]]
        expected = twins.points(numbers, region, most, labels + offsets / STEPS,
                                validity == CONSISTENT)
        np.testing.assert_allclose(mine, expected, rtol=0, atol=1e-6)
        assert mine.shape[1] <= most


def fitted(points):
    """Return the plane of some points (3, n)."""
    found = np.zeros((1, 3), np.float32)
    segments.fit_planes(points.astype(np.float32), np.array([0, points.shape[1]], np.int32),
                        np.uint64(5), found, 0, 1)
    return found[0]


def on_a_plane(draw, number, share, plane=(0.1, -0.2, 9.0)):
    """Return points of which a share lies on a plane, the others anywhere."""
    x, y = draw.integers(0, 60, (2, number))
    d = plane[0] * x + plane[1] * y + plane[2] + draw.uniform(-0.05, 0.05, number)
    stray = draw.permutation(number) >= round(share * number)
    return np.array([x, y, np.where(stray, d + draw.choice([-9, -5, 6, 12], number), d)])


@pytest.mark.parametrize('seed', range(8))
def test_a_plane_is_found_among_points_of_which_every_third_lies_elsewhere(seed):
    points = on_a_plane(np.random.default_rng(seed), 150, 0.67)
    found = fitted(points)
    assert abs(found @ (30, 30, 1) - (0.1 * 30 - 0.2 * 30 + 9)) < 0.1
    assert abs(found[:2] - (0.1, -0.2)).max() < 0.01


@pytest.mark.parametrize('seed', range(8))
def test_a_region_whose_points_do_not_agree_enough_has_no_plane(seed):
    assert np.isnan(fitted(on_a_plane(np.random.default_rng(seed), 150, 0.55))).all()


@pytest.mark.parametrize('points', [
    *(on_a_plane(np.random.default_rng(1), number, 1.0) for number in (0, 1, 5)),
    np.array([np.arange(40), np.full(40, 7), np.full(40, 3)])],
    ids=['none', 'one', 'five', 'on a line'])
def test_few_points_and_those_on_a_line_make_no_plane(points):
    assert np.isnan(fitted(points)).all()


@settings(max_examples=40)
@given(st.integers(0, 2**20), st.sampled_from([(0, 42), (-4, 30), (3, 50)]))
def test_the_mutant_takes_labels_of_planes_that_are_farther_than_one(seed, inside):
    shape, draw = (8, 21), np.random.default_rng(seed)
    grey, weak = patches(seed, *shape)
    regions, number = grown(grey, weak)
    found = draw.integers(-8, 8, (number, 3)).astype(np.float32) / 64
    found[:, 2] = draw.integers(-2, DISPARITIES + 2, number) + np.float32(0.3)
    found[draw.random(number) < 0.2] = np.nan
    parent = draw.integers(0, DISPARITIES, (17, 43)).astype(np.uint8)
    child = parent.copy()
    for rows in ((0, 3), (3, 8)):
        segments.write_mutant(regions, found, DISPARITIES, np.array(inside), child, *rows)
    np.testing.assert_array_equal(child, twins.mutant(
        as_map(regions, shape), found.astype(float), DISPARITIES, inside, parent))


# ---- in the matcher ----

def plain_scene():
    """Return a pair: a plain wall in a textured frame, a part of it without what matches."""
    draw = np.random.default_rng(2)
    scene = draw.integers(40, 200, (30, 46)).repeat(4, axis=0).repeat(4, axis=1)
    scene[16:104, 24:160] = 120 + draw.integers(0, 2, (88, 136))
    left, right = scene[:, :160].copy(), scene[:, 6:166].copy()
    for image in (left, right):
        image[40:80, 70:110] = 120 + draw.integers(0, 2, (40, 40))
    return left.astype(np.uint8), right.astype(np.uint8)


def matched(**options):
    """Return the matcher of a plain scene, and its match."""
    matcher = StereoMatcher(MatcherConfig(
        disparities=DISPARITIES, **{'threads': 1, 'fill': True, **options.pop('config', {})}),
        Stages(**options))
    return matcher, matcher.match(*plain_scene())


def test_an_accepted_mutation_makes_the_chromosome_fitter_by_its_gain():
    without, with_planes = matched(mutation=NotMutated), matched()
    fitness_of = with_planes[0].algorithm.fitness_of
    before, after = (matcher.algorithm.population.genes[0] for matcher, _ in (
        without, with_planes))
    assert (before != after).any()
    assert fitness_of(after) > fitness_of(before)
    assert with_planes[1].history[0].gains['planes'] == pytest.approx(
        fitness_of(after) - fitness_of(before), abs=1e-12)


def test_a_disparity_from_a_plane_has_no_confidence():
    (without, _), (matcher, match) = matched(mutation=NotMutated), matched()
    changed = abs(matcher.algorithm.population.genes[0].astype(int)
                  - without.algorithm.population.genes[0].astype(int)) > 1
    assert changed.any()
    assert (match.confidence[changed] == 0).all()
    sparse = matched(config={'fill': False})[1].disparity
    assert np.isnan(sparse[changed]).all()
