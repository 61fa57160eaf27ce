# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A generation, and the search at smaller sizes that inherits to it, against their twins."""
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

from census_scene import random_map, read_moved, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import Chain, ThreadPool
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior, weight_of
from fuzzy_stereo_ros.matching.kernels.scanlines import selection
from fuzzy_stereo_ros.matching.kernels.scanlines.half_size_prior import CLEAR, WEAK
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import Found
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import (
    HALF_SIZE, MOST_GENES, PREVIOUS, SIDE)
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift
from fuzzy_stereo_ros.matching.realtime.generation import (
    AllLabels, gene_type, GROW, InheritedGenes, parent_of, Squares)
from fuzzy_stereo_ros.matching.realtime.half_size import (
    FLAT, GROW as GROW_SMALL, HalfSize, NOISY_STEPS, SPECKLE, WEAK_TEXTURE)
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, CensusPossibility, extra_columns, FULL_SIZE, HALF_SIZE as BOXED)
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
from hypothesis import example, given, settings, strategies as st
from made_scenes import bits
import numpy as np
import reference_census
import reference_generation as twins
import reference_refinement
import reference_search

WEIGHTS = np.array([0, weight_of(1, 2), weight_of(0, 6), weight_of(1, 5)], np.uint8)


@settings(max_examples=16)
@given(st.integers(1, 50), st.integers(1, 50), st.integers(1, 40) | st.sampled_from([256, 257]),
       st.integers(1, 40), st.integers(-60, 9), st.integers(0, 99),
       st.tuples(st.integers(-70, 70), st.integers(-70, 70)),
       st.sampled_from(['full', 'cells', None]), st.booleans(), st.integers(0, 1),
       st.sampled_from([FULL_SIZE, BOXED]))
