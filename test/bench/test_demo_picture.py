# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of the demo shows what it is given, invalid pixels included."""
import os

from bench.demo.picture import write_panel
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest


@pytest.mark.slow
def test_a_panel_of_many_bits_is_drawn(tmp_path):
    pair = make_pair(40, 60, 16, bits=12)
    disparity = np.where(pair.visible, pair.truth, np.nan)
    write_panel(tmp_path / 'panel.png', pair.left, disparity, pair.visible.astype(np.float32),
                pair.truth, low=0, high=15, title='made')
    picture = read_image(tmp_path / 'panel.png')
    assert os.listdir(tmp_path) == ['panel.png']
    assert picture.shape[1] > 1000
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200


def test_a_panel_shows_an_error_where_there_is_one(tmp_path):
    pair = make_pair(60, 80, 16, colour=True)
    sure = np.ones((60, 80), np.float32)
    bright = []
    for name, wrong in (('right', pair.truth), ('wrong', pair.truth + 3)):
        write_panel(tmp_path / f'{name}.png', pair.left, wrong, sure, pair.truth, low=0, high=15)
        picture = read_image(tmp_path / f'{name}.png')
        rows, columns = picture.shape[:2]
        error = picture[rows * 6 // 10:rows * 9 // 10, columns * 4 // 10:columns * 5 // 10]
        bright.append(error.mean())
    assert bright[0] < 5 and bright[1] > 100


def test_a_panel_without_any_valid_pixel_is_drawn(tmp_path):
    nothing = np.full((20, 30), np.nan)
    write_panel(tmp_path / 'panel.png', np.zeros((20, 30), np.uint8), nothing,
                np.zeros((20, 30)), nothing, low=0, high=15)
    assert (tmp_path / 'panel.png').stat().st_size > 1000


def test_an_unknown_suffix_is_rejected_and_nothing_written(tmp_path):
    with pytest.raises(ValueError, match='allowed are .png, .pdf, .svg'):
        write_panel(tmp_path / 'panel.docx', np.zeros((2, 2), np.uint8), np.zeros((2, 2)),
                    np.zeros((2, 2)), np.zeros((2, 2)), low=0, high=1)
    assert os.listdir(tmp_path) == []
