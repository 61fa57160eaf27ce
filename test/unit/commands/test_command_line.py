# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command does what its options say, and rejects bad input with one sentence and code 2."""
from dataclasses import fields, replace
import os
from pathlib import Path
from random import Random

from command_output import printed
from fuzzy_stereo_ros.commands import match as match_command
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration, write_camera
from fuzzy_stereo_ros.pairs.disparity_files import read_depth, read_disparity, write_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image, write_image
from fuzzy_stereo_ros.pairs.stereo_pair import SIDES
from fuzzy_stereo_ros.parameters.options import add_matcher_options, matcher_config, option_name
from fuzzy_stereo_ros.program import Parser
from fuzzy_stereo_ros.saved_pair import write_saved_pair
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest
from raw_camera import COLUMNS, RawCamera, ROWS
from repository import COMMAND_LINE, printed_by
from saved_scene import running

PARAMETERS = {parameter.name: parameter for parameter in fields(MatcherConfig)}
DISPARITIES = 16


def match_arguments(**changes):
    options = {'disparities': DISPARITIES, 'output': 'out.pfm', **changes}
    return ['match', 'left.png', 'right.png', *(
        word for name, value in options.items() if value is not None
        for word in (option_name(name), str(value)))]


def drawn(parameter, random):
    """Return a value that a parameter may have, in steps of the neighbourhood."""
    row = parameter.metadata['row']
    if parameter.type in (bool, str):
        return random.choice([False, True] if parameter.type is bool else row.choices)
    value = random.uniform(row.low, min(row.high, 99))
    return value if parameter.type is float else int(row.low) + 2 * int((value - row.low) / 2)


@pytest.mark.parametrize('name', PARAMETERS)
def test_every_parameter_is_an_option_that_changes_it_and_nothing_else(name):
    option, random, parser = option_name(name), Random(name), Parser(prog='test')
    add_matcher_options(parser)
    values = {drawn(PARAMETERS[name], random) for _ in range(8)}
    assert len(values) > 1
    for value in values:
        profile = random.choice([*PROFILES])
        words = [option, str(value)] if not isinstance(value, bool) else [
            option if value else option.replace('--', '--no-')]
        assert matcher_config(parser.parse_args([*words, '--profile', profile])) == replace(
            MatcherConfig.from_profile(profile), **{name: value})


@pytest.mark.parametrize('suffix, step', [('.pfm', 0), ('.npy', 0), ('.png', 1)])
def test_match_writes_disparity_confidence_depth_and_points_of_one_match(
        pair_folder, pair, suffix, step, capsys):
    camera = centred_calibration(100.0, 0.5, 2.0, 48, 80)
    told = printed(capsys, *match_arguments(
        output=f'out{suffix}', confidence=f'sure{suffix}', depth=f'depth{suffix}',
        points='points.ply', focal=100.0, baseline=0.5, offset=2.0, seed=7))
    match = StereoMatcher(MatcherConfig(disparities=DISPARITIES, seed=7)).match(
        pair.left, pair.right, camera=Camera(*camera.left, camera.offset))
    found = read_disparity(f'out{suffix}')
    np.testing.assert_array_equal(np.isnan(found), np.isnan(match.disparity))
    assert np.nanmax(abs(found - match.disparity)) <= step / 100
    sure = read_image('sure.png') / 255 if step else read_disparity(f'sure{suffix}')
    assert np.abs(sure - match.confidence).max() <= step / 510 + 1e-7
    depth = match.depth(camera)
    if step:        # millimetres
        depth[~(depth < 65.5355)] = np.nan
    np.testing.assert_allclose(read_depth(f'depth{suffix}'), depth, atol=step * 5.1e-4)
    points = Path('points.ply').read_bytes()
    near = match.depth(camera) <= 100.0 * camera.baseline / 3
    assert f'element vertex {near.sum()}'.encode() in points
    assert f'out{suffix}: 80x48 pixels of the left image' in told
    assert f'depth{suffix}: depth' in told


