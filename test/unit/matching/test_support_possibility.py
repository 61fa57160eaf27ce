# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Costs of the profile quality: memberships, supports, and what leans on a parent."""
from census_scene import random_map, small_pair
from fuzzy_stereo_ros.matching.bands import ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility import cross_support, fuzzy_costs
from fuzzy_stereo_ros.matching.quality import strips
from fuzzy_stereo_ros.matching.quality.possibility import (
    ALIKE, colour_and_fine_grey, eight_bit_scale, Model, MUCH_ALIKE, SupportPossibility)
import numpy as np
import pytest
import reference_quality as twins

SHAPES = [(1, 9), (9, 1), (2, 2), (7, 33), (5, 70)]
MODEL = Model(census=7, colour=43, slope=2, gradient=12, blurs=(0.5,), longest=3, near=2, rounds=0)


def looked(left, right, disparities, model, min_disparity=0, threads=1):
    """Return the possibility of a pair under a model, without a parent."""
    scale = eight_bit_scale(left, right)
    possibility = SupportPossibility(*left.shape[:2], disparities, model)
    possibility.look(colour_and_fine_grey(left, scale, 0),
                     colour_and_fine_grey(right, scale, min_disparity), max(min_disparity, 0))
    possibility.fill(ThreadPool(threads), model, np.zeros(left.shape[:2], np.float32), 1.0)
    return possibility


def test_costs_of_pixels_in_strips_are_those_of_the_whole_image_halved(monkeypatch):
    left, right = small_pair(61, 40)[:2]
    pair = [colour_and_fine_grey(image, 1.0, 0) for image in (left, right)]
    monkeypatch.setattr(strips, 'MOST_PIXEL_COSTS', 40 * 32 * 30)
    volume = strips.pixel_costs(ThreadPool(1), *pair, 20, MODEL._replace(rounds=2), 3)
    whole = SupportPossibility(61, 40, 20, MODEL)
    whole.look(*pair, 3)
    whole.fill(ThreadPool(1), MODEL)
    np.testing.assert_array_equal(volume, np.minimum(whole.costs >> 1, 255))


@pytest.mark.parametrize('first_bit, planes', [(0, 2), (24, 3)])
@pytest.mark.parametrize('shape', SHAPES)
def test_the_census_is_that_of_the_twin(shape, first_bit, planes):
    fine = random_map((shape[0] + 4, shape[1] + 4), 20, dtype=np.float32)
    codes = np.zeros((shape[0], planes, shape[1]), np.uint16)
    fuzzy_costs.census(fine, 2, first_bit, codes, 0, shape[0])
    np.testing.assert_array_equal(codes, twins.census(fine, 2, first_bit, planes))


@pytest.mark.parametrize('first_inside', [0, 4])
@pytest.mark.parametrize('shape', SHAPES)
def test_the_costs_are_those_of_the_twin(shape, first_inside):
    check_costs(shape, min(shape[1], 35), 64, first_inside)


