# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The nearest features of two images among those that a rectified pair allows."""
import cv2
from fuzzy_stereo_ros.matching.kernels.possibility.row_alignment import nearest_features
from hypothesis import given, settings, strategies as st
import numpy as np

LOWEST, HIGHEST, APART = map(np.float32, (-2, 9, 4))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**20), st.integers(1, 60), st.integers(1, 60), st.integers(1, 256))
def test_features_are_matched_as_by_the_brute_force_matcher_of_opencv(seed, number, others, most):
    """With few different bits several features are equally near."""
    draw = np.random.default_rng(seed)
    places, other_places = (draw.integers(0, 20, (2, count)).astype(np.float32)
                            for count in (number, others))
    bits, other_bits = (draw.integers(0, most, (count, 32)).astype(np.uint8)
                        for count in (number, others))
    nearest, distances = np.empty(number, np.int32), np.empty(number, np.int32)
    nearest_features(places, bits.view(np.uint32), other_places, other_bits.view(np.uint32),
                     LOWEST, HIGHEST, APART, nearest, distances)

    across, down = places[:, :, None] - other_places[:, None]
    allowed = (across >= LOWEST) & (across <= HIGHEST) & (abs(down) <= APART)
    found = cv2.BFMatcher(cv2.NORM_HAMMING).match(bits, other_bits, allowed.astype(np.uint8))
    expected = {one.queryIdx: (one.trainIdx, one.distance) for one in found}
    assert {one: (nearest[one], distances[one])
            for one in np.flatnonzero(nearest >= 0)} == expected
