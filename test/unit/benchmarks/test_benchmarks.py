# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: the data is read right, baselines are set as said, figures are what they say."""
from dataclasses import replace
import io
import json
import re
import subprocess
from xml.etree import ElementTree

import cv2
from fuzzy_stereo_ros.benchmarks import (
    accuracy, datasets, paper_frames, paper_tables, presets, speed, warm)
from fuzzy_stereo_ros.benchmarks.datasets import (
    available_scenes, available_sequences, data_folder)
from fuzzy_stereo_ros.benchmarks.page import check_page, HEADING, write_section
from fuzzy_stereo_ros.benchmarks.request import commit_of
from fuzzy_stereo_ros.benchmarks.variants import PAPER_OPERATORS
from fuzzy_stereo_ros.commands.benchmark import BENCHMARKS
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation import baselines
from fuzzy_stereo_ros.evaluation.baselines import (
    DEFAULT, dense, opencv_threads, STRICTEST, TUNED, TUNED_SETTINGS)
from fuzzy_stereo_ros.evaluation.catalogue import Sequence
from fuzzy_stereo_ros.evaluation.ground_truth import (
    agreeing, bad_percent, cross_checked, KITTI, MIDDLEBURY, seen_by_both, warped_to_right)
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import markdown, Report, Table
from fuzzy_stereo_ros.evaluation.scores import (
    BINS, left_right_sureness, reliability, sparsification)
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.progress import follow
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pandas as pd
import pytest
from small_scenes import (
    assert_columns_have_names_of_their_own, COLUMNS, DISPARITIES, known as made_known, request_for,
    ROWS, small_scene)

NAN = np.nan
SmallRequest = request_for([small_scene(seed) for seed in (1, 2)])


# Baselines.

def settings_of(matcher):
    """Return what OpenCV's object is set to: block, cap, uniqueness, left-right, speckles, P."""
    shared = (matcher.getBlockSize(), matcher.getPreFilterCap(), matcher.getUniquenessRatio(),
              matcher.getDisp12MaxDiff(), matcher.getSpeckleWindowSize(),
              matcher.getSpeckleRange())
    if isinstance(matcher, cv2.StereoBM):
        return *shared, matcher.getTextureThreshold(), matcher.getPreFilterSize()
    return *shared, matcher.getP1(), matcher.getP2(), matcher.getMode()


MODES = {'SGBM': cv2.StereoSGBM_MODE_SGBM, '3WAY': cv2.StereoSGBM_MODE_SGBM_3WAY,
         'HH4': cv2.StereoSGBM_MODE_HH4}


@pytest.mark.parametrize('baseline', DEFAULT, ids=lambda baseline: baseline.name)
def test_default_baselines_are_set_as_stereo_image_proc_sets_them(baseline):
    matcher = baseline.matcher(MIDDLEBURY, 64).opencv
    assert (matcher.getNumDisparities(), matcher.getMinDisparity()) == (64, 0)
    assert settings_of(matcher) == (15, 31, 15, 0, 100, 4, *(
        (10, 9) if baseline.algorithm == 'BM' else (200, 400, MODES[baseline.algorithm])))


@pytest.mark.parametrize('family', [MIDDLEBURY, KITTI])
@pytest.mark.parametrize('algorithm', ['BM', 'SGBM', '3WAY', 'HH4'])
def test_tuned_baselines_have_the_settings_of_their_family(family, algorithm):
    chosen = TUNED_SETTINGS[family][algorithm]
    (baseline,) = [one for one in TUNED if one.name == f'{algorithm} tuned']
    matcher = baseline.matcher(family, 60).opencv
    assert matcher.getNumDisparities() == 64
    assert settings_of(matcher) == (
        chosen.block, chosen.cap, chosen.uniqueness, chosen.left_right, chosen.speckle_size,
        chosen.speckle_range, *((chosen.texture, 9) if algorithm == 'BM' else (
            chosen.p1, chosen.p2, MODES[algorithm])))


