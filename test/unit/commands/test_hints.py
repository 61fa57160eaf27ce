# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the commands say where little can be matched, and of rows that do not fit each other."""
from functools import partial
from pathlib import Path

from bench.conditions import misaligned
from command_output import printed
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.camera_files import (
    centred_calibration, rectified_cameras, write_camera)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest
from written_scenes import write_named

BLACK = 60, 100
DISPARITIES = 32
MADE = make_pair(240, 320, DISPARITIES, seed=2, objects=6, noise=2.0)
SMALL = make_pair(48, 80, DISPARITIES)
SHIFTED = MADE._replace(right=misaligned(MADE.right, tilt=0.8))
SWAPPED = MADE._replace(left=MADE.right, right=MADE.left)


@pytest.fixture
def told(folder, capsys):
    """Work in a folder; return a function that gives what a command prints, lines or JSON."""
    return partial(printed, capsys)


def match_of(left, right, *options, disparities=DISPARITIES):
    """Write a pair and return the words that match it."""
    write_image('left.png', left)
    write_image('right.png', right)
    return ['match', 'left.png', 'right.png', '--disparities', disparities, '--output', 'out.pfm',
            '--overwrite', *options]


def test_no_figure_of_nothing_is_printed_and_evolve_rejects_a_truth_of_nothing(told, capsys):
    write_disparity('truth.pfm', np.full(BLACK, 5, np.float32))
    words = match_of(*np.zeros((2, *BLACK), np.uint8), '--ground-truth', 'truth.pfm',
                     disparities=16)
    said, mask = told(*words), ('--mask', 'mask.png')
    assert 'none of 6000 pixels with ground truth has a disparity' in said
    assert 'nan' not in said
    write_image('mask.png', np.zeros(BLACK, np.uint8))
    assert 'no pixel has ground truth' in told(*words, *mask).splitlines()
    assert main(['evolve', *map(str, words[1:5]), *words[-2:], *mask]) != 0
    assert 'no pixel of truth.pfm counts' in capsys.readouterr().err


def assert_shifted(found):
    assert found['tilt'] == pytest.approx(0.8, abs=0.1)
    assert found['undone']
    assert found['faults'] == ['tilt']
    assert found['advice'].startswith('recalibrate: the right image is 0.')


def test_match_tells_the_cause_and_the_rows_in_words_and_in_json(told):
    words = match_of(*SWAPPED[:2])
    hint = told(*words, '--json')['hint']
    assert (hint['cause'], hint['warns']) == ('swapped', True)
    assert f"hint: {hint['sentence']}" in told(*words).splitlines()
    words = match_of(*SHIFTED[:2])
    found, said = told(*words, '--json'), told(*words)
    assert_shifted(found['misalignment'])
    assert f"row offset: {found['row_offset']}" in said.splitlines() and 'hint' not in said


# ---- the cameras ----


@pytest.mark.parametrize('baseline, start', [
    (75.0, 'the baseline is 75 m; if that is meant to be cm or mm'),
    (0.0, 'the baseline is 0 m, as P[3] of the right camera_info is not -fx * baseline: ')])
def test_a_remark_on_the_cameras_is_told_alike_by_all_commands(told, capsys, baseline, start):
    for side, camera in rectified_cameras(
            centred_calibration(300.0, baseline, 0.0, 48, 80), 48, 80).items():
        write_camera(f'{side}.yaml', camera, side)
    match = match_of(*SMALL[:2], '--calibration', 'left.yaml', 'right.yaml')
    (remark,) = told(*match, '--json')['remarks']
    assert remark.startswith(start)
    assert f'remark: {remark}' in told(*match).splitlines()
    assert remark in told(*match, '--rectify')
    folders = 'left.png', 'right.png', '--calibration', 'left.yaml', 'right.yaml'
    assert f'    # remark: {remark}' in told('suggest', *folders).splitlines()
    replay = 'replay', *folders, '--disparities', str(DISPARITIES), '--overwrite', '--output'
    assert told(*replay, 'one', '--json')['remarks'] == [remark]
    assert main([*replay, 'two', '--with', 'depth']) == 0 and remark in capsys.readouterr().err
    metric = ([*match, '--depth', 'depth.npy'], ['convert', 'out.pfm', 'depth.npy', '--to',
                                                 'depth', *folders[2:], '--overwrite'])
    for words in metric if baseline else ():
        assert f'remark: {remark}' in told(*words).splitlines()
    for words in () if baseline else metric:
        assert main([*map(str, words)]) == 2
        assert f' needs a baseline: {remark}' in capsys.readouterr().err


def test_the_unit_of_lengths_is_that_of_a_calibration(told):
    rig = centred_calibration(300.0, 75.0, 0.0, 48, 80)
    write_camera('right.yaml', rectified_cameras(rig, 48, 80)['right'], 'right')
    match = match_of(*SMALL[:2], '--calibration', 'right.yaml')
    assert 'remark' not in told(*match, '--unit', 'mm')
    assert 'baseline 0.75 m' in told(*match, '--unit', 'cm')


# ---- rows ----


def test_replay_gives_each_cause_as_a_hint_once_and_reports_misalignment(told):
    made_bags = pytest.importorskip('made_bags')
    swapped = SHIFTED._replace(left=SHIFTED.right, right=SHIFTED.left)
    made_bags.write_bag(Path('bag'), pairs=[SHIFTED, SHIFTED, swapped, swapped])
    words = 'replay', 'bag', '--disparities', DISPARITIES, '--output'
    found = told(*words, 'one', '--json')
    (hint,) = found['hints']
    assert hint.startswith('left and right are swapped: ')
    assert_shifted(found['misalignment'])
    lines = told(*words, 'two').splitlines()
    assert lines.count(f'hint: {hint}') == 1
    assert any(line.startswith('row offset: right image against left, tilt +0.')
               and 'recalibrate' in line for line in lines)


def test_evaluate_has_columns_and_a_table(told):
    pytest.importorskip('jinja2')
    write_named(Path('shifted'), SHIFTED)
    words = ('evaluate', 'shifted', '--disparities', DISPARITIES, '--repeats', 1, '--matcher',
             'ours')
    records = told(*words, 'opencv:bm', '--json')['records']
    ours, theirs = ([one for one in records if one['matcher'] == name and one['kind'] == 'scene']
                    for name in ('ours', 'opencv:bm'))
    for record in ours:
        assert record['row_tilt'] == pytest.approx(0.8, abs=0.1)
        assert record['row_doubt'] < 0.05
        assert record['row_advice'].startswith('recalibrate')
    assert theirs and not any('row_tilt' in record for record in theirs)
    text = told(*words)
    assert text.count('### Row offsets') == 1 and '| recalibrate: the right image' in text
    assert 'Row offsets' not in told(*words[:-1], 'opencv:bm')
