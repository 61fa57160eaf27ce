# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command does what its options say, and refuses bad input with one sentence and code 2."""
from dataclasses import fields, replace
import json
import os
import re
import subprocess
import sys

from fuzzy_stereo_ros import match_command
from fuzzy_stereo_ros.command_line import (
    add_matcher_options, main, matcher_config, option_name, Parser, written_value)
from fuzzy_stereo_ros.evaluation import score
from fuzzy_stereo_ros.made_scenes import made_pair
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity, write_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image, write_image
import numpy as np
import pytest

PARAMETERS = {parameter.name: parameter for parameter in fields(MatcherConfig)}
DISPARITIES = 16


@pytest.fixture(scope='module')
def pair():
    return made_pair(48, 80, DISPARITIES, seed=3)


@pytest.fixture
def folder(tmp_path, monkeypatch, pair):
    """Work in a folder with a pair, its truth, and files that are bad in one way each."""
    monkeypatch.chdir(tmp_path)
    write_image('left.png', pair.left)
    write_image('right.png', pair.right)
    write_disparity('truth.pfm', pair.truth)
    write_image('visible.png', np.where(pair.visible, 255, 128).astype(np.uint8))
    write_image('small.png', pair.right[:, :-1])
    (tmp_path / 'text.png').write_text('no image')
    return tmp_path


def match_arguments(**changes):
    options = {'disparities': DISPARITIES, 'output': 'out.pfm', **changes}
    return ['match', 'left.png', 'right.png', *(
        word for name, value in options.items() if value is not None
        for word in (option_name(name), str(value)))]


def parsed(*arguments):
    parser = Parser(prog='test')
    add_matcher_options(parser)
    return matcher_config(parser.parse_args(arguments))


def another_value(parameter):
    """Return an allowed value of a parameter that no profile has."""
    if parameter.type is bool:
        return not parameter.default
    taken = {getattr(MatcherConfig.from_profile(name), parameter.name) for name in PROFILES}
    if parameter.type is str:
        return (set(parameter.metadata['choices']) - {parameter.default}).pop()
    step = 2 if parameter.name == 'neighbourhood' else 1
    if parameter.metadata['high'] - parameter.metadata['low'] <= 1:
        return 0.25
    value = parameter.type(parameter.metadata['low'] + step)
    return value if value not in taken else value + step


@pytest.mark.parametrize('name', PARAMETERS)
def test_every_parameter_is_an_option_that_changes_it_and_nothing_else(name):
    value = another_value(PARAMETERS[name])
    option = option_name(name)
    if isinstance(value, bool):
        words = [option if value else option.replace('--', '--no-')]
    else:
        words = [option, str(value)]
    assert value != getattr(MatcherConfig(), name)
    assert parsed(*words) == replace(MatcherConfig(), **{name: value})


@pytest.mark.parametrize('profile', PROFILES)
def test_a_profile_is_taken_as_it_is_where_no_option_is_given(profile):
    assert parsed('--profile', profile) == MatcherConfig.from_profile(profile)


def test_the_profile_is_realtime_unless_said_otherwise():
    assert parsed() == MatcherConfig.from_profile('realtime')


@pytest.mark.parametrize('name', PARAMETERS)
def test_the_help_of_an_option_has_sentence_range_unit_and_default(name, capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '1000')
    with pytest.raises(SystemExit):
        main(['match', '--help'])
    lines = capsys.readouterr().out.splitlines()
    told = ' '.join(lines[at] + lines[at + 1] for at in range(len(lines) - 1)
                    if re.match(rf'  {option_name(name)}[ ,]', lines[at]))
    parameter = PARAMETERS[name]
    assert parameter.metadata['sentence'] in told
    if 'low' in parameter.metadata:
        low, high = (written_value(parameter.metadata[end]) for end in ('low', 'high'))
        assert f"; {low} to {high} {parameter.metadata['unit']}".rstrip() in told
    if name != 'disparities':
        assert f'default: {written_value(parameter.default)}' in told


@pytest.mark.parametrize('suffix', ['.pfm', '.npy', '.png'])
def test_match_writes_what_the_matcher_finds(folder, pair, suffix, capsys):
    assert main(match_arguments(output=f'out{suffix}', seed=7)) == 0
    expected = StereoMatcher(MatcherConfig(disparities=DISPARITIES, seed=7)).match(
        pair.left, pair.right).disparity
    found = read_disparity(f'out{suffix}')
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    assert np.nanmax(abs(found - expected)) <= (0.01 if suffix == '.png' else 0)
    assert f'out{suffix}: 80x48 pixels of the left image' in capsys.readouterr().out


def test_the_picture_shows_the_disparities_in_colours(folder):
    assert main(match_arguments(picture='picture.png')) == 0
    picture = read_image('picture.png')
    assert picture.shape == (48, 80, 3)
    invalid = np.isnan(read_disparity('out.pfm'))
    assert np.ptp(picture[~invalid].astype(int), axis=1).max() > 100
    assert (picture[invalid] == picture[invalid][:1]).all()


def test_json_holds_the_figures_and_nothing_else_is_printed(folder, pair, capsys):
    truth = {'ground_truth': 'truth.pfm', 'mask': 'visible.png'}
    assert main([*match_arguments(**truth, picture='picture.png'), '--json']) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures['rows'], figures['columns'], figures['disparities']) == (48, 80, DISPARITIES)
    assert figures['output'] == 'out.pfm' and figures['picture'] == 'picture.png'
    assert figures['profile'] == 'realtime' and figures['reference'] == 'left'
    assert figures['time_ms'] > 0 and sum(figures['times'].values()) > 0
    expected = score(read_disparity('out.pfm'), pair.truth, pair.visible)
    assert figures['ground_truth']['pixels'] == np.count_nonzero(pair.visible)
    assert figures['ground_truth']['bad_dense']['1.0'] == pytest.approx(expected.bad_dense[1.0])
    assert figures['ground_truth']['bad_sparse']['2.0'] == pytest.approx(expected.bad_sparse[2.0])