def test_a_tuned_baseline_matches_at_the_left_border_and_a_default_one_does_not():
    known = made_known()
    for baseline in (*DEFAULT, *TUNED):
        found = baseline.matcher(MIDDLEBURY, DISPARITIES).match(known.left, known.right)
        assert found.shape == (ROWS, COLUMNS)
        assert found.dtype == np.float32
        at_border = np.isfinite(found[:, :DISPARITIES - 1]).mean()
        assert (at_border > 0.3) == baseline.tuned, baseline.name


def test_only_the_strictest_baseline_rejects_a_disparity_of_zero():
    image = made_known().left
    loose = next(one for one in TUNED if one.algorithm == 'HH4')
    assert (loose.matcher(MIDDLEBURY, 16).match(image, image) == 0).mean() > 0.9
    assert np.isnan(STRICTEST.matcher(MIDDLEBURY, 16).match(image, image)).all()


def test_the_threads_of_opencv_are_given_back():
    before = cv2.getNumThreads()
    with opencv_threads(1):
        assert cv2.getNumThreads() == 1
    assert cv2.getNumThreads() == before


# The dense rule.

def plain_dense(disparity):
    """Return the dense rule, pixel by pixel."""
    filled = disparity.copy()
    for row, column in np.argwhere(np.isnan(disparity)):
        sides = [[value for value in side if not np.isnan(value)]
                 for side in (disparity[row, :column][::-1], disparity[row, column + 1:])]
        filled[row, column] = min((side[0] for side in sides if side), default=NAN)
    known = [row for row in range(len(filled)) if not np.isnan(filled[row, 0])]
    for row in range(len(filled)):
        if known:
            filled[row] = filled[min(known, key=lambda other, row=row: abs(other - row))]
    return cv2.medianBlur(filled if known else np.zeros_like(filled), 5)


@pytest.mark.parametrize('share', [0.0, 0.3, 0.9, 1.0])
@pytest.mark.parametrize('shape', [(1, 7), (9, 1), (13, 17)])
def test_the_dense_rule_is_that_of_its_plain_twin(shape, share):
    random = np.random.default_rng(3)
    disparity = random.uniform(0, 60, shape).astype(np.float32)
    disparity[random.random(shape) < share] = NAN
    if shape[0] > 4:
        disparity[1:4] = NAN
    np.testing.assert_array_equal(dense(disparity), plain_dense(disparity))


# Which pixels count.

def test_a_pixel_counts_where_the_right_image_shows_it():
    truth = np.array([[0, 2, 1, 1, 3, NAN, 0, 0]], np.float32)
    # Columns 2 and 4 meet in column 1, where the nearer one hides the other.
    np.testing.assert_array_equal(
        seen_by_both(truth), [[True, False, False, True, True, False, True, True]])
    np.testing.assert_array_equal(
        warped_to_right(truth), np.array([[0, 3, 1, NAN, NAN, NAN, 0, 0]], np.float32))


def test_visibility_from_truth_agrees_with_how_a_scene_was_made():
    made = make_pair(60, 120, 24, 5)
    assert (seen_by_both(made.truth) == made.visible).mean() > 0.97


def test_truths_of_both_images_are_cross_checked_from_either_one():
    left = np.array([[9, 9, 2, 2, 3, 2, 2, 4]], np.float32)
    right = np.array([[2, 3, 3, 2, 2, 2, NAN, 9]], np.float32)
    np.testing.assert_array_equal(
        cross_checked(right, left), [[True, True, True, True, True, False, False, False]])
    np.testing.assert_array_equal(
        agreeing(left, right), [[False, False, True, True, True, True, True, False]])


# Data.

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


def test_without_data_there_are_scenes_that_every_machine_has():
    scenes, skipped = available_scenes(None)
    assert [scene.name for scene in scenes if scene.group == 'made'] == [
        'planes1', 'planes2', 'planes3', 'planes4']
    assert skipped[0] == 'no folder: middv2 (tsukuba, venus, teddy, cones)'
    known = scenes[-1].read()
    assert known.truth.min() >= 0
    assert known.truth.max() <= scenes[-1].disparities - 1


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


# Sequences.

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


def test_a_hard_cut_shows_one_scene_twice_and_then_another():
    first, again, second = datasets.hard_cut(small_scene(1), small_scene(2))
    np.testing.assert_array_equal(first.left, again.left)
    np.testing.assert_array_equal(second.left, made_known(2).left)


