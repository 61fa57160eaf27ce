# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The half-size search as a whole, and the prior that it gives the full one."""
from census_scene import random_map, read_moved, small_pair
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.scanlines.half_size_prior import flat
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift
from fuzzy_stereo_ros.matching.realtime.half_size import (
    CLEAR, FLAT, HalfSize, NOISY_STEPS, SPECKLE, TILE, WEAK, WEAK_TEXTURE)
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, CensusPossibility, extra_columns, HALF_SIZE)
from fuzzy_stereo_ros.matching.realtime.scanlines import OVERLAP
import numpy as np
import pytest
import reference_census
import reference_refinement
import reference_search as twins

NOISE = 20.0        # grey levels, by which half of the texture of a small pair is weak


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', [(1, 1), (1, 9), (9, 1), (2, 2), (8, 11)])
@pytest.mark.parametrize('most', [0, 1, 3])
def test_flat_is_that_of_the_twin(shape, dtype, most):
    labels = random_map(shape, 3 + most, 1, dtype)
    labels[:, shape[1] // 2:] = 7
    smooth = np.full(shape, 9, np.uint8)
    for first, last in ((0, 1), (1, shape[0])):
        flat(labels, most, smooth, first, last)
    np.testing.assert_array_equal(smooth, twins.flat(labels, most))


# ---- the half-size chromosome as a whole ----


def half_map_of_twins(left, right, disparities, places, min_disparity):
    """Return labels and validity of the half-size search, and labels and weights of its prior."""
    halves, extra = [], extra_columns(min_disparity, disparities)
    for image, moved in ((left, (0, places)), (right, (min_disparity, places, extra))):
        luminance = reference_census.luminance(image, *moved)
        halves.append((reference_census.halved(luminance, rounded=False), reference_census.halved(
            reference_census.eight_bits(luminance), rounded=True)))
    features = [(reference_census.census(luminance), reference_census.gradient(grey))
                for luminance, grey in halves]
    half_disparities = -(-disparities // 2)
    costs = reference_census.box_costs(reference_census.match_costs(
        *features, half_disparities, HALF_SIZE), HALF_SIZE.box)
    across, down = reference_census.jump_penalties(
        halves[0][1], reference_census.jump_table(HALF_SIZE))
    sums = reference_census.summed_passes(costs, None, across, down, HALF_SIZE.small, TILE,
                                          OVERLAP)
    chosen = reference_census.chosen(sums)
    labels = chosen[0].astype(np.uint8)
    target = reference_census.chosen_by_target(labels, chosen[2], extra // 2)
    inside = min_disparity // 2, (min_disparity + left.shape[1] - 1) // 2
    validity = reference_refinement.validities(labels, target, inside)
    validity = reference_refinement.without_speckles(labels, validity, 1, SPECKLE)
    filled = reference_refinement.filled_by_rows(labels, validity)
    smooth = reference_refinement.median_of_25(filled)
    grey = reference_census.eight_bits(reference_census.luminance(left, 0, places))
    reliance = (twins.weak_texture(grey, int(np.hypot(WEAK_TEXTURE, NOISY_STEPS * NOISE)))
                & twins.flat(smooth, FLAT) & (validity != INVALID) & (chosen[3] >= CLEAR))
    finer = 2 * smooth.astype(int) + np.where(labels == smooth, np.rint(chosen[1] / 8), 0)
    return smooth, validity, *(twins.doubled(one, left.shape[:2])
                               for one in (finer, WEAK * reliance))


@pytest.mark.parametrize('shape', [(2, 2), (3, 9), (41, 61), (50, 40), (220, 12)])
@pytest.mark.parametrize('disparities, min_disparity', [
    (1, 0), (17, 5), (70, 0), (300, 0), (17, -6), (18, -3), (9, -20), (8, -20), (16, -200),
    (1, -1)])
def test_the_half_size_chromosome_is_put_together_as_by_the_twins(
        shape, disparities, min_disparity):
    left, right = small_pair(*shape, channels=3)
    places = luminance_shift(left, right)
    extra = extra_columns(min_disparity, disparities)
    half_rows = shape[0] // 2
    possibility = CensusPossibility(
        half_rows, shape[1] // 2, -(-disparities // 2), HALF_SIZE,
        (min_disparity // 2, (min_disparity + shape[1] - 1) // 2), extra // 2)
    full = CensusPicture(*shape, False, 96), CensusPicture(shape[0], shape[1] + extra, True, 96)
    full[0].read(left, 0, places, 0, shape[0])
    read_moved(full[1], right, min_disparity, places)
    for view, half in zip(full, (possibility.left, possibility.right)):
        view.halve(half, 0, half_rows)
    possibility.describe(CensusPicture.describe, 0, half_rows)
    half_size, pool = HalfSize(possibility, *shape, disparities), ThreadPool(1)
    half_size.search(pool)
    half = half_size.complete(pool, full[0].grey, NOISE)
    for found, expected in zip(
            (half.labels, half.validity, half.prior.labels, half.prior.weights),
            half_map_of_twins(left, right, disparities, places, min_disparity)):
        np.testing.assert_array_equal(found, expected)
