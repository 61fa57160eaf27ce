# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo synthesise` writes is the made scene and its cameras, as a whole or not."""
import os
from pathlib import Path
import shlex
from unittest import mock

from command_output import printed
from fuzzy_stereo_ros.commands import synthesise
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.calibration import expected_size, read_calibration
from fuzzy_stereo_ros.pairs.camera_formats import read_cameras
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.pairs.messages import read_image as read_message, stamp_of
from fuzzy_stereo_ros.synthetic.scenes import BASELINE, FOCAL, make_sequence
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures('folder')
SMALL = ['--columns', '70', '--rows', '40', '--disparities', '16']
SEQUENCE = [*SMALL, '--frames', '3', '--seed', '4', '--poles', '2', '--pan', '3', '--motion', '2',
            '--noise', '1', '--exposure', '0.9', '--flicker', '0.1',
            '--min-disparity', '2', '--offset', '-5']
MADE = {'rows': 40, 'columns': 70, 'disparities': 16, 'frames': 3, 'seed': 4, 'poles': 2,
        'pan': 3.0, 'motion': 2.0, 'noise': 1.0, 'exposure': 0.9, 'flicker': 0.1,
        'min_disparity': 2}


def synthesised(*words):
    return main(['synthesise', '--output', 'scene', *words])


def files():
    return sorted(str(path) for path in Path().rglob('*') if path.is_file())


def assert_calibrated(*cameras):
    calibration = read_calibration(*cameras)
    assert calibration.focal == pytest.approx(FOCAL * 70)
    assert calibration.baseline == pytest.approx(BASELINE)
    assert calibration.offset == pytest.approx(-5)
    assert calibration.left == pytest.approx((FOCAL * 70, FOCAL * 70, 34.5, 19.5))


def test_the_files_hold_the_scene_that_the_options_make_and_what_is_told_to_do_next_works(capsys):
    assert synthesised(*SEQUENCE) == 0
    assert files() == sorted([
        *(f'scene/{name}/{number:04}.{suffix}' for number in range(3)
          for name, suffix in (('left', 'png'), ('right', 'png'), ('visible', 'png'),
                               ('truth', 'pfm'))),
        'scene/calib.txt', 'scene/left.yaml', 'scene/right.yaml'])
    for number, pair in enumerate(make_sequence(**MADE)):
        for name, image in (('left', pair.left), ('right', pair.right),
                            ('visible', np.where(pair.visible, 255, 0))):
            assert np.array_equal(read_image(f'scene/{name}/{number:04}.png'), image)
        assert np.array_equal(read_disparity(f'scene/truth/{number:04}.pfm'), pair.truth)
    for names in (['calib.txt'], ['left.yaml', 'right.yaml']):
        cameras = read_cameras([Path('scene', name) for name in names])
        assert_calibrated(*cameras)
        assert expected_size(cameras[1]) == (40, 70)
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first == 'scene: 3 pairs of 70x40 pixels, 16 disparities from 2 px'
    words = shlex.split(second.removeprefix('match the first: fuzzy-stereo '))
    truth = printed(capsys, *words, '--json')['ground_truth']
    assert truth['pixels'] == np.count_nonzero(next(make_sequence(**MADE)).visible)


@pytest.mark.parametrize('words, options', [
    ([], {}), (['--bits', '12', '--colour'], {'bits': 12, 'colour': True})])
def test_a_bag_holds_the_same_scene_with_equal_stamps_at_the_rate(words, options):
    highlevel = pytest.importorskip('rosbags.highlevel')
    typesys = pytest.importorskip('rosbags.typesys')
    assert synthesised(*SEQUENCE, *words, '--format', 'bag', '--rate', '8') == 0
    heard = {}
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    with highlevel.AnyReader([Path('scene')], default_typestore=store) as reader:
        for connection, stamp, content in reader.messages():
            message = reader.deserialize(content, connection.msgtype)
            assert stamp_of(message.header) == stamp
            heard.setdefault(connection.topic, {})[stamp] = message
    assert sorted(heard) == [f'/{side}/{name}' for side in ('left', 'right')
                             for name in ('camera_info', 'image_rect')]
    stamps = sorted(heard['/left/image_rect'])
    assert all(sorted(messages) == stamps for messages in heard.values())
    assert np.diff(stamps).tolist() == [125_000_000] * 2
    for stamp, pair in zip(stamps, make_sequence(**MADE, **options)):
        for side, image in (('left', pair.left), ('right', pair.right)):
            read = read_message(heard[f'/{side}/image_rect'][stamp])
            assert read.dtype == image.dtype and np.array_equal(read, image)
        assert_calibrated(*(heard[f'/{side}/camera_info'][stamp] for side in ('left', 'right')))


def test_only_overwrite_replaces_a_sequence_with_all_old_files_and_nothing_else(capsys):
    pytest.importorskip('rosbags')
    assert synthesised(*SEQUENCE) == 0
    before = Path('scene/left/0000.png').read_bytes()
    assert synthesised(*SMALL, '--frames', '1') == 2
    assert '--output is scene, which exists; give --overwrite' in capsys.readouterr().err
    assert Path('scene/left/0000.png').read_bytes() == before
    assert synthesised(*SMALL, '--frames', '1', '--overwrite') == 0
    assert os.listdir('scene/left') == ['0000.png']
    assert Path('scene/left/0000.png').read_bytes() != before
    assert synthesised(*SMALL, '--frames', '1', '--overwrite', '--format', 'bag') == 0
    assert files() == ['scene/metadata.yaml', 'scene/scene_0.mcap']
    assert synthesised(*SMALL, '--frames', '1', '--overwrite') == 0
    assert 'scene/metadata.yaml' not in files()
    Path('scene/mine.txt').touch()
    before = files()
    assert synthesised(*SMALL, '--overwrite') == 2
    assert 'which holds other files than a synthetic sequence' in capsys.readouterr().err
    assert files() == before


@pytest.mark.parametrize('error, code, words', [
    (OSError(28, 'No space left on device'), 2, 'scene cannot be written: No space left on dev'),
    (KeyboardInterrupt(), 130, 'fuzzy-stereo: interrupted; the folder is as before')])
def test_what_ends_half_way_leaves_nothing_behind(error, code, words, capsys):
    with mock.patch.object(synthesise, 'write_disparity', side_effect=error):
        assert synthesised(*SMALL) == code
    assert words in capsys.readouterr().err
    assert os.listdir() == []
