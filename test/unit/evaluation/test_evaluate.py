# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`evaluate` prints the figures that scoring by hand gives, for every kind of matcher."""
import csv
import json

from bench.scoring import DEFAULT
import cv2
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation import matchers as matchers_module
from fuzzy_stereo_ros.evaluation.baselines import dense, TUNED
from fuzzy_stereo_ros.evaluation.catalogue import search
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI, MIDDLEBURY
from fuzzy_stereo_ros.evaluation.matchers import ResultFiles
from fuzzy_stereo_ros.evaluation.measuring import (
    COLUMNS, disparities_of, SEEN, TRUTHS_LARGEST)
from fuzzy_stereo_ros.evaluation.scores import flicker, score, THRESHOLDS
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest
from written_scenes import (
    COLUMNS as WIDTH, DISPARITIES, frames, in_kitti_steps, pair, ROWS, write_2014, write_frames,
    write_kitti, write_masks, write_named, write_v2)

AS_IT_COMES, FILLED = 'as it comes', 'filled'


def evaluated(capsys, *words):
    """Return what `evaluate ... --json` prints."""
    assert main(['evaluate', *map(str, words), '--json']) == 0
    return json.loads(capsys.readouterr().out)


def the_record(records, **wanted):
    (record,) = [record for record in records
                 if all(record[name] == value for name, value in wanted.items())]
    return record


def assert_is_score(record, wanted):
    """Check a record against a `Score`, figure by figure."""
    def figure(value):
        return None if np.isnan(value) else value

    assert record['pixels'] == wanted.pixels
    for name in ('density', 'd1_sparse', 'd1_dense', 'average_error', 'rms_error'):
        assert record[name] == figure(getattr(wanted, name)), name
    for limit in THRESHOLDS:
        assert record[f'bad_sparse_{limit:g}'] == figure(wanted.bad_sparse[limit])
        assert record[f'bad_dense_{limit:g}'] == figure(wanted.bad_dense[limit])


def ours(made, profile='realtime', **changes):
    """Return our map as it comes, and filled."""
    return tuple(StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=DISPARITIES, threads=1, fill=fill, **changes)
    ).match(made.left, made.right).disparity for fill in (False, True))


def of_opencv(made, name, family=MIDDLEBURY):
    """Return a baseline's map as it comes, and filled."""
    named = {one.name: one for one in (*DEFAULT, *TUNED)}
    found = named[name].matcher(family, DISPARITIES).match(made.left, made.right)
    return found, dense(found)


# Figures.

def test_the_figures_are_those_of_scoring_each_map_in_each_mask(tmp_path, capsys):
    made = pair()
    truth = write_v2(tmp_path / 'venus', made, 8)
    masks = write_masks(tmp_path / 'venus', made)
    told = evaluated(capsys, tmp_path, '--disparities', DISPARITIES, '--matcher', 'ours',
                     'opencv:sgbm', 'opencv:bm:tuned', 'ours:fast', '--seed', '5',
                     '--truth-scale', '8')
    maps = {'ours': ours(made, seed=5), 'ours:fast': ours(made, 'fast', seed=5),
            'opencv:sgbm': of_opencv(made, 'SGBM default'),
            'opencv:bm:tuned': of_opencv(made, 'BM tuned')}
    scenes = [record for record in told['records'] if record['kind'] == 'scene']
    assert len(scenes) == len(maps) * len(masks) * 2
    for name, both in maps.items():
        assert np.isnan(both[0]).any() and not np.isnan(both[1]).any()
        for mask, where in masks.items():
            for way, disparity in zip((AS_IT_COMES, FILLED), both):
                record = the_record(scenes, matcher=name, mask=mask, map=way)
                assert_is_score(record, score(disparity, truth, where))
                assert (record['name'], record['layout']) == ('venus', 'Middlebury v2')
                assert (record['rows'], record['columns']) == (ROWS, WIDTH)
    assert 'seed = 5' in told['settings']['ours']


def test_the_number_of_disparities_comes_from_user_then_scene_then_truth_then_pairs(tmp_path):
    write_2014(tmp_path, pair(), ndisp=29)
    (scene,) = search([tmp_path]).scenes
    truth = scene.read().truth
    assert disparities_of(scene, [truth], 40) == (40, '--disparities')
    assert disparities_of(scene, [truth], None) == (29, 'calib.txt')
    (tmp_path / 'calib.txt').unlink()
    (scene,) = search([tmp_path]).scenes
    largest = np.nanmax(truth)
    number, source = disparities_of(scene, [truth], None)
    assert source == TRUTHS_LARGEST
    assert number - 2 < largest <= number - 1 <= DISPARITIES - 1
    assert disparities_of(scene, [np.full_like(truth, np.nan)], None)[1] == SEEN
    assert disparities_of(scene, [np.full_like(truth, 7)], None)[0] == 8