@example(20, 70, 700, 700, 0, 0, (0, 0), 'full', False, 1, FULL_SIZE)   # more than a tile can have
@example(3, 600, 600, 600, 0, 0, (0, 0), 'full', False, 1, FULL_SIZE)   # 256 apart at a target
def test_any_size_range_and_parents_are_those_of_the_twin(
        rows, columns, disparities, spread, min_disparity, seed, shift, previous, few,
        mutation, model):
    shape, cells = (rows, columns), (max(rows // 2, 1), max(columns // 2, 1))
    kind = gene_type(disparities)

    def labels_of(shape, number, limit, kind):
        """Return a map whose labels spread little, in blocks, so that tiles differ."""
        blocks = random_map(tuple(-(-side // 16) for side in shape), max(limit, 1),
                            seed + number, np.int64)
        labels = blocks.repeat(16, 0).repeat(16, 1)[:shape[0], :shape[1]] + random_map(
            shape, spread, seed + number, np.int64)
        return np.minimum(labels, max(limit - 1, 0)).astype(kind)

    left, right = small_pair(*shape, disparity=min(3, columns - 1), seed=seed)
    possibility = seen(left, right, disparities, min_disparity, model)
    half, older = (Prior(labels_of(shape, number, disparities, kind),
                         WEIGHTS[random_map(shape, len(WEIGHTS), seed + number)])
                   for number in (1, 2))
    found, labels = (labels_of(cells, number, disparities // 2,
                               gene_type(-(-disparities // 2))) for number in (3, 5))
    # A smaller size has no priors: sums of 3 x 3 pixels would contain them.
    smooth = (labels, None, 2, 2, 0) if model.box else (half.labels, None, 1, 1, 0)
    parents = [(HALF_SIZE, (*one, None, TILE, (0, 0))) for one in (
        smooth, (found, None, 2, 2, GROW))[:1 if few else 2]]
    before = None
    if previous:
        of_before, size, cell = {'full': (kind, shape, 1),
                                 'cells': (np.uint16, cells, 2)}[previous]
        choices = random_map([-(-side // TILE) for side in shape], 3, seed, np.int8) - 1
        before = (labels_of(size, 4, disparities, of_before), random_map(size, 3, seed + 9), cell,
                  1, 0, choices.astype(np.int8) if cell == 1 else None, TILE, shift)
        parents.append((PREVIOUS, before))
    generation, chain = InheritedGenes(possibility, Squares(), few, mutation), Chain(ThreadPool(1))
    for memory in (*generation._memory, generation._squares._memory):
        memory[:] = 255 * (seed % 2)        # of the generation before nothing counts
    generation.select(
        chain, SimpleNamespace(
            labels=labels, prior=None if model.box else half,
            chosen=SimpleNamespace(labels=found), disparities=half_disparities(disparities)))
    generation.previous = before and parent_of(*before[:6], shift=shift)
    generation.prior = older if previous and not model.box else None
    chain.run()

    genes, origins = twins.tile_genes(
        parents, shape, disparities, 2 * (half_disparities(disparities) - 1), SIDE, MOST_GENES,
        mutation)
    costs = twin_costs(left, right, disparities, min_disparity, model)
    for prior in () if model.box else (half, older) if previous else (half,):
        costs = costs + reference_census.prior_costs(*prior, disparities)
    penalties = reference_census.jump_penalties(
        possibility.left.grey[:, :columns], reference_census.jump_table(model))
    expected = twins.selected(costs, genes, *penalties, model.small, SIDE)
    chosen, origin = generation.chosen, generation.origin_of_genes()
    for number, ((row, column), labels) in enumerate(genes.items()):
        count, origins_of_tile = generation.counts[number], origins[row, column]
        assert generation.genes[number, :count].tolist() == labels
        assert generation.origins[number, :count].tolist() == origins_of_tile
        tile = np.s_[SIDE * row:SIDE * (row + 1), SIDE * column:SIDE * (column + 1)]
        np.testing.assert_array_equal(origin[tile], np.vectorize(
            dict(zip(labels, origins_of_tile)).get)(expected[0][tile]))
    for values, wanted in zip(chosen[:4], expected):
        np.testing.assert_array_equal(values, wanted)
    np.testing.assert_array_equal(chosen.target, reference_census.chosen_by_target(
        expected[0], expected[2], chosen.target.shape[1] - columns))


@settings(max_examples=20)
@given(st.integers(1, 90), st.integers(1, 90), st.integers(1, 40), st.integers(0, 2**20))
def test_a_thread_that_asks_while_another_one_finds_the_squares_gets_them_where_they_are_now(
        rows, columns, disparities, more):
    """After a larger size has had them moved, as in the frame that needs more genes."""
    squares, asked = Squares(), []
    one = AllLabels(CensusPossibility(rows, columns, disparities, BOXED), squares)
    squares.addresses(2 * one._places[-1] + more)

    class Asking:
        """The fixed fields: while addresses are put among them, another thread asks."""

        fixed = one._fixed

        def _replace(self, **changes):
            one._fixed = self.fixed
            asked.append(ThreadPoolExecutor().submit(one._located).result())
            return self.fixed._replace(**changes)
    one._fixed = Asking()
    for fields in one._located(), *asked:
        assert (Found(*fields).costs, Found(*fields).sums) == squares.places
    assert len(asked) == 1


@settings(max_examples=40)
@given(st.integers(1, 700), st.integers(1, 700), st.integers(-60, 60), st.integers(1, 8),
       st.integers(0, 9))
def test_pixels_of_any_labels_compete_for_the_target_as_those_of_the_twin_do(
        columns, disparities, min_disparity, classes, seed):
    possibility = seen(*small_pair(2, columns, min(3, columns - 1)), disparities, min_disparity)
    search, random = AllLabels(possibility, Squares()), np.random.default_rng(seed)
    labels, _, sums, _, target = search.chosen
    labels[:] = random.integers(0, disparities, labels.shape)
    sums[:] = 255 - random.integers(0, classes, sums.shape) * 255 // classes
    selection.select_of_target(search._found, search._scratch[0], columns,
                               address_of(target), target.shape[1], 0, 2)
    assert np.array_equal(target, reference_census.chosen_by_target(
        labels, sums, target.shape[1] - columns))


NOISE = 20.0        # grey levels, by which half of the texture of a small pair is weak


def small_map_of_twins(views, disparities, inside, smaller):
    """Return labels, validity and what is chosen of a search at a smaller size."""
    # views: (luminance, grey) of both; inside: columns of the target that exist; smaller: what
    # this returned of half the size, and its number of labels, or None
    features = [(reference_census.census(luminance), reference_census.gradient(grey))
                for luminance, grey in views]
    shape, (_, grey) = views[0][0].shape, views[0]
    costs = reference_census.box_costs(reference_census.match_costs(
        *features, disparities + SIDE, BOXED), disparities, BOXED.box, SIDE)
    genes = {tile: list(range(disparities)) for tile in np.ndindex(
        *(-(-side // SIDE) for side in shape))}
    if smaller:
        (labels, _, found), number = smaller
        genes, _ = twins.tile_genes(
            [(1, (one, None, 2, 2, grow, None, 1, None)) for one, grow in (
                (labels, 0), (found[0], GROW_SMALL))], shape, disparities, 2 * (number - 1), SIDE,
            MOST_GENES)
    chosen = twins.selected(costs, genes, *reference_census.jump_penalties(
        grey, reference_census.jump_table(BOXED)), BOXED.small, SIDE)
    labels = chosen[0].astype(np.uint16)
    target = reference_census.chosen_by_target(
        labels, chosen[2], views[1][0].shape[1] - shape[1])
    validity = reference_refinement.validities(labels, target, inside)
    validity = reference_refinement.without_speckles(labels, validity, 1, SPECKLE)
    filled = reference_refinement.filled_by_rows(labels, validity)
    return reference_refinement.median_of_25(filled), validity, chosen


def half_map_of_twins(left, right, disparities, places, min_disparity):
    """Return labels and validity of the half-size search, and labels and weights of its prior."""
    extra, sizes = extra_columns(min_disparity, 2 * disparities[0]), []
    views = [(luminance, reference_census.eight_bits(luminance)) for luminance in (
        reference_census.luminance(image, *moved)
        for image, moved in ((left, (0, places)), (right, (min_disparity, places, extra))))]
    for _ in disparities:
        views = [(reference_census.halved(luminance, rounded=False),
                  reference_census.halved(grey, rounded=True)) for luminance, grey in views]
        sizes.append(views)
    smaller, ends = None, (min_disparity, min_disparity + left.shape[1] - 1)
    for size in reversed(range(len(sizes))):
        inside = tuple(end >> size + 1 for end in ends)
        smaller = small_map_of_twins(
            sizes[size], disparities[size], inside, smaller), disparities[size]
    smooth, validity, chosen = smaller[0]
    grey = reference_census.eight_bits(reference_census.luminance(left, 0, places))
    weak = reference_search.weak_texture(grey, int(np.hypot(WEAK_TEXTURE, NOISY_STEPS * NOISE)))
    reliance = weak & reference_search.flat(smooth, FLAT) & (
        (validity != INVALID) & (chosen[3] >= CLEAR))
    finer = 2 * smooth.astype(int) + np.where(
        chosen[0] == smooth, np.rint(chosen[1] / 8), 0)
    return smooth, validity, *(reference_search.doubled(one, left.shape[:2])
                               for one in (finer, WEAK * reliance))


@settings(max_examples=4)
@given(st.integers(256, 300), st.integers(256, 300), st.integers(105, 210), st.integers(-70, 5))
def test_a_pair_of_three_sizes_or_more_is_matched_to_the_same_bits_in_parts(
        rows, columns, disparities, lowest):
    pair = small_pair(rows, columns, 9)
    alone, shared = (StereoMatcher(MatcherConfig(
        disparities=disparities, min_disparity=lowest, threads=threads)) for threads in (1, 3))
    assert bits(alone.match(*pair)) == bits(shared.match(*pair))
    assert len(alone.algorithm._views.small) >= 2


@settings(max_examples=10)
@given(st.integers(2, 90), st.integers(2, 90),
       st.integers(1, 70) | st.integers(1, 70) | st.sampled_from([300, 510, 512, 514, 1024]),
       st.integers(-60, 9) | st.sampled_from([-2048, -200, 40]), st.booleans(), st.integers(1, 3))
def test_the_half_size_chromosome_is_put_together_as_by_the_twins(
        rows, columns, disparities, min_disparity, quarter, threads):
    """At the smallest size all labels are genes."""
    rows = rows if disparities <= 70 else rows // 4 + 2     # else the twins take long
    shape, numbers = (rows, columns), [-(-disparities // 2)]
    if quarter and min(shape) >= 4:
        numbers.append(-(-numbers[0] // 2))
    left, right = small_pair(*shape, channels=3)
    places, extra = luminance_shift(left, right), extra_columns(min_disparity, 2 * numbers[0])
    larger = [CensusPicture(*shape, False, 96),
              CensusPicture(rows, columns + extra, True, 96)]
    larger[0].read(left, 0, places, 0, rows)
    read_moved(larger[1], right, min_disparity, places)
    grey, possibilities = larger[0].grey, []
    for level, number in enumerate(numbers, 1):
        size = CensusPossibility(
            rows >> level, columns >> level, number, BOXED, tuple(
                end >> level for end in (min_disparity, min_disparity + columns - 1)),
            extra >> level)
        for view, half in zip(larger, (size.left, size.right)):
            view.halve(half, 0, size.rows)
        size.describe(0, size.rows)
        larger = [size.left, size.right]
        possibilities.append(size)
    half_size, pool = HalfSize(possibilities, Squares(), *shape, disparities), ThreadPool(threads)
    smallest = half_size
    while smallest._smaller:
        smallest = smallest._smaller
    search = smallest._selection
    # none is read before it is written
    for memory in (*search._memory, search._squares._memory):
        memory[:] = np.random.default_rng(1).integers(0, 256, memory.shape)
    half_size.search(pool)
    half_size.complete(pool, SimpleNamespace(
        full=SimpleNamespace(left=SimpleNamespace(grey=grey)), noise=NOISE))
    half = half_size.result
    pool.close()
    for found, expected in zip(
            (half.labels, half.validity, half.prior.labels, half.prior.weights),
            half_map_of_twins(left, right, numbers, places, min_disparity)):
        np.testing.assert_array_equal(found, expected)
