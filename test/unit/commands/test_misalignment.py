# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`match`, `replay` and `evaluate` tell whether the rows of the images fit each other."""
import json

from bench.conditions import misaligned
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import pytest

DISPARITIES = 32
MADE = make_pair(240, 320, DISPARITIES, seed=2, objects=6, noise=2.0)
SHIFTED = misaligned(MADE.right, tilt=0.8)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Work in a folder with a pair whose rows do not fit, and its truth."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / 'shifted'
    folder.mkdir()
    write_image(folder / 'left.png', MADE.left)
    write_image(folder / 'right.png', SHIFTED)
    write_disparity(folder / 'groundtruth.pfm', MADE.truth)
    return folder


def printed(capsys, *words):
    assert main([*map(str, words)]) == 0
    return capsys.readouterr().out


def assert_shifted(found):
    assert found['tilt'] == pytest.approx(0.8, abs=0.1)
    assert found['undone']
    assert found['faults'] == ['tilt']
    assert found['advice'].startswith('recalibrate: the right image is 0.')


@pytest.mark.parametrize('reference', ['left', 'right'])
def test_match_reports_misalignment_as_json_and_in_words(folder, capsys, reference):
    words = ('match', folder / 'left.png', folder / 'right.png', '--disparities', DISPARITIES,
             '--output', 'out.pfm', '--overwrite', '--reference', reference)
    found = json.loads(printed(capsys, *words, '--json'))
    assert_shifted(found['misalignment'])
    assert f"row offset: {found['row_offset']}" in printed(capsys, *words).splitlines()


def test_match_reports_null_for_images_too_small_to_measure(folder, capsys):
    for name in ('left', 'right'):
        write_image(f'{name}.png', MADE.left[:40])
    words = ('match', 'left.png', 'right.png', '--disparities', 8, '--output', 'out.pfm',
             '--overwrite')
    assert json.loads(printed(capsys, *words, '--json'))['misalignment'] is None
    assert 'row offset: not measured: too few points' in printed(capsys, *words)


def test_replay_reports_misalignment_in_its_summary(folder, capsys):
    made_bags = pytest.importorskip('made_bags')
    made_bags.write_bag(folder / 'bag', pairs=[MADE._replace(right=SHIFTED)] * 2)
    words = 'replay', folder / 'bag', '--disparities', DISPARITIES, '--output'
    found = json.loads(printed(capsys, *words, 'one', '--json'))['misalignment']
    assert_shifted(found)
    lines = printed(capsys, *words, 'two').splitlines()
    assert any(line.startswith('row offset: right image against left, tilt +0.')
               and 'recalibrate' in line for line in lines)


def test_evaluate_has_columns_and_a_table(folder, capsys):
    pytest.importorskip('jinja2')
    words = 'evaluate', folder, '--disparities', DISPARITIES, '--repeats', 1, '--matcher', 'ours'
    records = json.loads(printed(capsys, *words, 'opencv:bm', '--json'))['records']
    ours, theirs = ([one for one in records if one['matcher'] == name and one['kind'] == 'scene']
                    for name in ('ours', 'opencv:bm'))
    for record in ours:
        assert record['row_tilt'] == pytest.approx(0.8, abs=0.1)
        assert record['row_doubt'] < 0.05
        assert record['row_advice'].startswith('recalibrate')
    assert theirs and not any('row_tilt' in record for record in theirs)
    text = printed(capsys, *words)
    assert text.count('### Row offsets') == 1 and '| recalibrate: the right image' in text
    assert 'Row offsets' not in printed(capsys, *words[:-1], 'opencv:bm')
