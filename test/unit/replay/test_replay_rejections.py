# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bad input to `fuzzy-stereo replay` is one sentence, exit code 2, and nothing written."""
from functools import partial
import io

from fuzzy_stereo_ros.parameters.options import add_node_options, node_settings
from fuzzy_stereo_ros.parameters.table import NODE_PARAMETERS
from fuzzy_stereo_ros.program import Parser
from fuzzy_stereo_ros.replay.options import READING, RESULTS, SYNCHRONISING
from fuzzy_stereo_ros.replay.report import ProgressBar
from made_bags import content, same, TOPICS, write_bag
import pytest
from replayed import clean_rejection, figures, on_a_terminal, replay

ROWS = {row.name: row for row in NODE_PARAMETERS}
NAMES = (*SYNCHRONISING, *READING, *RESULTS)


@pytest.fixture
def folder(folder):
    """Work in a folder with a bag."""
    write_bag(folder / 'bag')
    return folder


@pytest.fixture
def rejected(folder, capsys):
    """Return a function that gives the sentence of a replay, after which nothing is written."""
    return partial(clean_rejection, capsys)


def test_a_missing_topic_is_rejected_with_the_existing_ones(rejected):
    assert rejected('bag', options=['--left', 'nothing']) == (
        '--left is /nothing, which is no topic of images in bag; there are /left/image_rect, '
        '/right/image_rect')
    assert rejected('bag', options=['--keep', '/nothing']) == (
        '--keep names /nothing, which is not in bag; there are /left/camera_info, '
        '/left/image_rect, /right/camera_info, /right/image_rect')


def test_a_bag_without_calibration_is_rejected_with_the_options_that_give_one(
        rejected, folder, capsys):
    write_bag(folder / 'bare', infos=False)
    assert rejected('bare', options=['--with', 'depth']) == (
        'bare, without camera_info beside /left/image_rect and /right/image_rect, needs the '
        'cameras: give --focal and --baseline, or --calibration with a calibration file')
    assert 'needs the cameras: give --baseline, or' in rejected('bare', options=['--focal', 200])
    assert rejected('bag', options=['--focal', 200]).startswith(
        'a calibration that is not that of the bag needs the cameras: give --baseline')
    assert rejected('bare', options=['--focal', 200, '--baseline', -1]) == (
        '--baseline is -1; allowed are numbers above 0')
    assert 'missing.yaml' in rejected('bare', options=['--calibration', 'missing.yaml', 'b.yaml'])
    assert rejected('bare', options=['--focal', 200, '--baseline', 1, '--rectify']) == (
        '--rectify and --crop need the calibration of both raw cameras: those of a bag, or '
        '--calibration with files of both')


def test_numbers_or_files_are_a_calibration(folder, capsys):
    write_bag(folder / 'bare', infos=False)
    found = figures(capsys, 'bare', options=['--focal', 200, '--baseline', 0.12])
    assert found['calibration'] == (
        'focal length 200 px, baseline 0.12 m and the centre assumed in the middle of the image')
    assert replay('bag', output='calibrated') == 0
    for side, tx in (('left', 0), ('right', -24)):
        (folder / f'{side}.yaml').write_text(
            'image_width: 96\nimage_height: 48\ndistortion_model: plumb_bob\n'
            'camera_matrix: {data: [200, 0, 47.5, 0, 200, 23.5, 0, 0, 1]}\n'
            'distortion_coefficients: {data: [0, 0, 0, 0, 0]}\n'
            'rectification_matrix: {data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n'
            f'projection_matrix: {{data: [200, 0, 47.5, {tx}, 0, 200, 23.5, 0, 0, 0, 1, 0]}}\n')
    found = figures(capsys, 'bare', output='files', options=[
        '--calibration', 'left.yaml', 'right.yaml'])
    assert found['calibration'] == 'left.yaml and right.yaml'
    for options in (['--calibration', 'right.yaml'],
                    ['--focal', 200, '--baseline', 0.12, '--principal-point', 47.5, 23.5]):
        assert replay('bare', output=f'by{len(options)}', options=options) == 0
    for name in ('calibrated', 'files', 'by2', 'by7'):
        assert all(same(one, other) for (_, _, one), (_, _, other) in zip(
            content(folder / 'out'), content(folder / name), strict=True))