def test_a_time_is_the_fastest_and_the_speed_follows_from_it(tmp_path, capsys, monkeypatch):
    write_2014(tmp_path, pair(), ndisp=DISPARITIES)
    turns = iter([0, 9_000_000, 0, 4_000_000, 0, 6_000_000])
    monkeypatch.setattr(matchers_module.time, 'perf_counter_ns', lambda: next(turns))
    told = evaluated(capsys, tmp_path, '--matcher', 'opencv:bm', '--repeats', '3')
    for record in told['records']:
        assert record['milliseconds'] == 4.0
        assert record['mde_per_second'] == pytest.approx(
            ROWS * WIDTH * DISPARITIES / 0.004 / 1e6)
    assert 'the fastest of 3' in told['settings']['time']


def test_images_of_16_bits_become_8_by_one_factor_for_both():
    left, right = np.uint16([[0, 2000, 4000]]), np.uint16([[1000, 500, 0]])
    found = DEFAULT[0].matcher(MIDDLEBURY, 16).images(left, right)
    np.testing.assert_array_equal(found[0], [[0, 128, 255]])
    np.testing.assert_array_equal(found[1], [[64, 32, 0]])


def test_all_run_on_the_threads_that_are_asked_for(tmp_path, capsys, monkeypatch):
    write_2014(tmp_path, pair(), ndisp=DISPARITIES)
    seen = []

    class Watched(StereoMatcher):
        def match(self, *images):
            seen.append((self.config.threads, cv2.getNumThreads()))
            return super().match(*images)

    monkeypatch.setattr(matchers_module, 'StereoMatcher', Watched)
    before = cv2.getNumThreads()
    told = evaluated(capsys, tmp_path, '--matcher', 'ours', '--threads', '2')
    assert set(seen) == {(2, 2)}
    assert cv2.getNumThreads() == before
    assert told['settings']['threads'] == '2 each'


def test_means_are_over_the_scenes_of_a_family_that_have_the_mask(tmp_path, capsys):
    pairs = {'a': pair(1), 'b': pair(2), 'c': pair(3)}
    for name, made in pairs.items():
        write_named(tmp_path / name, made)
    write_masks(tmp_path / 'b', pairs['b'], ['disc'])
    write_kitti(tmp_path, pairs['a'], '000000_10.png')
    told = evaluated(capsys, tmp_path / 'a', tmp_path / 'b', tmp_path / 'c', tmp_path,
                     '--matcher', 'opencv:bm', '--disparities', DISPARITIES)
    found = {name: of_opencv(made, 'BM default')[0] for name, made in pairs.items()}
    means = [record for record in told['records'] if record['kind'] == 'mean']
    wanted = [score(found[name], made.truth) for name, made in pairs.items()]
    every = the_record(means, family=MIDDLEBURY, mask='all', map=AS_IT_COMES)
    assert every['bad_sparse_1'] == pytest.approx(np.mean([one.bad_sparse[1] for one in wanted]))
    assert every['rms_error'] == pytest.approx(np.mean([one.rms_error for one in wanted]))
    assert (every['frames'], every['pixels']) == (3, sum(one.pixels for one in wanted))
    one = the_record(means, family=MIDDLEBURY, mask='disc', map=AS_IT_COMES)
    scene = the_record(told['records'], kind='scene', mask='disc', map=AS_IT_COMES)
    assert (one['frames'], one['bad_sparse_1']) == (1, scene['bad_sparse_1'])
    kitti = the_record(means, family=KITTI, mask='all', map=AS_IT_COMES)
    assert_is_score(kitti, score(found['a'], in_kitti_steps(pairs['a'].truth)))


# Sequences.

def test_a_sequence_is_matched_warm_and_cold_with_its_flicker(tmp_path, capsys):
    several = frames(4)
    write_frames(tmp_path / 'drive', several, known=[8, 10])
    told = evaluated(capsys, tmp_path, '--matcher', 'ours', '--disparities', DISPARITIES,
                     '--repeats', '2')
    records = [record for record in told['records'] if record['kind'] == 'sequence']
    maps = {}
    for start in ('cold', 'warm'):
        for way, fill in ((AS_IT_COMES, False), (FILLED, True)):
            matcher = StereoMatcher(MatcherConfig(
                disparities=DISPARITIES, threads=1, fill=fill, warm_start=start == 'warm'))
            maps[start, way] = [matcher.match(made.left, made.right).disparity
                                for made in several]
    for (start, way), found in maps.items():
        record = the_record(records, start=start, map=way, mask='all')
        scores = [score(found[number], several[number].truth) for number in (1, 3)]
        assert record['bad_dense_1'] == np.mean([one.bad_dense[1] for one in scores])
        assert record['average_error'] == np.mean([one.average_error for one in scores])
        assert record['flicker'] == pytest.approx(np.mean(
            [flicker(before, after) for before, after in zip(found, found[1:])]))
        assert record['frames'] == 4
        assert record['covered'] == pytest.approx(100 * np.isfinite(maps[
            start, AS_IT_COMES]).mean())
    cold, warm = (the_record(records, start=start, map=FILLED, mask='all')
                  for start in ('cold', 'warm'))
    assert warm['flicker'] < cold['flicker']