def test_an_object_appears_in_one_frame():
    frames = datasets.appearing(1)
    changed = [np.mean(abs(after.truth - before.truth) > 1)
               for before, after in zip(frames, frames[1:])]
    assert np.argmax(changed) == datasets.APPEARS - 1


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


# What a confidence is worth.

def test_the_sparsification_of_a_perfect_order_falls_at_once():
    wrong = np.array([True, False, False, False, False])
    assert sparsification(wrong, np.array([0, 4, 3, 2, 1.0])) == (
        pytest.approx(20 / 5), 0, pytest.approx(20))


def test_pixels_that_are_equally_sure_count_as_mixed():
    wrong = np.arange(10) % 2 == 0
    for order in (wrong, wrong[::-1], np.sort(wrong)):
        assert sparsification(order, np.ones(10)) == pytest.approx((50, 50, 50))


def test_what_has_no_confidence_is_dropped_first():
    wrong = np.array([False, True])
    assert sparsification(wrong, np.array([0, NAN])).area == pytest.approx(25)


def test_pixels_with_confidence_are_counted_by_its_range():
    confidence = np.array([0, 0, 0.1, 0.55, 0.9, 0.92, 0.93, 1])
    wrong = np.array([True, False, True, False, False, True, False, False])
    number, right = reliability(wrong, confidence)
    assert len(number) == len(BINS) - 1
    assert number.tolist() == [1, 1, 0, 0, 0, 3, 1]
    assert right.tolist() == [0, 1, 0, 0, 0, 2, 1]


def test_maps_that_meet_are_sure_and_maps_that_do_not_are_unsure():
    left = np.array([[0, 1, 2, 2, 5]], np.float32)
    right = np.array([[2, 4, 0, 0, 0]], np.float32)
    np.testing.assert_array_equal(left_right_sureness(left, right), [[-2, -1, 0, -2, NAN]])


# Reports.

def report_of(value, name='accuracy'):
    return Report(name, name.title(), {'machine': 'one'}, [
        Table('Errors', ('', 'ours'), [('a scene', value), ('another', None)], 'Note.')], ['x'])


def test_a_table_has_columns_of_equal_width_and_a_dash_where_nothing_is_known():
    lines = markdown(report_of(NAN)).splitlines()
    assert [line for line in lines if line.startswith('|')] == [
        '|         |   ours |', '|:--------|-------:|', '| a scene |      - |',
        '| another |      - |']
    assert '| a scene |   2.50 |' in markdown(report_of(2.5))
    assert '- machine: one' in lines
    assert '- x' in lines


def test_only_the_own_section_is_replaced_and_pictures_are_written_beside_the_page(tmp_path):
    page = tmp_path / 'page.md'
    for value, name in ((1.0, 'accuracy'), (2.0, 'speed'), (3.0, 'accuracy')):
        write_section(page, replace(report_of(value, name), pictures={f'{name}.svg': b'<svg/>'}))
    text = page.read_text()
    assert text.startswith(HEADING)
    assert text.count('## Accuracy') == text.count('## Speed') == 1
    assert '1.00' not in text
    assert text.index('3.00') < text.index('2.00')
    assert '![Accuracy](accuracy.svg)' in text and 'svg' not in markdown(report_of(1.0))
    assert (tmp_path / 'accuracy.svg').read_bytes() == b'<svg/>'


def test_a_file_that_is_no_page_of_benchmarks_is_not_written_to(tmp_path):
    other = tmp_path / 'other.md'
    other.write_text('# Mine\n')
    for path, reason in ((other, 'is no page of benchmarks'), (tmp_path / 'page.txt', 'suffix'),
                         (tmp_path / 'no' / 'page.md', 'no folder')):
        with pytest.raises(ValueError, match=reason):
            check_page(path)


def test_progress_is_plain_lines_where_it_is_piped():
    stream = io.StringIO()
    assert list(follow([small_scene(1), small_scene(2)], 'accuracy', stream))
    assert stream.getvalue() == 'accuracy: 1 of 2 small/seed1\naccuracy: 2 of 2 small/seed2\n'


