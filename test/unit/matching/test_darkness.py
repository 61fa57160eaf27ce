# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Dark pictures of a camera of more than 8 bits lose nearly nothing on the way to a disparity."""
from functools import cache

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from made_messages import image, info
import numpy as np
import pytest
from real_pairs import motorcycle

DARK = 0.05     # of the range


@cache
def disparity_of(bits, brightness, faulty=0):
    """
    Return the disparity of the motorcycle as a grey camera of some bits sends it.

    faulty: how many pixels of each image are white whatever they see.
    """
    chance = np.random.default_rng(0)
    pair, messages = motorcycle(), []
    for shown, tx in ((pair.left, 0.0), (pair.right, -24.0)):
        grey = shown @ [0.25, 0.5, 0.25] / 255 * brightness
        pixels = np.rint(grey * (2**bits - 1)).astype(np.uint8 if bits == 8 else np.uint16)
        pixels.reshape(-1)[chance.choice(pixels.size, faulty, replace=False)] = 2**bits - 1
        rows, columns = pixels.shape
        messages += [image(pixels, 'mono8' if bits == 8 else 'mono16'),
                     info(tx, height=rows, width=columns)]
    read = PairReader().read(*messages)
    config = MatcherConfig.from_profile('realtime', disparities=pair.disparities, fill=True)
    return StereoMatcher(config).match(read.left, read.right).disparity


def bad_1(bits, brightness=1.0, faulty=0):
    """Return percent of the pixels seen by both that are wrong by more than 1 px."""
    pair = motorcycle()
    found = disparity_of(bits, brightness, faulty)
    return score(found, pair.truth, pair.visible).bad_dense[1.0]


@pytest.mark.parametrize('bits', [12, 14, 16])
def test_a_dark_pair_of_many_bits_is_matched_nearly_as_well_as_a_bright_one_of_8(bits):
    assert bad_1(bits, DARK) < bad_1(8) + 0.3


def test_the_same_dark_pair_in_8_bits_is_matched_much_worse():
    assert bad_1(8, DARK) > bad_1(12, DARK) + 5


def test_faulty_pixels_do_not_take_the_grey_levels_of_a_dark_pair():
    assert bad_1(12, DARK, faulty=60) < bad_1(12, DARK) + 0.1


@pytest.mark.parametrize('bits', [10, 12, 16])
def test_a_bright_pair_of_many_bits_is_matched_no_worse_than_one_of_8(bits):
    assert bad_1(bits) < bad_1(8) + 0.1


@pytest.mark.parametrize('bits', [10, 12])
def test_the_number_of_bits_hardly_changes_the_disparities_of_a_scene(bits):
    assert np.mean(abs(disparity_of(bits, 1.0) - disparity_of(16, 1.0)) > 1) < 0.01
