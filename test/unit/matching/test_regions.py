# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mutation of realtime: plain regions by the evidence of all their pixels, weak ones by planes."""
from functools import cache

import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.planes.plain_texture import COLUMNS_AROUND
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS, SURE
from fuzzy_stereo_ros.matching.realtime.half_size import SmallResult
from fuzzy_stereo_ros.matching.realtime.matcher import Stages
from fuzzy_stereo_ros.matching.realtime.operators import GreyRegions, NotMutated
from fuzzy_stereo_ros.matching.realtime.plain_regions import (
    BURNT, CLIP, elect, GROUPS, LEAST_CLIP, NEAREST, PLAIN_STEP, PlainRegions)
from fuzzy_stereo_ros.matching.realtime.views import Views
from hypothesis import example, given, settings, strategies as st
from made_scenes import bits
import numpy as np
import pytest
import reference_plain_regions as twins
import reference_regions

POOL, DISPARITIES, WALL, OBJECT = ThreadPool(1), 40, 13, 25
SIZE = 201, 321


@cache
def wall(noise=2.0, texture=0.25, size=SIZE, disparity=WALL, seed=1, reach=40):
    """
    Return a noisy pair, uint8, of a plain wall behind a textured object, and its truth.

    reach: of the object up and down; one of the whole height divides the wall into two regions
    """
    draw, (rows, columns) = np.random.default_rng(seed), size
    y, x = np.indices(size, np.float32)
    faint, strong = (cv2.GaussianBlur(draw.normal(size=(rows, columns + 200)), None, sigma)
                     for sigma in (1.3, 1.0))

    def picture(of_wall, of_object):
        base, seen = (120 + contrast * cv2.remap(
            random / random.std(), x + np.float32(moved), y, cv2.INTER_CUBIC)
            for contrast, random, moved in ((texture, faint, of_wall), (40, strong, of_object)))
        there = (abs(y - rows / 2) < reach) & (abs(x + of_object - 250) < 30)
        noisy = np.where(there, seen, base) + draw.normal(0, noise, size)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), there
    left, there = picture(60, 60)
    # the wall's column x in the right image shows column x + d of the left one
    right, _ = picture(60 + disparity, 60 + OBJECT)
    return left, right, np.where(there, np.float32(OBJECT), np.float32(disparity))


def matched(pair, stages=None, **changes):
    """Return the `Match` of a pair, matched cold and filled, and the algorithm."""
    matcher = StereoMatcher(MatcherConfig(**{
        'disparities': DISPARITIES, 'fill': True, 'warm_start': False, 'threads': 1, **changes}),
        stages)
    return matcher.match(*pair[:2]), matcher.algorithm


