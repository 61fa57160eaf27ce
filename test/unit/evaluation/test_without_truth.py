# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo evaluate` measures of pairs whose disparities nobody knows."""
import csv

from command_output import printed
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import numpy as np
import pytest
from written_scenes import write_images

pytest.importorskip('jinja2', reason='the extra evaluate is not installed')


@pytest.fixture
def folder(folder):
    """Work in a folder with the frames of a still scene, and with those of no scene."""
    for number, pair in enumerate(make_sequence(60, 120, 24, 3, seed=3, noise=3.0)):
        write_images(folder, pair, f'left/{number}.png', f'right/{number}.png')
        write_images(folder, pair._replace(right=np.random.default_rng(number).integers(
            0, 255, pair.left.shape, np.uint8)), f'left/{number}.png', f'unlike/{number}.png')
    return folder


def records(capsys, *words):
    found = printed(capsys, 'evaluate', *words, '--repeats', 1, '--json')['records']
    return {(one['matcher'], one['start']): one for one in found if one['map'] == 'as it comes'}


def test_maps_agree_where_both_images_show_the_scene_and_not_where_they_show_two(folder, capsys):
    like = records(capsys, 'left', 'right', '--matcher', 'ours', 'opencv:sgbm')
    unlike = records(capsys, 'left', 'unlike', '--frames', '1', '--matcher', 'ours')
    assert set(like) == {('ours', 'cold'), ('ours', 'warm'), ('opencv:sgbm', '')}
    for one in like.values():
        assert one['agree'] > 90 and one['covered'] > 50 and one['milliseconds'] > 0
    assert unlike['ours', 'cold']['covered'] < 25
    assert like['ours', 'warm']['confidence'] > 0.5
    assert like['opencv:sgbm', '']['confidence'] is None        # it has none
    assert all(0 <= one['flicker'] < 5 for one in like.values())        # the scene stays


def test_a_folder_of_scenes_is_measured_scene_by_scene_and_in_the_mean(folder, capsys):
    for number, pair in enumerate(make_sequence(60, 120, 24, 2, noise=3.0)):
        write_images(folder / 'data' / str(number), pair._replace(  # of two sizes
            left=pair.left[number:], right=pair.right[number:]), 'left.png', 'right.png')
    told = printed(capsys, 'evaluate', 'data', '--repeats', 1, '--matcher', 'ours', 'opencv:bm',
                   '--csv', 'rows.csv', '--html', 'page.html')
    assert 'mean of 2' in told and 'truth, each' in told
    rows = [*csv.DictReader((folder / 'rows.csv').read_text().splitlines())]
    assert [(one['name'], one['matcher']) for one in rows[::2]] == [
        (scene, matcher) for scene in '01' for matcher in ('ours', 'opencv:bm')]
    mean = np.mean([float(one['covered']) for one in rows if one['matcher'] == 'ours'])
    assert f'{mean:.2f}' in told
    assert (folder / 'page.html').read_text().count('disparity by ours') == 2 * 2


def test_a_single_pair_has_no_flicker_and_the_page_has_its_pictures(folder, capsys):
    found = records(capsys, 'left', 'right', '--frames', '1', '--matcher', 'ours', '--html',
                    'page.html', '--disparities', '24', '--focal', '100', '--baseline', '120')
    assert [*found] == [('ours', 'cold')] and 'flicker' not in found['ours', 'cold']
    page = (folder / 'page.html').read_text()
    for words in ('left image', 'disparity by ours', 'confidence by ours', '24 disparities',
                  'the baseline is 120 m; if that is meant to be cm or mm',
                  'None of these tells whether a disparity is right'):
        assert words in page
    assert page.count('data:image/webp') == 3
