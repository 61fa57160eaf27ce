# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The half-size search as a whole, and the prior that it gives the full one."""
from census_scene import read_moved, small_pair
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.scanlines.half_size_prior import CLEAR, WEAK
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import MOST_GENES, SIDE
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift
from fuzzy_stereo_ros.matching.realtime.half_size import (
    FLAT, GROW, HalfSize, NOISY_STEPS, SPECKLE, WEAK_TEXTURE)
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, CensusPossibility, extra_columns, HALF_SIZE)
from hypothesis import given, settings, strategies as st
from made_scenes import bits
import numpy as np
import reference_census
import reference_generation as twins_of_generation
import reference_refinement
import reference_search as twins

NOISE = 20.0        # grey levels, by which half of the texture of a small pair is weak


def small_map_of_twins(views, disparities, inside, smaller):
    """Return labels, validity and what is chosen of a search at a smaller size."""
    # views: (luminance, grey) of both; inside: columns of the target that exist; smaller: what
    # this returned of half the size, and its number of labels, or None
    features = [(reference_census.census(luminance), reference_census.gradient(grey))
                for luminance, grey in views]
    shape, (_, grey) = views[0][0].shape, views[0]
    costs = reference_census.box_costs(reference_census.match_costs(
        *features, disparities + SIDE, HALF_SIZE), disparities, HALF_SIZE.box, SIDE)
    genes = twins_of_generation.all_labels(shape, disparities, SIDE)
    if smaller:
        (labels, _, found), number = smaller
        genes, _ = twins_of_generation.tile_genes(
            [(1, (one, None, 2, 2, grow, None, 1, None)) for one, grow in (
                (labels, 0), (found[0], GROW))], shape, disparities, 2 * (number - 1), SIDE,
            MOST_GENES)
    chosen = twins_of_generation.selected(costs, genes, *reference_census.jump_penalties(
        grey, reference_census.jump_table(HALF_SIZE)), HALF_SIZE.small, SIDE)
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
    reliance = (twins.weak_texture(grey, int(np.hypot(WEAK_TEXTURE, NOISY_STEPS * NOISE)))
                & twins.flat(smooth, FLAT) & (validity != INVALID) & (chosen[3] >= CLEAR))
    finer = 2 * smooth.astype(int) + np.where(
        chosen[0] == smooth, np.rint(chosen[1] / 8), 0)
    return smooth, validity, *(twins.doubled(one, left.shape[:2])
                               for one in (finer, WEAK * reliance))


@settings(max_examples=6)
@given(st.integers(256, 300), st.integers(256, 300), st.integers(105, 210), st.integers(-70, 5))
def test_a_pair_of_three_sizes_or_more_is_matched_to_the_same_bits_in_parts(
        rows, columns, disparities, lowest):
    pair = small_pair(rows, columns, 9)
    alone, shared = (StereoMatcher(MatcherConfig(
        disparities=disparities, min_disparity=lowest, threads=threads)) for threads in (1, 3))
    assert bits(alone.match(*pair)) == bits(shared.match(*pair))
    assert len(alone.algorithm._views.small) >= 2


@settings(max_examples=30)
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
            rows >> level, columns >> level, number, HALF_SIZE, tuple(
                end >> level for end in (min_disparity, min_disparity + columns - 1)),
            extra >> level)
        for view, half in zip(larger, (size.left, size.right)):
            view.halve(half, 0, size.rows)
        size.describe(CensusPicture.describe, 0, size.rows)
        larger = [size.left, size.right]
        possibilities.append(size)
    half_size, pool = HalfSize(possibilities, *shape, disparities), ThreadPool(threads)
    smallest = half_size
    while smallest._smaller:
        smallest = smallest._smaller
    search = smallest._selection
    # none is read before it is written
    for memory in (*search._memory, search._lines, search._squares):
        memory[:] = np.random.default_rng(1).integers(0, 256, memory.shape)
    half_size.search(pool)
    half = half_size.complete(pool, grey, NOISE)
    pool.close()
    for found, expected in zip(
            (half.labels, half.validity, half.prior.labels, half.prior.weights),
            half_map_of_twins(left, right, numbers, places, min_disparity)):
        np.testing.assert_array_equal(found, expected)