@pytest.mark.parametrize('disparities', [1, 32, 33, 255, 256, 257, 512])
def test_the_costs_of_more_disparities_than_columns_are_those_of_the_twin(disparities):
    check_costs((2, 5), disparities, -(-disparities // 32) * 32, 2)


@pytest.mark.parametrize('weights', [(0, 1, 1, 0), (1, 0, 0, 1), (37, 1, 64, 11)])
def test_the_costs_of_the_largest_differences_are_those_of_the_twin(weights):
    check_costs((3, 33), 33, 64, 0, spread=1021, weights=weights)


def check_costs(shape, disparities, labels, first_inside, spread=12, weights=(5, 3, 16, 4)):
    rows, columns = shape
    codes, target_codes = (random_map((rows, 2, columns), 65536, seed, np.uint16)
                           for seed in (1, 2))
    planes, target_planes = (
        random_map((rows, fuzzy_costs.PLANES, columns), spread, seed, np.uint16)
        + np.uint16(16384)
        for seed in (3, 4))
    padded = [np.concatenate([kind[..., ::-1], np.repeat(kind[..., :1], labels, axis=2)], axis=2)
              for kind in (target_codes, target_planes)]
    costs = np.zeros((rows, columns, labels), np.uint16)
    fuzzy_costs.fill_costs(codes, padded[0], 2, planes, padded[1], np.uint16(weights), disparities,
                           first_inside, costs, 0, rows)
    np.testing.assert_array_equal(costs, twins.costs(
        codes, target_codes, planes, target_planes, weights, disparities, first_inside, labels))


@pytest.mark.parametrize('level', [0.5, 100.0])
@pytest.mark.parametrize('shape', SHAPES)
def test_arms_end_at_edges_of_colour_and_of_the_parent(shape, level):
    colours = random_map((*shape, 3), 18)
    surface = random_map(shape, 3, 1, np.float32) / np.float32(4)
    arms = np.zeros((*shape, 4), np.uint8)
    cross_support.fill_arms(colours, 5, 2, 14, 8, surface, np.float32(level), arms, 0, shape[0])
    np.testing.assert_array_equal(arms, twins.arms(colours, 5, 2, 14, 8, surface, level))


@pytest.mark.parametrize('least', [0, fuzzy_costs.FULL])
@pytest.mark.parametrize('longest', [4, 34])
@pytest.mark.parametrize('shape', [*SHAPES, (70, 3)])
def test_means_over_rows_and_columns_are_those_of_the_twin(shape, longest, least):
    rows, columns = shape
    labels = 64
    costs = np.maximum(
        random_map((*shape, labels), fuzzy_costs.FULL + 1, dtype=np.uint16), np.uint16(least))
    places = np.indices(shape)
    room = [places[1], columns - 1 - places[1], places[0], rows - 1 - places[0]]
    arms = random_map((*shape, 4), longest + 1)
    arms = np.minimum(arms, np.stack(room, axis=2)).astype(np.uint8)
    by_rows, by_columns = costs.copy(), costs.copy()
    cross_support.mean_over_rows(by_rows, arms, np.zeros((columns + 1) * labels, np.uint16), 0,
                                 rows)
    for first, last in ((0, columns // 2), (columns // 2, columns)):
        ring = np.zeros((2 * longest + 2, (last - first) * labels), np.uint16)
        cross_support.mean_over_columns(by_columns, arms, longest, ring, first, last)
    np.testing.assert_array_equal(by_rows, twins.mean_over_arms(costs, arms, 1))
    np.testing.assert_array_equal(by_columns, twins.mean_over_arms(costs, arms, 0))


@pytest.mark.parametrize('labels', [32, 64, 512])
def test_leaning_makes_labels_far_from_the_surface_dearer_and_can_be_undone(labels):
    costs = random_map((4, 5, labels), fuzzy_costs.FULL + 1, dtype=np.uint16)
    surface = random_map((4, 5), 10 * labels, 1, np.float32) / np.float32(10)
    weights = random_map((4, 5), 60, 2, np.float32)
    reliance, numbers = costs.copy(), (np.float32(1), np.float32(4))
    fuzzy_costs.add_prior(reliance, surface, weights, *numbers, False, 0, 4)
    assert (abs(reliance - twins.leant_costs(costs, surface, weights, 1.0, 4.0)) <= 1).all()
    fuzzy_costs.add_prior(reliance, surface, weights, *numbers, True, 0, 4)
    np.testing.assert_array_equal(reliance, costs)


def test_the_true_shift_costs_least_on_a_textured_pair():
    left, right = small_pair(40, 80, disparity=6, channels=3)
    costs = looked(left, right, 12, MODEL._replace(rounds=2)).costs
    assert np.median(costs[:, 12:70].argmin(axis=2)) == 6


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('channels', [0, 3])
def test_all_kinds_of_images_give_costs(channels, dtype):
    left, right = small_pair(30, 60, disparity=4, channels=channels, dtype=dtype)
    costs = looked(left, right, 9, MODEL).costs
    assert costs[..., :9].min() < fuzzy_costs.FULL // 2
    assert (costs[..., 9:] == fuzzy_costs.FULL).all()


@pytest.mark.parametrize('min_disparity', [-3, 2])
def test_the_smallest_disparity_moves_the_labels(min_disparity):
    left, right = small_pair(30, 80, disparity=5, channels=3)
    costs = looked(left, right, 12, MODEL._replace(rounds=2), min_disparity).costs
    assert np.median(costs[:, 14:70].argmin(axis=2)) == 5 - min_disparity


def test_threads_share_work_and_never_change_a_cost():
    left, right = small_pair(140, 90, channels=3)
    one, two = (looked(left, right, 40, MODEL._replace(rounds=2), threads=threads).costs
                for threads in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_arms_are_stricter_far_from_their_centre():
    assert MUCH_ALIKE < ALIKE
