# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the commands say where little or nothing can be matched."""
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
import numpy as np
import pytest

SHAPE = 60, 100
WORDS = 'match', 'left.png', 'right.png', '--disparities', '16', '--output', 'out.pfm'


@pytest.fixture
def black(tmp_path, monkeypatch):
    """Work in a folder with a pair of black images, and a truth for it."""
    monkeypatch.chdir(tmp_path)
    for name in ('left.png', 'right.png'):
        write_image(name, np.zeros(SHAPE, np.uint8))
    write_disparity('truth.pfm', np.full(SHAPE, 5, np.float32))


def test_no_figure_of_nothing_is_printed(black, capsys):
    assert main([*WORDS, '--ground-truth', 'truth.pfm']) == 0
    printed = capsys.readouterr().out
    assert 'none of 6000 pixels with ground truth has a disparity' in printed
    assert 'nan' not in printed


def test_match_says_that_no_pixel_has_ground_truth_and_evolve_rejects_it(black, capsys):
    write_image('mask.png', np.zeros(SHAPE, np.uint8))
    truth = '--ground-truth', 'truth.pfm', '--mask', 'mask.png'
    assert main([*WORDS, *truth]) == 0
    assert capsys.readouterr().out.endswith('no pixel has ground truth\n')
    assert main(['evolve', *WORDS[1:5], '--picture', 'evolution.png', *truth]) != 0
    assert 'no pixel of truth.pfm counts' in capsys.readouterr().err
