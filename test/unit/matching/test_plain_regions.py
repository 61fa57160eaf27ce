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
import numpy as np
import pytest
import reference_plain_regions as twins

DISPARITIES, WALL, OBJECT = 40, 13, 25
SIZE = 201, 321


@cache
def wall(noise=2.0, texture=0.25, slope=0.0, offset=0, size=SIZE, disparity=WALL, seed=1):
    """Return a noisy pair, uint8, of a plain wall behind a textured object, and its truth."""
    draw, (rows, columns) = np.random.default_rng(seed), size
    faint = cv2.GaussianBlur(draw.normal(size=(rows, columns + 200)), None, 1.3)
    strong = cv2.GaussianBlur(draw.normal(size=(rows, columns + 200)), None, 1.0)
    y, x = np.indices(size, np.float32)
    truth = np.float32(disparity + slope * (x - columns / 2))

    def picture(of_wall, of_object):
        base = 120 + texture * cv2.remap(faint / faint.std(), x + of_wall, y, cv2.INTER_CUBIC)
        there = (abs(y - rows / 2) < 40) & (abs(x + of_object - 250) < 30)
        seen = 120 + 40 * cv2.remap(strong / strong.std(), x + of_object, y, cv2.INTER_CUBIC)
        noisy = np.where(there, seen, base) + offset + draw.normal(0, noise, size)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), there
    left, there = picture(np.float32(60), np.float32(60))
    # the wall's column x in the right image shows column x + d of the left one
    moved = (x + disparity - slope * columns / 2) / (1 - slope) - x
    right, _ = picture(60 + moved, np.float32(60 + OBJECT))
    truth[there] = OBJECT
    return left, right, truth


def made(stages=None, **changes):
    """Return a matcher of filled maps without a warm start."""
    return StereoMatcher(MatcherConfig(**{
        'disparities': DISPARITIES, 'fill': True, 'warm_start': False, 'threads': 1, **changes}),
        stages)


def matched(pair, **options):
    """Return the map and the algorithm of a pair, matched cold."""
    matcher = made(**options)
    return matcher.match(*pair[:2]).disparity, matcher.algorithm


def half_size_result(labels, prior):
    """Return the `SmallResult` of consistent labels."""
    return SmallResult(labels, np.zeros(labels.shape, np.uint8), None, 0, prior,
                       np.full(prior.labels.shape, SURE, np.uint8))


def found_and_mutated(plain_regions, pool, half):
    """Find the plain regions of a pair, and give them their planes; half: see mutate."""
    plain_regions.find(pool)
    plain_regions.split(pool)
    plain_regions.mutate(pool, half)


def mutate(algorithm, labels, prior):
    """Find the plain regions of the last pair again, and write their planes into a map."""
    found_and_mutated(algorithm._plain_regions, algorithm.pool, half_size_result(labels, prior))


def wrong(disparity, truth):
    """Return the share of a map that is wrong, away from what the wall's left end hides."""
    return (abs(disparity - truth) > 1)[:, 2 * OBJECT:].mean()


def views_of(pair, min_disparity=0):
    """Return the `Views` of a pair, read and described."""
    config = MatcherConfig.from_profile(
        'realtime', disparities=DISPARITIES, min_disparity=min_disparity)
    views, pool = Views(config, *pair[0].shape[:2], NoiseEstimate), ThreadPool(1)
    views.read(pool, *pair[:2])
    views.estimate(pool)
    views.smooth(pool)
    views.describe(pool, Stages().describe)
    return views


def test_a_plain_wall_in_noise_takes_the_plane_that_all_of_it_votes_for():
    pair = wall()
    without, _ = matched(pair, stages=Stages(vote=NotMutated))
    disparity, _ = matched(pair)
    assert wrong(without, pair[2]) > 0.3
    assert wrong(disparity, pair[2]) < 0.03


