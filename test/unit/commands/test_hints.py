# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the commands say where little or nothing can be matched."""
import json
from pathlib import Path

from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest

SHAPE = 60, 100
WORDS = ('match', 'left.png', 'right.png', '--disparities', '16', '--output', 'out.pfm',
         '--overwrite')


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
    assert 'no pixel has ground truth' in capsys.readouterr().out.splitlines()
    assert main(['evolve', *WORDS[1:5], '--picture', 'evolution.png', *truth]) != 0
    assert 'no pixel of truth.pfm counts' in capsys.readouterr().err


def test_match_gives_the_cause_as_a_hint_in_words_and_in_json(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made = make_pair(240, 320, 32, seed=2, objects=6, noise=1.5)
    write_image('left.png', made.right)
    write_image('right.png', made.left)
    words = [*WORDS[:4], '32', *WORDS[5:]]
    assert main([*words, '--json']) == 0
    hint = json.loads(capsys.readouterr().out)['hint']
    assert (hint['cause'], hint['warns']) == ('swapped', True)
    assert main(words) == 0
    assert f"hint: {hint['sentence']}" in capsys.readouterr().out.splitlines()
    write_image('left.png', made.left)
    write_image('right.png', made.right)
    assert main(words) == 0
    assert 'hint' not in capsys.readouterr().out


def test_replay_gives_each_cause_as_a_hint_once(tmp_path, monkeypatch, capsys):
    made_bags = pytest.importorskip('made_bags')
    monkeypatch.chdir(tmp_path)
    made = make_pair(240, 320, 32, seed=2, objects=6, noise=1.5)
    swapped = made._replace(left=made.right, right=made.left)
    made_bags.write_bag(tmp_path / 'bag', pairs=[made, swapped, swapped])
    words = 'replay', 'bag', '--disparities', '32', '--output'
    assert main([*words, 'one', '--json']) == 0
    (hint,) = json.loads(capsys.readouterr().out)['hints']
    assert hint.startswith('left and right are swapped: ')
    assert main([*words, 'two']) == 0
    assert capsys.readouterr().out.count(f'hint: {hint}') == 1


def test_evaluate_gives_the_cause_as_a_hint_of_a_scene(black, capsys):
    pytest.importorskip('jinja2')
    folder = Path('black')
    folder.mkdir()
    for name in ('left.png', 'right.png'):
        Path(name).rename(folder / name)
    Path('truth.pfm').rename(folder / 'groundtruth.pfm')
    words = 'evaluate', 'black', '--disparities', '16', '--repeats', '1', '--matcher', 'ours'
    assert main(list(words)) == 0
    assert 'hint: black: the left and right images are black' in capsys.readouterr().out
    assert main([*words, '--json']) == 0
    assert 'are black' in json.loads(capsys.readouterr().out)['records'][0]['hint']