def test_pairs_that_are_all_bad_leave_nothing(rejected, folder):
    def uncalibrated(number, messages):
        for topic in TOPICS[1::2]:
            messages[topic].k[0] = messages[topic].p[0] = 0

    write_bag(folder / 'zero', change=uncalibrated)
    assert rejected('zero', options=['--keep']).startswith(
        'zero: none of 6 pairs could be matched; the first: left camera_info: the camera is not '
        'calibrated (P[0] is 0, ')


def test_a_part_that_is_not_in_the_bag_is_rejected(rejected):
    assert rejected('bag', options=['--start', 5]) == '--start is 5; bag is 0.167 s long'
    assert rejected('bag', options=['--start', -1]) == '--start is -1; bag is 0.167 s long'
    assert rejected('bag', options=['--duration', 0]) == (
        '--duration is 0; allowed are numbers above 0')
    assert rejected('bag', options=['--every', 0]) == (
        '--every is 0; allowed are whole numbers from 1')
    assert 'no messages were synchronised' in rejected('bag', options=['--duration', 1e-9])


def test_outputs_that_make_no_sense_are_rejected(rejected):
    assert rejected('bag', options=['--format', 'none']) == (
        '--format none leaves no output; give --files or --video')
    assert rejected('bag', options=['--format', 'none', '--files', 'npy', '--keep']) == (
        '--keep copies topics into a bag, but --format none writes none; leave one of the two out')
    options = ['--format', 'none', '--files', 'npy', '--with', 'points2']
    assert rejected('bag', options=options) == (
        '--with adds topics to a bag, but --format none writes none; leave one of the two out')
    for options in (['--min-disparity', -3], ['--min-disparity', 250]):
        assert rejected('bag', options=['--files', 'png', *options]).startswith(
            '--files png holds 0 to 255 px')


def test_values_of_options_are_checked_as_those_of_parameters(rejected):
    assert rejected('bag', disparities=0).startswith('disparities is 0')
    assert rejected('bag', options=['--queue-size', 0]) == (
        'queue_size is 0; allowed are numbers from 1 to 1000000')
    assert rejected('bag', options=['--depth-encoding', 'x']) == (
        "depth_encoding is 'x'; allowed are 32FC1, 16UC1")


@pytest.mark.parametrize('name', NAMES)
def test_an_option_has_the_sentence_and_the_default_of_its_parameter(name):
    parser = Parser(prog='test')
    add_node_options(parser, 'title', NAMES)
    settings = node_settings(parser.parse_args([]), NAMES)
    assert settings[name] == ROWS[name].default
    assert type(settings[name]) is type(ROWS[name].default)
    assert ' '.join(ROWS[name].sentence.split()) in ' '.join(parser.format_help().split())


def test_the_bar_is_shown_on_a_terminal_or_where_it_is_asked_for(folder, capsys, monkeypatch):
    assert replay('bag') == 0
    assert capsys.readouterr().err == ''
    assert replay('bag', output='shown', options=['--progress']) == 0
    assert '6/6' in capsys.readouterr().err
    terminal = on_a_terminal(monkeypatch)
    assert replay('bag', output='terminal') == 0
    assert '6/6' in terminal.getvalue()
    assert ' pairs/s' in terminal.getvalue()


def test_sentences_of_a_kind_are_written_once():
    stream = io.StringIO()
    with ProgressBar(10, stream) as bar:
        for number in range(3):
            bar.log(f'pair {number} is bad')
            bar.step()
        bar.log('another')
    assert stream.getvalue() == 'pair 0 is bad\nanother\n'
