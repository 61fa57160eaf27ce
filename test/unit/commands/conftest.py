# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A pair and its truth, as files of the folder in which a command runs."""
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest


@pytest.fixture(scope='module')
def pair():
    return make_pair(48, 80, 16, seed=3)


@pytest.fixture
def pair_folder(folder, pair):
    """Work in a folder with a pair and its truth."""
    write_image('left.png', pair.left)
    write_image('right.png', pair.right)
    write_disparity('truth.pfm', pair.truth)
    write_image('visible.png', np.where(pair.visible, 255, 128).astype(np.uint8))
    return folder