def test_raw_images_are_rectified_by_their_calibration(pair_folder):
    made = make_pair(ROWS, COLUMNS, 32, seed=3)
    for side, image, x, turn in zip(SIDES, made, (0, 0.1), ((0.02, -0.03, 0.015), (-0.02, 0, 0))):
        camera = RawCamera(turn=turn, right=x)
        write_image(f'{side}.png', camera.raw(image))
        write_camera(f'{side}.yaml', camera.info(r=camera.rotation.ravel().tolist()), side)
    assert main([*match_arguments(disparities=32), '--rectify', '--no-align-rows', '--calibration',
                 'left.yaml', 'right.yaml']) == 0
    close = np.abs(read_disparity('out.pfm') - made.truth) < 1
    assert close[made.visible].mean() > 0.75


def test_json_holds_the_figures_and_nothing_else_is_printed(pair_folder, pair, capsys):
    truth = {'ground_truth': 'truth.pfm', 'mask': 'visible.png'}
    figures = printed(capsys, *match_arguments(**truth, picture='picture.png'), '--json')
    assert (figures['rows'], figures['columns'], figures['disparities']) == (48, 80, DISPARITIES)
    assert figures['output'] == 'out.pfm' and figures['picture'] == 'picture.png'
    assert figures['profile'] == 'realtime' and figures['reference'] == 'left'
    assert 1 <= figures['time_ms'] / figures['times']['total'] < 100     # both in ms
    expected = score(read_disparity('out.pfm'), pair.truth, pair.visible)
    assert figures['ground_truth']['pixels'] == np.count_nonzero(pair.visible)
    assert figures['ground_truth']['bad_dense']['1.0'] == pytest.approx(expected.bad_dense[1.0])
    assert figures['ground_truth']['bad_sparse']['2.0'] == pytest.approx(expected.bad_sparse[2.0])


def test_the_kernels_are_ready_before_the_time_is_taken(pair_folder, monkeypatch):
    order = []

    class Watched(StereoMatcher):
        def warm_up(self, *size):
            order.append(size)

        def match(self, *pair, **camera):
            order.append('match')
            return super().match(*pair, **camera)

    monkeypatch.setattr(match_command, 'StereoMatcher', Watched)
    assert main(match_arguments()) == 0
    assert order == [(48, 80), 'match']


def test_an_output_that_cannot_be_written_is_named_and_leaves_nothing(
        pair_folder, capsys, monkeypatch):
    """Here because somebody has made a folder of that name in the meantime."""
    monkeypatch.setattr(match_command, 'write_disparity', lambda path, disparity: (
        path.mkdir(), write_disparity(path, disparity)))
    assert main(match_arguments()) == 2
    assert capsys.readouterr().err.endswith('fuzzy-stereo: out.pfm: Is a directory\n')
    assert os.listdir('out.pfm') == []
    assert not [name for name in os.listdir() if name.endswith('.part')]


def test_an_interrupt_ends_with_code_130_and_what_is_left_behind(pair_folder, monkeypatch, capsys):
    def interrupted(*arguments):
        raise KeyboardInterrupt
    monkeypatch.setattr(match_command, 'read_pair', interrupted)
    assert main(match_arguments()) == 130
    assert capsys.readouterr().err == (
        'fuzzy-stereo: interrupted; no file is half written; one that is not written yet is as '
        'before\n')
    assert not (pair_folder / 'out.pfm').exists()


def test_the_command_starts_without_the_libraries_that_are_optional():
    extras = ('argcomplete', 'av', 'dask', 'distributed', 'jinja2', 'matplotlib', 'pandas',
              'rosbags', 'tabulate')
    printed_by('-c', f'import sys; sys.modules.update(dict.fromkeys({extras}))\n'
               'from fuzzy_stereo_ros.commands.command_line import main\n'
               "main(['--version'])")


def test_benchmark_measures_latency_processor_time_and_memory_of_each_matcher(capsys):
    report = printed(capsys, 'benchmark', '--columns', 96, '--rows', 48, '--disparities', 16,
                     '--repeats', 2, '--threads', 1, '--json')
    (table,) = report['tables']
    assert table['title'] == '96x48, 16 disparities' and report['settings']['threads'] == '1 each'
    assert [row[0] for row in table['rows']] == [
        'ours, cold', 'ours, warm', 'OpenCV BM tuned', 'OpenCV SGBM tuned', 'OpenCV 3WAY tuned',
        'OpenCV HH4 tuned']
    for _, median, late, processor, memory in table['rows']:
        assert 0 < median <= late and processor > 0
        assert memory >= 0