# The benchmarks themselves, on small scenes.

def table_named(report, start):
    (table,) = [table for table in report.tables if table.title.startswith(start)]
    return table


def test_accuracy_scores_dense_maps_and_averages_groups_and_halves():
    request = SmallRequest(Ours('ours', changes={'speckle_size': 7}))
    report = accuracy.run(request)
    scenes = table_named(report, 'Scenes')
    known = made_known()
    config = request.ours.config(DISPARITIES)
    assert (config.fill, config.threads, config.speckle_size) == (True, 1, 7)
    match = StereoMatcher(config).match(known.left, known.right)
    assert np.isfinite(match.disparity).all()
    cut = DISPARITIES * 3 // 4
    nearer = np.isfinite(known.truth) & (known.truth > cut - 0.5)
    sure = StereoMatcher(replace(config, disparities=cut)).match(
        known.left, known.right).confidence[nearer] >= 0.5
    found, = accuracy.measure(small_scene(1), request).nearer
    assert found['ours, confidence 0.5'] == 100 * sure.mean()
    assert 'ours, confidence 0.5' in table_named(report, 'Range cut by a quarter').columns
    row = dict(zip(scenes.columns, scenes.rows[0]))
    assert row['ours'] == bad_percent(match.disparity, known, 1.0)
    quality = StereoMatcher(MatcherConfig.from_profile(
        'quality', disparities=DISPARITIES, fill=True, threads=1)).match(known.left, known.right)
    assert row[accuracy.QUALITY] == bad_percent(quality.disparity, known, 1.0)
    assert row['seconds of quality'] > 0
    baseline = TUNED[0]
    assert row[baseline.name] == bad_percent(
        dense(baseline.matcher(MIDDLEBURY, DISPARITIES).match(known.left, known.right)), known,
        1.0)
    greys = [baselines.grey(image) for image in (known.left, known.right)]
    assert row[accuracy.OURS_GREY] == bad_percent(
        StereoMatcher(config).match(*greys).disparity, known, 1.0)
    assert report.skipped == ['a group', *presets.pairs_without_truth(None)[1]]
    assert 'speckle_size = 7' in report.settings['ours']
    assert_columns_have_names_of_their_own(report)
    errors = [row[1] for row in scenes.rows]
    assert table_named(report, 'Groups').rows[0][1] == pytest.approx(np.mean(errors))
    assert table_named(report, 'Odd').rows[0][1:3] == tuple(errors)


def test_speed_lets_all_take_turns_and_compares_with_3way():
    report = speed.run(SmallRequest(repeats=2, quick=True))
    assert_columns_have_names_of_their_own(report)
    race = report.tables[0]
    rows = {row[0]: dict(zip(race.columns[1:], row[1:])) for row in race.rows}
    assert list(rows) == ['ours, first pair', 'ours, cold', 'ours, warm', 'HH4 tuned',
                          '3WAY tuned', 'SGBM tuned', 'BM tuned']
    for name, row in rows.items():
        assert row['of 3WAY'] == row['1 thread [ms]'] / rows['3WAY tuned']['1 thread [ms]'], name
    assert all(row['1 thread [ms]'] > 0 for row in rows.values())
    stages, still, busy, deadlines, memory = report.tables[-5:]
    assert [row[0] for row in busy.rows] == ['0 busy processes', '1 busy process']
    for _, *times in busy.rows:
        assert len(times) == 2 * (len(speed.THREADS) + 1)
        assert all(0 < median <= slow for median, slow in zip(times[::2], times[1::2]))
    for _, threads, searched, slow, kept, late, mean, reference, ratio in still.rows:
        assert 0 < kept < searched <= slow and kept <= late and mean > 0
        assert threads in speed.THREADS and ratio == mean / reference
    for name, deadline, median, worst, share, _ in deadlines.rows:
        assert 0 < median <= worst
        assert (deadline, share) == (None, None) if name == 'none' else 0 <= share <= 1
    total, alone, share = stages.rows[-3:]
    assert total[0] == 'total' and share[0] == f'{alone[0]} [%]'
    for whole, part, percent in zip(total[1:], alone[1:], share[1:]):
        assert 0 < part < whole and percent == 100 * part / whole
    for (name, held, by_pixel, more, images), (rows, columns, disparities) in zip(
            memory.rows, speed.QUICK_SIZES):
        assert name == f'{columns}x{rows}, {disparities} disparities'
        assert 1e6 * held == pytest.approx(by_pixel * rows * columns)
        assert by_pixel > 2 * disparities and 0 < more < held    # costs and sums of each cell
        assert images == pytest.approx(2e-6 * rows * columns)     # grey
    assert report.skipped[-1] == 'the first start: it takes a minute'


