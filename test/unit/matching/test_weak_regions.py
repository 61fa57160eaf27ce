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


def patches(seed, rows, columns):
    """Return grey of patches with noise, uint16 (r, c), and flags of weak texture, uint8."""
    draw = np.random.default_rng(seed)
    grey = draw.integers(0, 6, (rows // 3 + 1, columns // 5 + 1)).repeat(3, 0).repeat(5, 1)
    grey = 500 * grey[:rows, :columns] + draw.integers(0, 500, (rows, columns))
    return grey.astype(np.uint16), (draw.random((rows, columns)) < 0.95).astype(np.uint8)


def grown(grey, weak):
    """Return the regions of a picture, as kernels write them, how many, and their numbers."""
    found = GreyRegions(*grey.shape, (400, 3), 6)
    found.grow(ThreadPool(1), np.pad(grey, MARGIN, 'edge'), weak)
    (begin, end, _, region), row_runs = found.regions
    numbers = np.full(grey.shape, -1)
    for row in range(len(grey)):
        for run in range(*row_runs[row]):
            numbers[row, begin[run]:end[run]] = region[run]
    return found.regions, found.number, numbers


@settings(max_examples=60)
@given(st.integers(0, 2**20), st.integers(1, 12), st.integers(1, 25),
       st.sampled_from([1, 3, 7, 200]), st.integers(1, 5),
       st.sampled_from([(0, 42), (-4, 30), (3, 50)]))
@example(3, 130, 7, 7, 5, (0, 42))     # two bands
def test_regions_their_points_and_mutants_are_those_of_the_twins_however_rows_are_cut(
        seed, rows, columns, most, parts, inside):
    grey, weak = patches(seed, rows, columns)
    regions, number, numbers = grown(grey, weak)
    np.testing.assert_array_equal(numbers, twins.regions(grey, weak, 400, 200, 3, 6))
    assert number == numbers.max() + 1

    draw, full = np.random.default_rng(seed), (2 * rows + 1, 2 * columns + 1)
    bands = [(index, cut[0], cut[-1] + 1) for index, cut in enumerate(
        np.array_split(np.arange(rows), min(parts, rows)))]
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
    for region in range(number):
        mine = found[:, starts[region]:starts[region + 1]]
        np.testing.assert_allclose(mine, twins.points(
            numbers, region, most, labels + offsets / STEPS, validity == CONSISTENT),
            rtol=0, atol=1e-6)
        assert mine.shape[1] <= most

    planes = draw.integers(-8, 8, (number, 3)).astype(np.float32) / 64
    planes[:, 2] = draw.integers(-2, DISPARITIES + 2, number) + np.float32(0.3)
    planes[draw.random(number) < 0.2] = np.nan
    child = labels.copy()
    for _, first, last in bands:
        segments.write_mutant(
            regions, planes, DISPARITIES, np.array(inside), child, first, last)
    np.testing.assert_array_equal(child, twins.mutant(
        numbers, planes.astype(float), DISPARITIES, inside, labels))


@settings(max_examples=60)
@given(st.integers(0, 2**20), st.sampled_from([0, 1, 5, 150]),
       st.sampled_from([0.55, 0.67, 1.0]), st.booleans())
def test_a_plane_is_found_if_two_thirds_of_enough_points_that_are_not_in_a_line_lie_on_it(
        seed, number, share, in_a_line):
    draw, plane = np.random.default_rng(seed), np.array((0.1, -0.2, 9.0))
    x, y = draw.integers(0, 60, (2, number)) * [[1], [not in_a_line]]
    d = plane @ (x, y, np.ones(number)) + draw.uniform(-0.05, 0.05, number)
    d[round(share * number):] += draw.choice([-9, -5, 6, 12], number - round(share * number))
    points, found = np.array([x, y, d], np.float32), np.zeros((1, 3), np.float32)
    segments.fit_planes(points, np.array([0, number], np.int32), np.uint64(5), found, 0, 1)
    if share < 0.6 or number < 150 or in_a_line:
        assert np.isnan(found).all()
    else:
        assert abs(found[0] @ (30, 30, 1) - plane @ (30, 30, 1)) < 0.1
        assert abs(found[0] - plane)[:2].max() < 0.01


def matched(fill=True, **options):
    """Return the matcher of a plain wall in texture, of which a part does not match; its match."""
    draw = np.random.default_rng(2)
    scene = draw.integers(40, 200, (30, 46)).repeat(4, axis=0).repeat(4, axis=1)
    scene[16:104, 24:160] = 120 + draw.integers(0, 2, (88, 136))
    pair = [scene[:, left:left + 160].astype(np.uint8) for left in (0, 6)]
    for image in pair:
        image[40:80, 70:110] = 120 + draw.integers(0, 2, (40, 40))
    matcher = StereoMatcher(
        MatcherConfig(disparities=DISPARITIES, threads=1, fill=fill), Stages(**options))
    return matcher, matcher.match(*pair)


def test_an_accepted_mutation_gains_fitness_and_no_confidence():
    (without, _), (matcher, match) = matched(mutation=NotMutated), matched()
    fitness_of = matcher.algorithm.fitness_of
    before, after = (one.algorithm.population.genes[0].astype(int) for one in (without, matcher))
    gained = fitness_of(after) - fitness_of(before)
    assert gained > 0
    assert match.history[0].gains['planes'] == pytest.approx(gained, abs=1e-12)
    changed = abs(after - before) > 1
    assert changed.any() and (match.confidence[changed] == 0).all()
    assert np.isnan(matched(fill=False)[1].disparity[changed]).all()
