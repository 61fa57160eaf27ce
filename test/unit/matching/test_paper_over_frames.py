# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The population of the profile `paper` lives from frame to frame."""
from dataclasses import replace

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels.temporal.warp import inherit, origins_of_tiles
from fuzzy_stereo_ros.matching.over_frames import moving_camera
from fuzzy_stereo_ros.matching.paper.matcher import Stages
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
from hypothesis import given, settings, strategies as st
import made_scenes
from made_scenes import bits, street, STREET_CAMERA, wrong
import numpy as np
import pytest
import reference_warp as twins

ROWS, COLUMNS, DISPARITIES, FRAMES = 130, 160, 24, 6
CONFIG = MatcherConfig.from_profile('paper_live', disparities=DISPARITIES, fill=True, threads=1)


def frames(number=FRAMES, seed=1, **options):
    return list(make_sequence(ROWS, COLUMNS, DISPARITIES, number, seed,
                              **{'noise': 2.0, 'objects': 4, **options}))


@settings(max_examples=60)
@given(rows=st.integers(1, 40), columns=st.integers(1, 40), down=st.integers(-50, 50),
       right=st.integers(-50, 50), seed=st.integers(0, 999))
def test_a_population_is_moved_as_by_the_twins(rows, columns, down, right, seed):
    random, shape = np.random.default_rng(seed), (rows, columns)
    choices = random.integers(-1, 2, (-(-rows // 16), -(-columns // 16))).astype(np.int8)
    origins = np.full(shape, 9, np.int32)
    origins_of_tiles(choices, down, right, origins)
    assert np.array_equal(origins, twins.origins_of_tiles(choices, down, right, shape))

    maps, lowest = random.uniform(0, 29, (2, *shape)), random.choice((-7.25, 0.0, 4.5))
    moving = tuple(random.normal((0, 0, 1, 0), (0.01, 0.01, 0.2, 0.02)))
    for kind in (np.uint16, np.float32):
        (before, fresh), genes = maps.astype(kind), np.zeros(shape, kind)
        for scale in ((0.0, 0.0, 1.0, 0.0), moving):
            inherit(before, origins, lowest, scale, 29, fresh, genes)
            expected = twins.inherit(before, origins, lowest, scale, 29, fresh)
            np.testing.assert_allclose(genes, expected, rtol=0 if kind == np.uint16 else 1e-6)


def matches_of(pairs, camera=None, stages=None, **changes):
    """Return the matches of pairs one after the other, and the matcher."""
    matcher = StereoMatcher(replace(CONFIG, **changes), stages)
    return made_scenes.matches_of(matcher, pairs, camera), matcher


def test_the_whole_population_is_handed_on_fittest_first_and_moves_with_a_panning_picture():
    pairs = frames(pan=3.0)
    (panning, matcher), (still, _) = (matches_of(one, generations=4) for one in (pairs, frames()))
    population, genes = matcher.algorithm.population, matcher.state.own.genes
    np.testing.assert_array_equal(genes[0], population.genes[population.best])
    assert sorted(gene.tobytes() for gene in genes) == sorted(
        gene.tobytes() for gene in population.genes)
    assert wrong(panning[-1], pairs[-1]) < wrong(panning[0], pairs[0]) / 3
    assert wrong(panning[-1], pairs[-1]) < 2 * wrong(still[-1], frames()[-1]) + 1


def test_a_population_moves_with_the_camera_and_compares_a_road_along_its_slope():
    pairs = street()
    followed, _ = matches_of(pairs, STREET_CAMERA)
    facing, _ = matches_of(pairs, STREET_CAMERA, Stages(slopes=None))
    assert followed[-1].motion == moving_camera.FOLLOWED
    assert bits(followed[0]) == bits(facing[0])
    for others in (facing, matches_of(pairs)[0]):
        assert wrong(followed[-1], pairs[-1]) < 0.7 * wrong(others[-1], pairs[-1])


def test_after_a_cut_or_another_size_all_begins_anew():
    for shape in ((ROWS, COLUMNS), (ROWS - 30, COLUMNS - 20)):
        _, matcher = matches_of(frames(3))
        after = make_pair(*shape, DISPARITIES, seed=7, noise=2.0)
        found, (fresh,) = matcher.match(after.left, after.right), matches_of([after])[0]
        assert not found.warm and (matcher.state.ages == 1).all()
        # The cut is a later frame, with random numbers of its own.
        assert abs(wrong(found, after) - wrong(fresh, after)) < 5
        assert shape == (ROWS, COLUMNS) or bits(found) == bits(fresh)


@pytest.mark.parametrize('generations', [1, 2, 4, 8])
def test_confidence_is_true_before_a_map_has_settled(generations):
    pairs = frames(5)
    for match, pair in zip(matches_of(pairs, generations=generations, fill=False)[0], pairs):
        sure = (match.confidence >= 0.5) & pair.visible
        right = np.abs(match.disparity - pair.truth)[sure] <= 1
        assert not sure.any() or right.mean() > 0.8
    assert generations == 1 or sure.mean() > 0.5