def test_a_table_of_speed_has_medians_and_late_turns_and_a_stage_its_own_median():
    turns = pd.DataFrame([
        {'size': '640x480', 'disparities': 64, 'threads': threads, 'matcher': name,
         'milliseconds': time / threads, 'processor': time, 'stage': stage, 'total': time,
         speed.ALONE: 4.0}
        for threads in (1, 2) for name, times in (
            (speed.WARM, [30.0, 10.0, 24.0]), (speed.REFERENCE.name, [20.0, 20.0, 20.0]))
        for time, stage in zip(times, (3.0, 5.0, 4.0))])
    race, stages = speed.tables(turns)
    assert race.title == '640x480, 64 disparities'
    assert race.rows == [
        (speed.WARM, 24, pytest.approx(29.4), 1.2, 24, 1.2, 12, pytest.approx(14.7), 1.2, 2, 2),
        (speed.REFERENCE.name, 20, 20, 1, 20, 1, 10, 10, 1, 2, 2)]
    assert stages.columns == ('', '640x480, warm, 1 thread', '640x480, warm, 2 threads')
    assert stages.rows == [('stage', 4, 4), ('total', 24, 24), (speed.ALONE, 4, 4),
                           (f'{speed.ALONE} [%]', 100 * 4 / 24, 100 * 4 / 24)]


def test_a_new_process_keeps_its_kernels_in_the_folder_it_is_given(tmp_path):
    told = tmp_path / 'told'
    program = f"import os; open({str(told)!r}, 'w').write(os.environ['NUMBA_CACHE_DIR'])"
    assert speed.process_seconds(program, str(tmp_path / 'cache')) > 0
    assert told.read_text() == str(tmp_path / 'cache')
    assert 'warm_up' in speed.WARM_UP


def test_what_comes_nearer_slowly_is_seen_too_far_away_where_the_table_says_so():
    measured = [{'kind': 'faint', 'path': f'faint, seed {seed}', 'cold': np.array([0.1, 0.1]),
                 'warm': np.array(warm_ones)}
                for seed, warm_ones in enumerate([(-0.2, -0.6), (0.0, 0.0)])]
    table = warm.slow_table(measured)
    assert table.columns == ('', 'cold', 'warm', 'warm, worst sequence', 'warm, worst frame')
    assert table.rows == [('faint (2)', *map(pytest.approx, (0.1, -0.2, -0.4, -0.6)))]


@pytest.mark.slow
@pytest.mark.parametrize('contrast, speed', [(8, 0.02), (5, 0.05)])
def test_what_comes_nearer_slowly_in_little_contrast_has_no_bias(contrast, speed):
    found = [warm.approach(warm.Approach(contrast, speed, seed), SmallRequest())['warm'].mean()
             for seed in warm.MADE_SEEDS]
    assert abs(np.mean(found)) < 0.15


def test_cold_is_the_frame_alone_and_warm_is_not():
    frames = datasets.window(small_scene(), 6, 0)
    sequence = Sequence('kind', 'name', MIDDLEBURY, DISPARITIES, lambda: frames,
                        scored=range(2, 3))
    measured = warm.measure(sequence, SmallRequest())
    alone = SmallRequest().ours.matcher(DISPARITIES).match(frames[2].left, frames[2].right)
    assert measured['cold'] == bad_percent(alone.disparity, frames[2], 1.0)
    assert measured['warm'] != measured['cold']
    table = warm.tables([measured])[0]
    assert_columns_have_names_of_their_own(Report('warm', '', {}, [table]))
    title, *figures = table.rows[0]
    assert title == 'kind (1)'
    assert figures[1:5] == [measured['cold'], measured['warm'],
                            measured['warm'] / measured['cold'],
                            measured['warm'] - measured['cold']]