def test_frames_of_two_sizes_are_no_sequence_but_scenes_where_they_have_a_truth(tmp_path, capsys):
    several = frames(2)
    write_frames(tmp_path, several)
    for side in ('left', 'right'):
        write_image(tmp_path / f'{side}_8.png', getattr(several[1], side)[:, 1:])
    sentence = (f'{tmp_path.name}/8 is {WIDTH - 1}x{ROWS}, the first frame {WIDTH}x{ROWS}; '
                'frames of a sequence have one size')
    assert main(['evaluate', str(tmp_path), '--matcher', 'opencv:bm']) == 2
    assert capsys.readouterr().err.splitlines()[-1] == f'fuzzy-stereo: {sentence}'
    write_disparity(tmp_path / 'groundtruth_7.npy', several[0].truth)
    told = evaluated(capsys, tmp_path, '--matcher', 'opencv:bm')
    assert told['left_out'] == [sentence]
    assert {(record['kind'], record['name']) for record in told['records']} == {
        ('scene', f'{tmp_path.name}/7'), ('mean', MIDDLEBURY)}


# Results of other programs.

@pytest.mark.parametrize('place', [
    'scenes/a.pfm', 'a.npy', 'scenes/a/disp0other.png', 'a/whatever.pfm'])
def test_the_result_of_another_program_is_found_by_the_name_of_the_scene(tmp_path, place):
    for name in (place, 'b.npz', 'scenes/c.pfm'):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert ResultFiles('other', tmp_path, ['scenes/a', 'b', 'd']).files == {
        'scenes/a': tmp_path / place, 'b': tmp_path / 'b.npz', 'd': None}


def test_a_scene_without_a_result_is_said_has_no_means_and_takes_that_of_no_other(
        tmp_path, capsys):
    """Though its name ends like that of another scene."""
    for seed, name in enumerate(('half/a', 'third/a')):
        write_named(tmp_path / 'data' / name, pair(seed))
    (tmp_path / 'other' / 'third').mkdir(parents=True)
    made = pair(1)
    found = in_kitti_steps(np.where(made.visible, made.truth + 1.25, np.nan))
    write_disparity(tmp_path / 'other' / 'third' / 'a.png', found)
    write_disparity(tmp_path / 'other' / 'a.pfm', pair(0).truth + 5)
    told = evaluated(capsys, tmp_path / 'data', '--matcher', 'opencv:bm', '--results',
                     f'mine={tmp_path / "other"}')
    (sentence,) = told['left_out']
    assert sentence == f'{tmp_path / "other"} has no result of half/a: no means of mine there'
    assert {(record['kind'], record['matcher']) for record in told['records']} == {
        ('scene', 'opencv:bm'), ('scene', 'mine'), ('mean', 'opencv:bm')}
    mine = [record for record in told['records'] if record['matcher'] == 'mine']
    assert {(record['name'], record['milliseconds']) for record in mine} == {('third/a', None)}
    for way, disparity in ((AS_IT_COMES, found), (FILLED, dense(found))):
        assert_is_score(the_record(mine, mask='all', map=way), score(disparity, made.truth))


# What is written, and what is rejected.

def test_csv_and_json_hold_the_same_figures(tmp_path, capsys):
    for seed, name in enumerate('ab', 1):
        write_named(tmp_path / 'data' / name, pair(seed))
    write_frames(tmp_path / 'data' / 'drive', frames(2), known=[8])
    files = {end: tmp_path / f'out.{end}' for end in ('csv', 'json')}
    assert main(['evaluate', str(tmp_path / 'data'), '--matcher', 'ours', 'opencv:bm', *(
        word for end, path in files.items() for word in (f'--{end}', str(path)))]) == 0
    # Plain lines, where it is piped.
    assert 'scenes: 2 of 3 b\nscenes: 3 of 3 ' in capsys.readouterr().err
    records = json.loads(files['json'].read_text())['records']
    rows = [*csv.DictReader(files['csv'].read_text().splitlines())]
    assert tuple(rows[0]) == COLUMNS and len(rows) == len(records) > 20
    for row, record in zip(rows, records):
        assert row == {name: '' if record.get(name) is None else str(record[name])
                       for name in COLUMNS} and set(record) <= set(COLUMNS)


@pytest.mark.parametrize(('words', 'reason'), [
    (['scene', '--disparities', '100'], 'scene, ours: 100 disparities are more than the 72 col'),
    (['low', '--matcher', 'opencv:bm', '--disparities', '9'],
     'low, opencv:bm: OpenCV cannot match 72x10 pixels with 9 disparities: '),
])
def test_a_scene_that_cannot_be_matched_is_named_with_its_matcher(
        folder, words, reason, capsys):
    write_named(folder / 'scene', pair())
    write_named(folder / 'low', make_pair(10, WIDTH, 9))
    assert main(['evaluate', *words, '--csv', 'out.csv']) == 2
    printed = capsys.readouterr()
    assert reason in printed.err.splitlines()[-1]
    assert not printed.out and not (folder / 'out.csv').exists()
