# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""OpenCV's matchers are set as said, their gaps filled by the rule, and the right pixels count."""
from bench.scoring import cross_checked, DEFAULT
import cv2
from fuzzy_stereo_ros.evaluation.baselines import dense
from fuzzy_stereo_ros.evaluation.ground_truth import (
    agreeing, MIDDLEBURY, seen_by_both, warped_to_right)
import numpy as np
import pytest

NAN = np.nan


COMMON = {'NumDisparities': 64, 'MinDisparity': 0, 'BlockSize': 15, 'PreFilterCap': 31,
          'UniquenessRatio': 15, 'Disp12MaxDiff': 0, 'SpeckleWindowSize': 100, 'SpeckleRange': 4}
OWN = {'BM': {'TextureThreshold': 10, 'PreFilterSize': 9}, **{
    name: {'P1': 200, 'P2': 400, 'Mode': mode} for name, mode in (
        ('SGBM', cv2.StereoSGBM_MODE_SGBM), ('3WAY', cv2.StereoSGBM_MODE_SGBM_3WAY),
        ('HH4', cv2.StereoSGBM_MODE_HH4))}}


def test_default_baselines_are_set_as_stereo_image_proc_sets_them():
    for baseline in DEFAULT:
        matcher = baseline.matcher(MIDDLEBURY, 64).opencv
        for name, value in {**COMMON, **OWN[baseline.algorithm]}.items():
            assert getattr(matcher, f'get{name}')() == value, (baseline.name, name)


def plain_dense(disparity):
    """Return the dense rule, pixel by pixel."""
    filled = disparity.copy()
    for row, column in np.argwhere(np.isnan(disparity)):
        sides = [[value for value in side if not np.isnan(value)]
                 for side in (disparity[row, :column][::-1], disparity[row, column + 1:])]
        filled[row, column] = min((side[0] for side in sides if side), default=NAN)
    known = [row for row in range(len(filled)) if not np.isnan(filled[row, 0])]
    for row in range(len(filled)):
        if known:
            filled[row] = filled[min(known, key=lambda other, row=row: abs(other - row))]
    return cv2.medianBlur(filled if known else np.zeros_like(filled), 5)


@pytest.mark.parametrize('share', [0.0, 0.3, 0.9, 1.0])
@pytest.mark.parametrize('shape', [(1, 7), (9, 1), (13, 17)])
def test_the_dense_rule_is_that_of_its_plain_twin(shape, share):
    random = np.random.default_rng(3)
    disparity = random.uniform(0, 60, shape).astype(np.float32)
    disparity[random.random(shape) < share] = NAN
    if shape[0] > 4:
        disparity[1:4] = NAN
    np.testing.assert_array_equal(dense(disparity), plain_dense(disparity))


def test_a_pixel_counts_where_the_right_image_shows_it():
    truth = np.array([[0, 2, 1, 1, 3, NAN, 0, 0]], np.float32)
    # Columns 2 and 4 meet in column 1, where the nearer one hides the other.
    np.testing.assert_array_equal(
        seen_by_both(truth), [[True, False, False, True, True, False, True, True]])
    np.testing.assert_array_equal(
        warped_to_right(truth), np.array([[0, 3, 1, NAN, NAN, NAN, 0, 0]], np.float32))


def test_truths_of_both_images_are_cross_checked_from_either_one():
    left = np.array([[9, 9, 2, 2, 3, 2, 2, 4]], np.float32)
    right = np.array([[2, 3, 3, 2, 2, 2, NAN, 9]], np.float32)
    np.testing.assert_array_equal(
        cross_checked(right, left), [[True, True, True, True, True, False, False, False]])
    np.testing.assert_array_equal(
        agreeing(left, right), [[False, False, True, True, True, True, True, False]])
