# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The benches read the data right: scale, masks, limits, frames; a page has a section a suite."""
import re
import subprocess

from bench import datasets, paper_tables
from bench.datasets import available_scenes, available_sequences, data_folder
from bench.page import check_page, HEADING, write_section
from bench.request import commit_of
from bench.scoring import bad_percent
from fuzzy_stereo_ros.evaluation.report import Report
from fuzzy_stereo_ros.pairs.image_files import write_image
from made_scenes import COLUMNS, known as made_known, ROWS, small_scene
import numpy as np
import pytest


@pytest.fixture
def data(tmp_path):
    """Make a data directory with a few folders in the formats of the real ones."""
    known = made_known(colour=True)
    folders = {'middv2/tsukuba': 16, 'middv2/teddy': 4, 'midd2006_third/Aloe': 3}
    for folder, scale in folders.items():
        (tmp_path / folder).mkdir(parents=True)
        write_image(tmp_path / folder / 'left.png', known.left)
        write_image(tmp_path / folder / 'right.png', known.right)
        truth = np.full((ROWS, COLUMNS), 6 * scale, np.uint8)
        truth[0, 0] = 0
        if scale == 16:
            truth = np.dstack([truth] * 3)
        write_image(tmp_path / folder / 'groundtruth.png', truth)
        mask = np.full((ROWS, COLUMNS), 255, np.uint8)
        mask[:, -2:] = 128
        name = 'nonocc.png' if 'middv2' in folder else 'nonocc_derived.png'
        write_image(tmp_path / folder / name, mask)
    drive = tmp_path / 'kitti2012_seq' / '000027'
    drive.mkdir(parents=True)
    for number in ('07', '08', '09', '10', '11'):
        write_image(drive / f'left_{number}.png', known.left)
        write_image(drive / f'right_{number}.png', known.right)
    (drive / 'calib.txt').write_text(
        'P0: 70 0 30 0 0 71 20 0 0 0 1 0\nP1: 70 0 28 -35 0 71 20 0 0 0 1 0\n')
    for name in ('disp_occ_10.png', 'disp_noc_10.png'):
        write_image(drive / name, np.full((ROWS, COLUMNS), 6 * 256 + 128, np.uint16))
    return tmp_path


def test_scenes_are_read_with_the_scale_of_their_folder(data):
    scenes, skipped = available_scenes(data, 'mid')
    read = {scene.path: scene.read() for scene in scenes if scene.group != 'midd2014'}
    assert set(read) == {'middv2/tsukuba', 'middv2/teddy', 'midd2006_third/Aloe'}
    for known in read.values():
        assert known.truth.dtype == np.float32
        assert np.isnan(known.truth[0, 0])
        assert (known.truth.ravel()[1:] == 6).all()
        assert known.counts[:, :-2].all()
        assert not known.counts[:, -2:].any()
    assert 'no folder: middv2 (venus, cones)' in skipped
    assert any('sawtooth' in sentence for sentence in skipped)


@pytest.mark.parametrize(('path', 'limit', 'right', 'wrong'), [
    ('kitti/kitti2012_seq/000027', 3, 6.5 + 2.9, 6.5 + 3.1),
    ('middv2/tsukuba', 1, 7.4, 7.6), ('middv2/teddy', 1, 6.9, 7.4)])
def test_a_scene_is_scored_in_its_unit_at_its_limit_and_rounded_where_its_truth_is_whole(
        data, path, limit, right, wrong):
    (scene,), _ = available_scenes(data, path)
    assert scene.limit == limit
    known = scene.read()
    for disparity, percent in ((right, 0), (wrong, 100)):
        found = np.full((ROWS, COLUMNS), disparity, np.float32)
        assert bad_percent(found, known, scene.limit) == percent


def test_a_truth_without_its_right_half_is_carried_over(data):
    (scene,) = available_scenes(data, 'middv2/teddy')[0]
    known = paper_tables.from_right(scene)
    assert (known.truth[1:, :COLUMNS - 6] == 6).all()
    assert np.isnan(known.truth[:, COLUMNS - 6:]).all()
    np.testing.assert_array_equal(known.counts, np.isfinite(known.truth))


