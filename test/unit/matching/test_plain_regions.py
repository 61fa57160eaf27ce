# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mutation of plain regions by the evidence of all of their pixels."""
from functools import cache

import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.planes.plain_texture import COLUMNS_AROUND
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior
from fuzzy_stereo_ros.matching.over_frames.pictures import NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.half_size import SmallResult, SURE
from fuzzy_stereo_ros.matching.realtime.matcher import Stages
from fuzzy_stereo_ros.matching.realtime.operators import NotMutated
from fuzzy_stereo_ros.matching.realtime.plain_regions import (
    BURNT, CLIP, elect, GROUPS, LEAST_CLIP, NEAREST, PLAIN_STEP, PlainRegions)
from fuzzy_stereo_ros.matching.realtime.views import Views
from made_scenes import bits
import numpy as np
import pytest
import reference_plain_regions as twins

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


def mutate(plain_regions, label, prior):
    """Find the plain regions of the last pair again, for a half map of one label, full size."""
    half = np.full([side // 2 for side in prior.labels.shape], label // 2, np.uint8)
    half[:, 1::2] += label % 2
    prior.weights[:] = 0
    plain_regions.find(POOL)
    plain_regions.split(POOL)
    plain_regions.mutate(POOL, SmallResult(half, np.zeros_like(half), None, 0, prior, np.full(
        prior.labels.shape, SURE, np.uint8)))


def wrong(disparity, truth):
    """Return the share of a map that is wrong, away from what the wall's left end hides."""
    return (abs(disparity - truth) > 1)[:, 2 * OBJECT:].mean()


def test_a_plain_wall_in_noise_takes_the_plane_that_all_of_it_votes_for():
    for pair in (wall(), wall(seed=2, reach=999)):
        without, _ = matched(pair, Stages(vote=NotMutated))
        assert wrong(without.disparity, pair[2]) > 0.3
        assert wrong(matched(pair)[0].disparity, pair[2]) < 0.03
    textured = np.random.default_rng(2).integers(0, 255, SIZE).astype(np.uint8)
    pair = textured, np.roll(textured, -9, 1)
    match, algorithm = matched(pair)
    assert algorithm._plain_regions._found is None
    assert bits(match) == bits(matched(pair, Stages(vote=NotMutated))[0])


def test_a_wall_that_its_votes_do_not_decide_is_not_confident():
    """Of what is sure in walls of no to enough texture, away from the object, all is right."""
    sure, wrong, decided = 0, 0, []
    for seed in range(24):
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
    assert 5 < sum(decided) < 19


@pytest.mark.parametrize('disparity, noise, min_disparity', [
    (0, 0.5, 0), (0, 0.5, -8), (WALL, 2.0, 0)])
def test_what_stays_at_disparity_0_and_what_the_map_knows_already_are_no_evidence(
        disparity, noise, min_disparity):
    _, algorithm = matched(wall(disparity=disparity, noise=noise), min_disparity=min_disparity)
    prior = algorithm._half_size.result.prior
    mutate(algorithm._plain_regions, disparity, prior)
    assert not prior.weights.any()


@pytest.mark.parametrize('min_disparity', (0, -6, 5))
@pytest.mark.parametrize('size', ((66, 97), (145, 120)))
def test_evidence_is_that_of_the_twin(size, min_disparity):
    pair = wall(size=size, noise=0.7)
    views = Views(MatcherConfig(disparities=DISPARITIES, min_disparity=min_disparity), *size,
                  NoiseEstimate)
    views.read(POOL, *pair[:2])
    views.estimate(POOL)
    views.smooth(POOL)
    views.describe(POOL, Stages().describe)
    plain = PlainRegions(views, min_disparity)
    mutate(plain, 10, Prior(*np.zeros((2, *size), np.uint8)))
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