def mutate(plain_regions, label, prior, matched):
    """
    Find the plain regions of the last pair again, for a half map of one label, full size.

    matched: whether it is consistent, else half of it is
    """
    half = np.full([side // 2 for side in prior.labels.shape], label // 2, np.uint8)
    half[:, 1::2] += label % 2
    prior.weights[:] = 0
    plain_regions.find(POOL)
    validity = np.full_like(half, CONSISTENT)
    validity[::2] = CONSISTENT if matched else INVALID
    plain_regions.mutate(POOL, SmallResult(half, validity, None, 0, prior, np.full(
        prior.labels.shape, SURE, np.uint8)))


def wrong(disparity, truth):
    """Return the share of a map that is wrong, away from what the wall's left end hides."""
    return (abs(disparity - truth) > 1)[:, 2 * OBJECT:].mean()


def test_a_plain_wall_in_noise_takes_the_plane_that_all_of_it_votes_for():
    for pair in (wall(), wall(seed=2, reach=999)):
        without, _ = matched(pair, Stages(vote=NotMutated))
        assert wrong(without.disparity, pair[2]) > 0.25
        assert wrong(matched(pair)[0].disparity, pair[2]) < 0.03
    textured = np.random.default_rng(2).integers(0, 255, SIZE).astype(np.uint8)
    pair = textured, np.roll(textured, -9, 1)
    match, algorithm = matched(pair)
    assert algorithm._plain_regions._found is None
    assert bits(match) == bits(matched(pair, Stages(vote=NotMutated))[0])


def test_a_plain_wall_that_windows_match_keeps_its_map_without_a_vote():
    for seed in range(3):
        pair = wall(noise=0.3, texture=1.2, seed=seed)
        match, algorithm = matched(pair)
        regions = algorithm._plain_regions
        assert len(regions._found.places) and not regions._voting
        without, _ = matched(pair, Stages(vote=NotMutated))
        np.testing.assert_array_equal(match.disparity, without.disparity)
        assert wrong(match.disparity, pair[2]) < 0.03


def test_a_wall_that_its_votes_do_not_decide_is_not_confident():
    """Of what is sure in walls of no to enough texture, away from the object, all is right."""
    sure, wrong, decided = 0, 0, []
    for seed in range(12):
        draw = np.random.default_rng(seed)
        left, right, truth = wall(
            noise=draw.uniform(1, 3), texture=draw.choice((0, 0.1, 0.2, 0.4)),
            disparity=float(draw.integers(5, 20)), seed=seed)
        match, _ = matched((left, right))
        confident = (match.confidence >= 0.8)[:50, 2 * OBJECT:]
        sure += confident.sum()
        wrong += (confident & (abs(match.disparity - truth) > 1)[:50, 2 * OBJECT:]).sum()
        decided.append(confident.mean() > 0.5)
    assert wrong < 0.01 * sure
    assert 2 < sum(decided) < 10


@pytest.mark.parametrize('disparity, noise, min_disparity', [
    (0, 0.5, 0), (0, 0.5, -8), (WALL, 2.0, 0)])
def test_what_stays_at_disparity_0_and_what_the_map_knows_already_are_no_evidence(
        disparity, noise, min_disparity):
    _, algorithm = matched(wall(disparity=disparity, noise=noise), min_disparity=min_disparity)
    prior = algorithm._half_size.result.prior
    mutate(algorithm._plain_regions, disparity, prior, disparity > 0)
    assert not prior.weights.any()


@pytest.mark.parametrize('size, min_disparity', [
    ((66, 97), 0), ((145, 120), 0), ((66, 97), -6), ((66, 97), 5)])
def test_evidence_is_that_of_the_twin(size, min_disparity):
    pair = wall(size=size, noise=0.7)
    views = Views(MatcherConfig(disparities=DISPARITIES, min_disparity=min_disparity), *size)
    views.read(POOL, *pair[:2])
    views.smooth(POOL)
    views.describe(POOL)
    plain = PlainRegions(views, min_disparity)
    mutate(plain, 10, Prior(*np.zeros((2, *size), np.uint8)), False)
    places, (curves, counts, _) = plain._found.places, plain._found.votes

    masks, textures = [], []
    for texture in (plain._left, plain._right):
        view, of_half = texture.view, texture.half
        luminance = of_half.luminance[:of_half.rows + 4, :of_half.columns + 4]
        steps = twins.flatness(luminance, BURNT << 8)
        plain_mask = twins.plain_mask(steps, int(64 * PLAIN_STEP))
        np.testing.assert_array_equal(texture.plain.mask[:, :of_half.columns], plain_mask)
        columns = texture._offset + np.arange(2 * of_half.columns)
        if texture is plain._right:     # both columns of a pixel of half size exist
            existing = size[1] - 1 - columns.reshape(-1, 2)
            first, last = views.full.target_range
            plain_mask &= ((first <= existing) & (existing <= last)).all(1)
        wide = np.zeros((of_half.rows, view.columns), bool)
        wide[:, columns] = plain_mask.repeat(2, 1)
        masks.append(wide)
        textures.append(twins.bands(
            view.luminance[:view.rows + 4, :view.columns + 4], wide,
            lambda total, count: max(CLIP * total // max(count, 1), LEAST_CLIP)))
        np.testing.assert_array_equal(
            texture.bands.values[:, :, COLUMNS_AROUND:][:, :, :view.columns],
            textures[-1])
    numbers = twins.regions(
        plain._left.plain.mask[:, :size[1] // 2], plain._regions._least)
    assert numbers.max() + 1 == len(places) > 0
    found = twins.vote(textures[0], textures[1][:, :, ::-1], masks[1][:, ::-1], numbers,
                       DISPARITIES) if min_disparity == 0 else {}
    for cell, (curve, count) in found.items():
        np.testing.assert_array_equal(curves[places[cell], :, :DISPARITIES], curve)
        np.testing.assert_array_equal(counts[places[cell], :DISPARITIES], count)
    if min_disparity == 0:
        election = elect(plain._found.votes, places, DISPARITIES, NEAREST)
        expected = [twins.elect(found, of_region, DISPARITIES, NEAREST, GROUPS)
                    for of_region in range(numbers.max() + 1)]
        np.testing.assert_allclose(
            np.column_stack([election.best, election.shares]), expected)


# ---- regions of weak texture and their planes ----

LABELS = 24


def patches(seed, rows, columns):
    """Return grey of patches with noise, uint16 (r, c), and flags of weak texture, uint8."""
    draw = np.random.default_rng(seed)
    grey = draw.integers(0, 6, (rows // 3 + 1, columns // 5 + 1)).repeat(3, 0).repeat(5, 1)
    grey = 500 * grey[:rows, :columns] + draw.integers(0, 500, (rows, columns))
    return grey.astype(np.uint16), (draw.random((rows, columns)) < 0.95).astype(np.uint8)


@settings(max_examples=60)
@given(st.integers(0, 2**20), st.integers(1, 12), st.integers(1, 25),
       st.sampled_from([1, 3, 7, 200]), st.integers(1, 5),
       st.sampled_from([(0, 42), (-4, 30), (3, 50)]))
@example(3, 130, 7, 7, 5, (0, 42))     # two bands
def test_regions_their_points_and_mutants_are_those_of_the_twins_however_rows_are_cut(
        seed, rows, columns, most, parts, inside):
    grey, weak = patches(seed, rows, columns)
    found = GreyRegions(rows, columns, (400, 3), 6)
    found.grow(POOL, np.pad(grey, MARGIN, 'edge'), weak)
    regions, number, numbers = found.regions, found.number, np.full(grey.shape, -1)
    (begin, end, _, region), row_runs = regions
    for row in range(rows):
        for run in range(*row_runs[row]):
            numbers[row, begin[run]:end[run]] = region[run]
    np.testing.assert_array_equal(numbers, reference_regions.regions(grey, weak, 400, 200, 3, 6))
    assert number == numbers.max() + 1

    draw, full = np.random.default_rng(seed), (2 * rows + 1, 2 * columns + 1)
    bands = [(index, cut[0], cut[-1] + 1) for index, cut in enumerate(
        np.array_split(np.arange(rows), min(parts, rows)))]
    labels = draw.integers(0, LABELS, full).astype(np.uint8)
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
        np.testing.assert_allclose(mine, reference_regions.points(
            numbers, region, most, labels + offsets / STEPS, validity == CONSISTENT),
            rtol=0, atol=1e-6)
        assert mine.shape[1] <= most

    planes = draw.integers(-8, 8, (number, 3)).astype(np.float32) / 64
    planes[:, 2] = draw.integers(-2, LABELS + 2, number) + np.float32(0.3)
    planes[draw.random(number) < 0.2] = np.nan
    child = labels.copy()
    for _, first, last in bands:
        segments.write_mutant(
            regions, planes, LABELS, np.array(inside), child, first, last)
    np.testing.assert_array_equal(child, reference_regions.mutant(
        numbers, planes.astype(float), LABELS, inside, labels))


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
    segments.fit_planes(points, np.array([0, number], np.int32), np.uint64(5), found)
    if share < 0.6 or number < 150 or in_a_line:
        assert np.isnan(found).all()
    else:
        assert abs(found[0] @ (30, 30, 1) - plane @ (30, 30, 1)) < 0.1
        assert abs(found[0] - plane)[:2].max() < 0.01


def in_texture(fill=True, **options):
    """Return the matcher of a plain wall in texture, of which a part does not match; its match."""
    draw = np.random.default_rng(2)
    scene = draw.integers(40, 200, (30, 46)).repeat(4, axis=0).repeat(4, axis=1)
    scene[16:104, 24:160] = 120 + draw.integers(0, 2, (88, 136))
    pair = [scene[:, left:left + 160].astype(np.uint8) for left in (0, 6)]
    for image in pair:
        image[40:80, 70:110] = 120 + draw.integers(0, 2, (40, 40))
    matcher = StereoMatcher(
        MatcherConfig(disparities=LABELS, threads=1, fill=fill), Stages(**options))
    return matcher, matcher.match(*pair)


def test_an_accepted_mutation_gains_fitness_and_no_confidence():
    (without, _), (matcher, match) = in_texture(mutation=NotMutated), in_texture()
    before, after = (one.algorithm.population.genes[0].astype(int) for one in (without, matcher))
    worse, better = (matcher.algorithm._fitness.measure(POOL, genes, every=1)[0]
                     for genes in (before, after))
    gained = better - worse
    assert gained > 0
    assert match.history[0].gains['planes'] == pytest.approx(gained, abs=1e-12)
    changed = abs(after - before) > 1
    assert changed.any() and (match.confidence[changed] == 0).all()
    assert np.isnan(in_texture(fill=False)[1].disparity[changed]).all()