def frames_without_means(table):
    return [row[0] for row in table.rows if not row[0].endswith(': mean')]


def test_a_course_is_followed_frame_by_frame_and_compared_with_one_frame_alone():
    pairs = datasets.available_scenes(None, quick=True)[0]
    found = paper_frames.courses(pairs, [], quick=True)
    assert [course.kind for course in found] == [
        paper_frames.STILL, paper_frames.STILL, paper_frames.PANS, paper_frames.PANS,
        f'cut from {pairs[0].name}', 'the same, begun there']
    *_, cut, begun = (paper_frames.follow(course, 0) for course in found)
    numbers = {name for name in cut if name.startswith('frame')}
    assert numbers == {'frame 1', 'frame 2'} and cut['last'] == cut['frame 2']
    assert set(begun) == set(cut) and cut['last'] != begun['last']      # other random numbers

    figures = {'frame 1': 9.0, 'right 1': 90.0, 'last': 4.0, 'milliseconds': 5.0}
    rows = [{'kind': 'still', 'scene': name, **figures, 'frame 2': last, 'last': last,
             'cold': 2.0, 'cold ms': 50.0} for name, last in (('one', 3.0), ('two', 5.0))]
    table = paper_frames.frames_table([*rows, {'kind': 'cut', 'scene': 'two', **figures}])
    assert table.columns == ('', 'frame 1', 'frame 2', 'cold', 'last / cold', 'time / cold',
                             'ms a frame')
    assert table.rows == [
        ('still: one', 9.0, 3.0, 2.0, 1.5, 0.1, 5.0), ('still: two', 9.0, 5.0, 2.0, 2.5, 0.1, 5.0),
        ('still: mean', 9.0, 4.0, 2.0, 2.0, 0.1, 5.0), ('cut: two', 9.0, None, None, None, None,
                                                        5.0)]


@pytest.mark.slow
def test_the_papers_tables_have_the_measured_errors(monkeypatch):
    monkeypatch.setattr(paper_tables, 'TABLE_II_TURNS', 1)
    monkeypatch.setattr(paper_frames, 'DRIVES', ())     # they take minutes
    few = {'population': 4, 'generations': 2}
    monkeypatch.setattr(paper_tables, 'TABLE_II_SEARCH', few)
    monkeypatch.setattr(paper_tables, 'FIGURE_4', (few, {'population': 6, 'generations': 2}))
    report = paper_tables.run(SmallRequest())
    assert_columns_have_names_of_their_own(report)
    first, earned, sure, second, figure, frames, sure_at_first, parts = report.tables
    lines = [row[0] for row in first.rows]
    assert lines[0] == 'literal, random'
    assert {'uniform, random, mean of the seeds', 'uniform, winner takes all',
            'strict, winner takes all', 'profile realtime'} <= set(lines)
    of_seeds = [row[2] for row in first.rows if 'seed ' in row[0]]
    assert len(of_seeds) == 3
    assert first.rows[lines.index('uniform, random, mean of the seeds')][2] == pytest.approx(
        np.mean(of_seeds))
    assert [row[0] for row in earned.rows] == [variant.name for variant in PAPER_OPERATORS]
    assert earned.rows[0][-1] == '100.000'
    assert all(share is None or 0 <= share <= 100 for row in sure.rows for share in row[1:])
    assert ('the paper, as printed', None, 3400, '1.000') in second.rows
    assert [row[0] for row in second.rows[4:]] == [
        'literal, random, 4 individuals, 2 generations',
        'uniform, random, 4 individuals, 2 generations',
        'uniform, winner takes all, 4 individuals, 2 generations',
        'profile realtime, as it is', 'OpenCV 3WAY tuned, dense']
    assert len(figure.rows) == 4
    kinds = [row[0].split(':')[0] for row in frames.rows]
    assert set(kinds) == {paper_frames.STILL, paper_frames.PANS}
    assert frames.columns[1:3] == ('frame 1', 'frame 2')
    assert [row[0] for row in sure_at_first.rows] == frames_without_means(frames)
    assert [row[0] for row in parts.rows] == [
        variant.name for variant in paper_frames.PAPER_OVER_FRAMES]
    assert any('small instead' in sentence for sentence in report.skipped)