def test_a_wall_that_its_votes_do_not_decide_is_not_confident():
    """Of what is sure in walls of no to enough texture, away from the object, all is right."""
    sure, wrong, decided = 0, 0, []
    for seed in range(24):
        draw = np.random.default_rng(seed)
        left, right, truth = wall(
            noise=draw.uniform(1, 3), texture=draw.choice((0, 0.1, 0.2, 0.4)),
            disparity=float(draw.integers(5, 20)), seed=seed)
        match = made().match(left, right)
        confident = (match.confidence >= 0.8)[:50, 2 * OBJECT:]
        sure += confident.sum()
        wrong += (confident & (abs(match.disparity - truth) > 1)[:50, 2 * OBJECT:]).sum()
        decided.append(confident.mean() > 0.5)
    assert wrong < 0.01 * sure
    assert 5 < sum(decided) < 19


def test_what_stays_at_disparity_0_is_no_evidence():
    pair = wall(disparity=0, noise=0.5)
    for min_disparity in (0, -8):
        _, algorithm = matched(pair, min_disparity=min_disparity)
        half = np.zeros((SIZE[0] // 2, SIZE[1] // 2), np.uint8)
        prior = algorithm._half_size.result.prior
        prior.weights[:] = 0
        mutate(algorithm, half, prior)
        assert not prior.weights.any()


def test_a_textured_picture_is_matched_to_the_same_bits():
    draw = np.random.default_rng(2)
    left = draw.integers(0, 255, SIZE).astype(np.uint8)
    pair = left, np.roll(left, -9, 1)
    with_it, algorithm = matched(pair)
    assert algorithm._plain_regions._found is None
    np.testing.assert_array_equal(with_it, matched(pair, stages=Stages(vote=NotMutated))[0])


def test_a_map_that_knows_better_than_a_plane_is_kept():
    """All of the evidence of a wall is in the map already, so that nothing is taken."""
    pair = wall()
    _, algorithm = matched(pair)
    prior = algorithm._half_size.result.prior
    prior.weights[:] = 0
    half = np.full((SIZE[0] // 2, SIZE[1] // 2), WALL // 2, np.uint8)
    half[:, 1::2] += WALL % 2
    mutate(algorithm, half, prior)
    assert not prior.weights.any()


def clip(size, count):
    """Return at which difference a band is clipped."""
    return max(CLIP * size // max(count, 1), LEAST_CLIP)


@pytest.mark.parametrize('min_disparity', (0, -6, 5))
@pytest.mark.parametrize('size', ((66, 97), (145, 120)))
def test_evidence_is_that_of_the_twin(size, min_disparity):
    pair = wall(size=size, noise=0.7)
    views = views_of(pair, min_disparity)
    plain = PlainRegions(views, min_disparity)
    half = np.full((size[0] // 2, size[1] // 2), 5, np.uint8)
    prior = Prior(np.zeros(size, np.uint8), np.zeros(size, np.uint8))
    found_and_mutated(plain, ThreadPool(1), half_size_result(half, prior))
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
        textures.append(twins.bands(view.luminance[:view.rows + 4, :view.columns + 4], wide, clip))
        np.testing.assert_array_equal(
            texture.bands.values[:, :, COLUMNS_AROUND:][:, :, :view.columns],
            textures[-1])
    numbers = twins.regions(
        plain._left.plain.mask[:, :size[1] // 2], plain._regions._least)
    assert numbers.max() + 1 == len(places) > 0
    found = twins.vote(textures[0], textures[1][:, :, ::-1], masks[1][:, ::-1], numbers,
                       DISPARITIES) if min_disparity == 0 else {}
    for (of_region, row, column), (curve, count) in found.items():
        place = places[of_region, row, column]
        np.testing.assert_array_equal(curves[place, :, :DISPARITIES], curve)
        np.testing.assert_array_equal(counts[place, :DISPARITIES], count)
    if min_disparity == 0:
        election = elect(plain._found.votes, places, DISPARITIES, NEAREST)
        expected = [twins.elect(found, of_region, DISPARITIES, NEAREST, GROUPS)
                    for of_region in range(numbers.max() + 1)]
        np.testing.assert_allclose(
            np.column_stack([election.best, election.shares]), expected)
