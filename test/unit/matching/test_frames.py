# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Evolution from frame to frame: the kernels of its grid, and what it does to a sequence."""
from dataclasses import replace

from bench.draws import with_noise
from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.kernels.planes import costs, grid, grid_labels, grid_proposals
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from made_scenes import wrong
import numpy as np
import pytest
import reference_grid as twins
import skimage

SHAPES = [(2, 2), (3, 40), (17, 33), (40, 51)]      # of images
CONFIG = MatcherConfig(disparities=32, threads=1, fill=True)
FRAMES = 12


def planes_of(shape, seed=0, slope=0.3, highest=9):
    """Return random planes, float32 (r, c, 3), whose disparities are about 0 to highest."""
    random = np.random.default_rng([seed, *shape])
    planes = np.float32(random.uniform(-slope, slope, (*shape, 3)))
    rows, columns = np.indices(shape)
    planes[..., 2] = (random.uniform(-1, highest + 1, shape) - planes[..., 0] * columns
                      - planes[..., 1] * rows)
    return planes


def stored(planes):
    """Return planes, float32 (r, c, 3), as the grid stores them, (r, 3, c)."""
    return np.ascontiguousarray(planes.swapaxes(1, 2))


def cells_of(shape):
    return shape[0] // 2, shape[1] // 2