def test_a_figure_over_nothing_is_null_in_json(folder, capsys):
    write_disparity('none.pfm', np.full((48, 80), np.nan))
    assert main([*match_arguments(ground_truth='none.pfm'), '--json']) == 0
    assert json.loads(capsys.readouterr().out)['ground_truth']['density'] is None


def test_the_kernels_are_ready_before_the_time_is_taken(folder, monkeypatch):
    order = []

    class Watched:
        def __init__(self, config):
            self.matcher = StereoMatcher(config)

        def warm_up(self, rows, columns):
            order.append(('warm_up', rows, columns))

        def match(self, left, right):
            order.append('match')
            return self.matcher.match(left, right)

    monkeypatch.setattr(match_command, 'StereoMatcher', Watched)
    assert main(match_arguments()) == 0
    assert order == [('warm_up', 48, 80), 'match']


BAD_INPUT = {
    'no command': ([], 'required: COMMAND'),
    'no output': (match_arguments(output=None), 'required: --output'),
    'no disparities': (match_arguments(disparities=None), 'required: --disparities'),
    'an abbreviation': ([*match_arguments(), '--pict', 'a.png'], 'unrecognized arguments'),
    'an unknown option': (match_arguments(frobnicate=3), 'unrecognized arguments: --frobnicate'),
    'an unknown profile': (match_arguments(profile='fast'), "invalid choice: 'fast'"),
    'no number': (match_arguments(disparities='many'), "invalid int value: 'many'"),
    'out of range': (match_arguments(elite=2), 'elite is 2.0; allowed are numbers from 0'),
    'NaN': (match_arguments(elite='nan'), 'elite is nan; allowed are numbers'),
    'an even neighbourhood': (match_arguments(neighbourhood=4), 'allowed are odd numbers'),
    'no such choice': (match_arguments(survival='luck'), "invalid choice: 'luck'"),
    'too many disparities': (match_arguments(disparities=81), '80'),
    'a missing image': (['match', 'left.png', 'none.png', *match_arguments()[3:]],
                        'none.png cannot be read: No such file'),
    'no image': (['match', 'left.png', 'text.png', *match_arguments()[3:]],
                 'text.png is not an image'),
    'two sizes': (['match', 'left.png', 'small.png', *match_arguments()[3:]],
                  'left.png is 80x48 and small.png is 79x48'),
    'an unknown suffix': (match_arguments(output='out.tiff'), 'allowed are .pfm, .npy, .png'),
    'a missing folder': (match_arguments(output='none/out.pfm'), 'there is no folder none'),
    'no picture format': (match_arguments(picture='out.docx'), 'no image format'),
    'an input as output': (match_arguments(output='left.png'), 'which is an input too'),
    'one file twice': (match_arguments(output='out.png', picture='./out.png'),
                       'which is --output too'),
    'truth of another size': (match_arguments(ground_truth='small.png', ground_truth_scale=4),
                              'small.png is 79x48, the images are 80x48'),
    'truth without scale': (match_arguments(ground_truth='left.png'), 'how many grey levels'),
    'a mask of another size': (match_arguments(ground_truth='truth.pfm', mask='small.png'),
                               'small.png is 79x48'),
    'a mask alone': (match_arguments(mask='visible.png'), '--mask needs --ground-truth'),
    'a scale alone': (match_arguments(ground_truth_scale=4),
                      '--ground-truth-scale needs --ground-truth'),
}


@pytest.mark.parametrize('case', BAD_INPUT)
def test_bad_input_is_one_sentence_and_code_2_and_writes_nothing(
        folder, capsys, monkeypatch, case):
    """And it is told before the work begins, but for what only the matcher knows."""
    arguments, words = BAD_INPUT[case]
    if case != 'too many disparities':
        monkeypatch.setattr(match_command, 'StereoMatcher', None)
    before = {name: (folder / name).read_bytes() for name in os.listdir(folder)}
    try:
        code = main(arguments)
    except SystemExit as ended:
        code = ended.code
    told = capsys.readouterr()
    assert code == 2
    assert told.out == ''
    assert re.fullmatch(r'fuzzy-stereo( match)?: [^\n]+\n', told.err), told.err
    assert words in told.err
    assert {name: (folder / name).read_bytes() for name in os.listdir(folder)} == before


def test_an_output_that_cannot_be_written_leaves_nothing(folder, capsys):
    (folder / 'out.pfm').mkdir()
    assert main(match_arguments()) == 2
    assert 'out.pfm' in capsys.readouterr().err
    assert os.listdir(folder / 'out.pfm') == []
    assert not [name for name in os.listdir(folder) if name.endswith('.part')]


def test_an_interrupt_ends_quietly_with_code_130(folder, monkeypatch, capsys):
    def interrupted(*arguments):
        raise KeyboardInterrupt
    monkeypatch.setattr(match_command, 'read_pair', interrupted)
    assert main(match_arguments()) == 130
    assert capsys.readouterr().err == ''


def test_the_process_ends_with_the_code_and_without_a_traceback(folder):
    command = [sys.executable, '-m', 'fuzzy_stereo_ros.command_line']
    good = subprocess.run([*command, *match_arguments()], capture_output=True, text=True)
    assert (good.returncode, good.stderr) == (0, '')
    bad = subprocess.run([*command, *match_arguments(profile='fast')], capture_output=True,
                         text=True)
    assert bad.returncode == 2 and 'Traceback' not in bad.stderr