# ---- a saved pair ----


@pytest.fixture
def report(folder):
    """Work in a folder with a pair that was matched warm, saved as `report`."""
    write_saved_pair('report', running()[2])
    return folder / 'report'


def told_of_report(capsys, *words, code=0):
    return printed(capsys, 'match', '--saved', 'report', *words, code=code)


def test_a_saved_pair_is_matched_to_the_same_bits(report, capsys):
    told = told_of_report(capsys).splitlines()
    assert told[0].startswith('report: 100x60 pixels of the left image')
    assert told[1].endswith('parameters as saved, without compile time)')
    assert told[2] == 'remark: fx is 501 in the left and 500.25 in the right camera_info'
    assert told[3].startswith('row offset: not measured')
    assert told[4:] == ['the same as saved, bit for bit']
    assert os.listdir() == ['report']


def test_a_difference_is_counted_and_measured_and_ends_with_code_1(report, capsys):
    maps = dict(np.load(report / 'arrays.npz'))
    valid = np.argwhere(np.isfinite(maps['disparity']))[:3]
    maps['disparity'][tuple(valid.T)] += np.float32([0.5, -2.25, np.nan])
    maps['confidence'][0, 0] += np.float32(2)
    np.savez(report / 'arrays.npz', **maps)
    found = told_of_report(capsys, '--json', code=1)['saved']
    assert not found['same']
    assert found['differences']['disparity'] == {'pixels': 3, 'largest': 2.25, 'valid_in_one': 1}
    assert found['differences']['confidence'] == {'pixels': 1, 'largest': 2.0, 'valid_in_one': 0}
    assert told_of_report(capsys, code=1).splitlines()[4:] == [
        'not the same as saved: disparity differs in 3 pixels (by 2.25 at most, 1 valid in '
        'only one of the two), confidence differs in 1 pixels (by 2 at most, 0 valid in only '
        'one of the two)']


@pytest.mark.parametrize('words, changed', [
    (['--seed', '9', '--speckle-size', '2000'], {'speckle_size': 2000, 'seed': 9}),
    (['--profile', 'fast'], {'planes': False}),
])
def test_an_option_changes_the_saved_parameter_and_nothing_is_promised(
        report, capsys, words, changed):
    found = told_of_report(capsys, *words, '--json')
    assert found['saved']['changed'] == changed
    assert not found['saved']['same']
    assert found['disparities'] == 24
    told = told_of_report(capsys, *words).splitlines()
    names = ', '.join(changed)
    assert f'parameters as saved but for {names}, without' in told[1]
    assert told[-1] == f'results may differ, as these parameters are not those saved: {names}'


def test_what_was_saved_with_a_deadline_is_matched_without_one(folder, capsys):
    """One deadline that is never met, and one at which no generation can start."""
    write_saved_pair('report', running(deadline_ms=3_600_000.0)[0])
    found = told_of_report(capsys, '--json')['saved']
    assert found['same'] and found['changed'] == {} and found['deadline_ms'] == 3_600_000
    (folder / 'report').rename('unhurried')
    write_saved_pair('report', running('paper', deadline_ms=1e-6, frames=1, generations=1)[0])
    assert told_of_report(capsys, '--json', code=1)['generations'] == 1
    assert told_of_report(capsys, code=1).splitlines()[-1] == (
        'it was saved with a deadline of 1e-06 ms and matched without one now; only without one '
        'are results the same on every run')
    changed = told_of_report(capsys, '--json', '--deadline-ms', '0.000001')
    assert changed['saved']['changed'] == {'deadline_ms': 1e-6} and changed['generations'] == 0


def test_the_shell_completes_commands_and_their_options(tmp_path):
    pytest.importorskip('argcomplete', reason='the extra completion is not installed')
    line, answer = 'fuzzy-stereo match --profile qua', tmp_path / 'answer'
    printed_by('-m', COMMAND_LINE, _ARGCOMPLETE='1', COMP_LINE=line, COMP_POINT=str(len(line)),
               _ARGCOMPLETE_STDOUT_FILENAME=str(answer))
    assert answer.read_text().strip() == 'quality'