def tiles_of(shape):
    return -(-shape[0] // 16), -(-shape[1] // 16)


# ---- the kernels ----


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('shift', [(0, 0), (1, -2), (-30, 5)])
def test_genes_move_with_the_picture_where_it_shows_the_same(shape, shift):
    cells, tiles = cells_of(shape), tiles_of(shape)
    genes = planes_of(cells), random_map(cells, 2), random_map(cells, 200, 1)
    choices, quiet = random_map(tiles, 2, 2, np.int8), random_map(tiles, 2, 3)
    mine = stored(genes[0]), *genes[1:]
    found = [np.full_like(part, 9) for part in mine]
    origin = np.zeros(2, np.uint8)
    for first, last in ((0, 1), (1, cells[0])):
        grid.move_genes((*mine, origin), choices, quiet, shift, (*found, origin), first, last)
    planes, *twin = twins.moved(*genes, choices, quiet, shift)
    for one, other in zip(found, (stored(planes), *twin)):
        np.testing.assert_allclose(one, other, atol=1e-4)


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('origin', [(0, 0), (0, 1), (1, 1)])
@pytest.mark.parametrize('kind', [np.uint8, np.uint16])
def test_cells_show_what_the_map_has_found_at_their_pixels(shape, origin, kind):
    shape, cells = (shape[0] + 1, shape[1] + 1), cells_of(shape)
    chromosome, labels = random_map(shape, 4, dtype=kind), random_map(shape, 4, 1, kind)
    offsets = (random_map(shape, 17, 2) - np.int64(8)).astype(np.int8)
    validity, margins = random_map(shape, 3, 3), random_map(shape, 50, 4)
    found = [np.zeros(cells, kind) for kind in (np.float32, np.float32, bool, bool, np.uint8)]
    grid.sample_map((chromosome, labels, offsets, validity), margins, 24, np.uint8(origin),
                    tuple(found[:4]), found[4], 0, cells[0])
    twin = twins.sampled(*(one[origin[0]::2, origin[1]::2][:cells[0], :cells[1]] for one in (
        chromosome, labels, offsets, validity, margins)), 24)
    for place, expected in zip((0, 2, 3, 4), twin):
        np.testing.assert_array_equal(found[place], expected)


@pytest.mark.parametrize('shape', SHAPES)
def test_genes_that_have_not_evolved_follow_the_map(shape):
    cells = cells_of(shape)
    disparities, mutated = np.float32(random_map(cells, 4)), random_map(cells, 4, 1) == 0
    planes, evolved = planes_of(cells, 2), random_map(cells, 2, 3)
    tangents, current = stored(np.zeros_like(planes)), np.zeros(cells, np.float32)
    tangent = twins.tangents(disparities, 2, 1.5)
    expected = np.where(evolved[..., None] > 0, planes, tangent)
    found, marks = stored(planes), evolved.copy()
    for first, last in ((0, 1), (1, cells[0])):
        grid.follow_map((disparities, tangents, None, mutated), 2, np.float32(1.5),
                        (found, marks, None, None), np.float32(9), current, first, last)
    np.testing.assert_allclose(tangents, stored(tangent), atol=1e-5)
    np.testing.assert_allclose(found, stored(expected), atol=1e-5)
    np.testing.assert_array_equal(marks, evolved | mutated)
    rows, columns = np.indices(cells)
    np.testing.assert_allclose(current, np.clip(
        expected[..., 0] * columns + expected[..., 1] * rows + expected[..., 2], 0, 9), atol=1e-4)


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('origin', [(0, 0), (0, 1), (1, 1)])
@pytest.mark.parametrize('min_disparity', [-3, 0, 4])
def test_matches_of_planes_cost_what_lies_between_those_of_their_labels(
        shape, origin, min_disparity):
    disparities, cells = 10, cells_of(shape)
    left, right = small_pair(*shape)
    possibility = seen(left, right, disparities, min_disparity)
    planes, selected = planes_of(cells), random_map(cells, 2, dtype=bool)
    trusted = random_map(cells, 2, 8, bool)
    inside = min_disparity, min_disparity + shape[1] - 1
    found = np.full(cells, -1, np.int32)
    grid.grid_costs(tuple(possibility.features), possibility.model.largest, inside,
                    np.uint8(origin), (trusted, 64), selected, (stored(planes), found), 0,
                    cells[0])
    twin = twins.costs(twin_costs(left, right, disparities, min_disparity), planes, origin, inside,
                       possibility.model.largest, costs.UNIT)
    twin = np.where(trusted, twin, twin // 4)
    assert (found[~selected] == -1).all()
    np.testing.assert_allclose(found[selected], twin[selected], atol=1)


def test_planes_that_are_not_finite_cost_as_much_as_impossible_matches():
    possibility = seen(*small_pair(4, 40), 10)
    planes = np.full((2, 3, 20), np.nan, np.float32)
    planes[1] = 1e30
    found, everywhere = np.zeros((2, 20), np.int32), np.ones((2, 20), bool)
    grid.grid_costs(tuple(possibility.features), possibility.model.largest, (0, 39),
                    np.zeros(2, np.uint8), (everywhere, 0), everywhere, (planes, found), 0, 2)
    assert (found == costs.UNIT).all()


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('right, begin', [(0, 0), (1, -4), (1, 7)])
def test_trusted_is_what_is_consistent_and_not_hidden_by_something_nearer(shape, right, begin):
    cells = cells_of(shape)
    disparities = np.clip(planes_of(cells, slope=0)[..., 2], 0, 9)
    consistent, trusted = random_map(cells, 4) > 0, np.zeros(cells, bool)
    memory = np.zeros(shape[1] // 2 + 4, np.float32), np.zeros(cells[1], np.int32)
    grid.trust_visible(disparities, consistent, np.array([0, right], np.uint8), begin, memory,
                       trusted, 0, cells[0])
    np.testing.assert_array_equal(
        trusted, consistent & twins.visible(disparities, right, begin, shape[1] // 2 + 3))


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('origin', [(0, 0), (1, 0), (1, 1)])
def test_pixels_take_the_planes_of_the_evolved_cells_that_are_like_them(shape, origin):
    cells = cells_of(shape)
    planes, evolved = planes_of(cells), random_map(cells, 2)
    trusted, fine = random_map(cells, 2, 4, bool), random_map(shape, 60000, 5, np.uint16)
    chromosome = random_map(shape, 10, 6)
    found, labels = chromosome.copy(), chromosome.copy()
    offsets, validity = np.full(shape, 99, np.int8), np.full(shape, 9, np.uint8)
    genes = stored(planes), evolved, np.zeros_like(evolved), np.uint8(origin)
    frame_map = found, labels, offsets, validity
    memory = np.zeros((2, 4, cells[1] + 1), np.float32), np.zeros(cells[1], np.uint8)
    for first, last in ((0, cells[0] // 2), (cells[0] // 2, cells[0])):
        grid_labels.write_labels(genes, trusted, np.pad(fine, MARGIN), np.float32(0.75),
                                 np.float32(9), frame_map, memory, first, last)
    twin = twins.written(planes, evolved, fine, origin, 0.75, 9, chromosome)
    np.testing.assert_array_equal(found, twin)
    np.testing.assert_array_equal(labels, twin)
    changed = validity != 9
    assert (changed >= (twin != chromosome)).all()
    assert (abs(offsets[changed]) <= 8).all() and (offsets[~changed] == 99).all()
    assert set(np.unique(validity[changed])) <= {CONSISTENT, INVALID}


def test_regions_of_which_too_few_trusted_cells_lie_near_their_planes_are_rejected():
    shape, starts = (4, 6), np.array([0, 12, 18, 24], np.int32)
    pixels = np.random.default_rng(0).permutation(24).astype(np.int32)
    disparities, trusted = random_map(shape, 4).astype(np.float32), random_map(shape, 2, 1, bool)
    planes = np.array([(0.1, 0.2, 1), (0, 0, 2), (0.5, 0, 0)], np.float32)
    for share in (0.2, 0.5, 0.9):
        selected = np.ones(shape, bool)
        grid_proposals.reject_bent(planes, (starts, pixels), disparities, trusted, np.float32(1),
                                   share, selected)
        for plane, first, last in zip(planes, starts, starts[1:]):
            row, column = np.divmod(pixels[first:last], shape[1])
            known = trusted[row, column]
            away = abs(np.column_stack([column, row, np.ones_like(row)]) @ plane
                       - disparities[row, column])
            bent = (known & (away < 1)).sum() < share * max(known.sum(), 1)
            assert (selected[row, column] == (not bent)).all()


def test_regions_are_chosen_in_order_as_far_as_they_fit():
    numbers, starts = np.zeros(4, np.int32), np.zeros(5, np.int32)
    cells = np.array([30, 50, 10, 20])
    assert grid_proposals.choose_regions(np.array([1, 0, 3, 2]), cells, 65, numbers, starts) == 2
    np.testing.assert_array_equal(numbers, [-1, 0, 1, -1])
    np.testing.assert_array_equal(starts[:3], [0, 50, 60])


# ---- sequences ----


def faint(image):
    """Return an image of little contrast, whose surfaces are regions of like grey."""
    return (112 + image // 8).astype(np.uint8)


def still(config, frames=FRAMES, noise=0.5, seed=3, stages=None):
    """Return the matches of a faint scene that stands still under fresh noise, and the matcher."""
    made = make_pair(160, 240, 32, seed, objects=4, colour=True)
    made = made._replace(left=faint(made.left), right=faint(made.right))
    random, matcher = np.random.default_rng(0), StereoMatcher(config, stages)
    return [matcher.match(*(with_noise(image, noise, random) for image in (made.left, made.right)))
            for _ in range(frames)], matcher, made


def test_each_frame_is_a_generation_with_the_gains_of_its_operators():
    matches, matcher, _ = still(CONFIG)
    assert matches[0].generations == 1 and not matches[0].warm
    last = matches[-1]
    assert [row.number for row in last.history] == [1, 2]
    assert {'region planes', 'crossover with the map'} == set(last.history[1].gains)
    assert min(last.history[1].gains.values()) >= 0 and last.warm
    assert last.gains == {name: gain for row in last.history for name, gain in row.gains.items()}
    assert any(match.gains.get('region planes', 0) > 0 for match in matches)
    assert matcher.state.own.evolved.any() and matcher.state.own.proposals.any()


@pytest.mark.parametrize('noise', [0, 0.5])
def test_a_scene_that_stands_still_gets_better_and_never_worse_than_cold(noise):
    matches, _, made = still(CONFIG, noise=noise)
    bad = [wrong(match, made) for match in matches]
    assert bad[-1] <= bad[0] + 0.1
    assert noise == 0 or bad[-1] < bad[0]


def test_sequences_are_the_same_with_any_number_of_threads_and_other_by_another_seed():
    one, three, other = (still(replace(CONFIG, **changes))[1].state.own for changes in (
        {}, {'threads': 3}, {'seed': 1}))
    for name in ('labels', 'planes', 'evolved', 'proposals'):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))
    assert (one.proposals != other.proposals).any()


def test_a_frame_of_another_scene_inherits_nothing():
    matcher = still(CONFIG)[1]
    other = make_pair(160, 240, 32, 9, objects=4, colour=True)
    match = matcher.match(other.left, other.right)
    assert not matcher.state.own.evolved.any()
    cold = StereoMatcher(CONFIG).match(other.left, other.right)
    np.testing.assert_array_equal(match.disparity, cold.disparity)


def test_with_time_for_evolution_more_than_one_generation_runs():
    matches, _, _ = still(replace(CONFIG, evolution_ms=300.0), frames=2, noise=0)
    assert matches[-1].generations > 3


def test_a_frame_whose_deadline_has_passed_does_not_evolve_and_keeps_what_it_has():
    _, matcher, made = still(CONFIG)
    before = int(matcher.state.own.evolved.sum())
    late = StereoMatcher(replace(CONFIG, deadline_ms=1e-6))
    late.restore(matcher.state)
    match = late.match(made.left, made.right)
    assert match.generations == 0
    assert before == 0 or late.state.own.evolved.any()


def test_a_covered_lens_never_gets_confidence_however_long_it_is_covered():
    random, matcher = np.random.default_rng(0), StereoMatcher(CONFIG)
    for _ in range(14):
        pair = (with_noise(np.full((160, 240, 3), 30, np.uint8), 1.5, random) for _ in range(2))
        match = matcher.match(*pair)
    assert (match.confidence > 0.95).mean() < 0.001


def test_the_parts_of_a_sequence_change_nothing():
    left, right, _ = skimage.data.stereo_motorcycle()
    random = np.random.default_rng(0)
    pairs = [[with_noise(image[100:400, 200:500], 1.5, random) for image in (left, right)]
             for _ in range(FRAMES)]
    found = []
    for threads, number in ((1, 1), (5, 5)):
        matcher = StereoMatcher(MatcherConfig(disparities=60, threads=threads))
        sequence = [matcher.match(*pair) for pair in pairs]
        assert len(matcher.algorithm.pool.parts(300)) == number
        assert matcher.state.own.evolved.any()
        assert matcher.algorithm._warm_start._weights.any()
        found.append([matcher.state.own.planes, *(match.disparity for match in sequence),
                      *(match.confidence for match in sequence)])
    for parts, one in zip(*found):
        np.testing.assert_array_equal(parts, one)