def test_the_data_folder_is_the_one_given_then_that_of_the_environment(
        data, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(datasets.DATA_VARIABLE, raising=False)
    assert data_folder() is None
    monkeypatch.setenv(datasets.DATA_VARIABLE, str(data))
    assert data_folder() == data
    assert data_folder(data / 'middv2') == data / 'middv2'
    with pytest.raises(ValueError, match='no folder elsewhere'):
        data_folder('elsewhere')


def test_a_measurement_names_the_commit_of_its_code(tmp_path):
    def git(*words):
        subprocess.run(['git', '-c', 'user.name=a', '-c', 'user.email=b', *words], cwd=tmp_path,
                       check=True, capture_output=True)
    code = tmp_path / 'code'
    code.mkdir()
    (code / 'one.py').touch()
    assert commit_of(code) == 'unknown, this is no checkout'
    git('init')
    git('add', '.')
    git('commit', '--message', 'First', '--date', '2020-02-03T12:00:00Z')
    commit = commit_of(code)
    assert re.fullmatch('[0-9a-f]{7,}, 2020-02-03', commit)
    (tmp_path / 'page.md').touch()
    git('add', '.')
    git('commit', '--message', 'A page')
    assert commit_of(code) == commit
    (code / 'two.py').touch()
    assert commit_of(code) == f'{commit}, with changes'


def test_a_window_pans_over_image_and_truth_alike():
    frames = datasets.window(small_scene(), 0, 2, frames=4)
    whole = made_known()
    for number, frame in enumerate(frames):
        part = slice(2 * number, 2 * number + COLUMNS - 6)
        np.testing.assert_array_equal(frame.left, whole.left[:, part])
        np.testing.assert_array_equal(frame.truth, whole.truth[:, part])
        outside = np.arange(COLUMNS - 6) < frame.truth
        assert not frame.counts[outside].any()


def test_noise_is_fresh_in_every_frame_and_image():
    whole = made_known()
    noises = [image.astype(float) - clean for frame in datasets.window(
        small_scene(), 6, 0, frames=3)
        for image, clean in ((frame.left, whole.left), (frame.right, whole.right))]
    assert [noise.std() for noise in noises] == pytest.approx([6] * 6, rel=0.1)
    assert np.corrcoef([noise.ravel() for noise in noises])[0, 1:].max() < 0.1


def test_sequences_that_need_data_are_available_or_reported_missing(data):
    kinds, missing = available_sequences(None, [small_scene(1), small_scene(2)])
    assert missing == ['no folder: kitti2012_seq/000027', 'no folder: kitti2012_seq/000138',
                       'no folder: euroc_v101_rect']
    assert 'KITTI drive' not in {one.group for one in kinds}
    found, missing = available_sequences(data, [small_scene(1), small_scene(2)])
    assert missing == ['no folder: kitti2012_seq/000138', 'no folder: euroc_v101_rect']
    assert found[0].camera == (70, 71, 30, 20, 2, None)
    drive = found[0].read()
    assert [frame.truth is not None for frame in drive] == [False, False, False, True]
    assert [one.group for one in found[:6]] == [
        f'KITTI drive{how}{noise}' for noise in ('', ', noise 3')
        for how in ('', ', every other frame', ', backwards')]
    differences = [noisy.left.astype(int) - clean.left
                   for noisy, clean in zip(found[3].read(), drive)]
    assert [difference.std() for difference in differences] == pytest.approx([3] * 4, rel=0.1)


def test_only_the_own_section_is_replaced_and_pictures_are_written_beside_the_page(tmp_path):
    page = tmp_path / 'page.md'
    for value, name in (('first', 'accuracy'), ('second', 'speed'), ('third', 'accuracy')):
        write_section(page, Report(name, name.title(), {'value': value}, [], [],
                                   {f'{name}.svg': b'<svg/>'}))
    text = page.read_text()
    assert text.startswith(HEADING)
    assert text.count('## Accuracy') == text.count('## Speed') == 1
    assert 'first' not in text
    assert text.index('third') < text.index('second')
    assert '![Accuracy](accuracy.svg)' in text
    assert (tmp_path / 'accuracy.svg').read_bytes() == b'<svg/>'


def test_a_file_that_is_no_page_of_benchmarks_is_not_written_to(tmp_path):
    other = tmp_path / 'other.md'
    other.write_text('# Mine\n')
    for path, reason in ((other, 'is no page of benchmarks'), (tmp_path / 'page.txt', 'suffix'),
                         (tmp_path / 'no' / 'page.md', 'no folder')):
        with pytest.raises(ValueError, match=reason):
            check_page(path)