def test_the_figures_of_the_paper_are_above_the_measured_ones():
    found = pd.DataFrame([
        {'scene': scene, 'line': 'ours', 'error': error, 'error_of_all': 2 * error,
         'milliseconds': 500.0}
        for scene, error in zip((*paper_tables.TABLE_I, 'other'), (1.0, 2.0, 3.0, 6.0, 1.0))])
    assert paper_tables._first_table(found[:4]).rows == [
        ('the paper, as printed', 2.74, 2.5, 14.7, 7.78, pytest.approx(6.93), None, None),
        ("the paper's text, same evaluation", None, None, None, None, 15.3, None, None),
        ('ours', '1.00 / 2.00', '2.00 / 4.00', '3.00 / 6.00', '6.00 / 12.00', 3.0, 6.0, 0.5)]
    for some, names in ((found[:3], ['the paper, as printed', 'ours']), (found[4:], ['ours'])):
        assert [row[0] for row in paper_tables._first_table(some).rows] == names


@pytest.mark.slow
def test_the_command_prints_json_and_writes_its_section(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(datasets.DATA_VARIABLE, raising=False)
    assert main(['benchmark', 'accuracy', '--only', 'made/planes1', '--output', 'page.md',
                 '--json']) == 0
    printed = capsys.readouterr()
    (report,) = json.loads(printed.out)
    assert report['name'] == 'accuracy'
    assert printed.err == 'accuracy: 1 of 1 made/planes1\n'
    assert '## Accuracy' in (tmp_path / 'page.md').read_text()


@pytest.mark.slow
def test_all_benchmarks_run_in_their_short_form_and_fill_the_page(tmp_path, monkeypatch, capsys):
    pytest.importorskip('matplotlib', reason='pictures need matplotlib')
    monkeypatch.chdir(tmp_path)
    assert main(['benchmark', 'all', '--quick', '--repeats', '1', '--output', 'page.md']) == 0
    page = (tmp_path / 'page.md').read_text()
    assert re.findall('<!-- begin of (.+) -->', page) == list(BENCHMARKS)
    shown = re.findall(r'!\[.+\]\((.+)\)', page)
    assert shown == [f'{name}.svg' for name in (
        'accuracy', 'warm', 'over_frames', 'ablation')]
    for name in shown:
        assert ElementTree.parse(tmp_path / name).getroot().tag.endswith('svg')
    for name, start in (('accuracy', 'Groups'), ('speed', '128x72, 32 disparities')):
        assert f'### {start}' in page.split(f'<!-- begin of {name} -->')[1]
    assert 'window, noise 6, pan 2 (2)' in page
    assert 'no folder' not in page and 'made, moving' not in page
    assert capsys.readouterr().out.count('\n## ') == len(BENCHMARKS) - 1


@pytest.mark.parametrize(('words', 'reason'), [
    (['fast'], 'invalid choice'),
    (['speed', '--repeats', '0'], '--repeats is 0'),
    (['speed', '--quick', '--repeats', '0'], '--repeats is 0'),
    (['speed', '--quick', '--only', 'middv2'], "--only is 'middv2'"),
    (['accuracy', '--only', 'nothing'], "--only is 'nothing'"),
    (['accuracy', '--data', 'nowhere'], 'no folder nowhere'),
    (['accuracy', '--output', 'page.html'], 'suffix'),
    (['accuracy', '--population', '0'], 'population is 0'),
])
def test_what_cannot_be_benchmarked_is_rejected_in_one_sentence(words, reason, capsys):
    try:
        code = main(['benchmark', *words])
    except SystemExit as left:
        code = left.code
    printed = capsys.readouterr()
    assert code == 2
    assert reason in printed.err
    assert printed.err.count('\n') == 1
    assert not printed.out
