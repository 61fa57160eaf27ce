# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Images of 16 bits, shown with 8."""
from fuzzy_stereo_ros.pairs.colours import in_eight_bits
import numpy as np
import pytest


def test_an_image_of_eight_bits_stays_the_same():
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert in_eight_bits(image) is image


@pytest.mark.parametrize('largest', [1023, 4095, 65535])
def test_the_brightest_channel_of_sixteen_bits_becomes_255(largest):
    image = np.array([[[0, largest // 2, largest], [0, 0, largest // 5]]], np.uint16)
    shown = in_eight_bits(image)
    assert shown.dtype == np.uint8
    np.testing.assert_array_equal(shown, np.rint(image * (255 / largest)))


def test_a_black_image_of_sixteen_bits_stays_black():
    assert not in_eight_bits(np.zeros((2, 3), np.uint16)).any()
