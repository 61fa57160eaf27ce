# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo replay` does with folders of images and videos: the same as with a bag."""
import json

import cv2
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from made_bags import COLUMNS, content, disparities, ROWS, scene
from made_scenes import DISPARITIES, street, STREET_CAMERA
import numpy as np
import pytest
from replayed import figures, matches
from written_scenes import write_images

STEP = 100_000_000      # ns, at the usual rate


@pytest.fixture
def folder(folder):
    """Work in a folder with the frames of two cameras."""
    for number, pair in enumerate(scene()):
        write_images(folder, pair, f'left/left_{number}.png', f'right/right_{number}.png')
    return folder


def maps(output):
    """Return the disparities that were written, in order."""
    return [np.load(path) for path in sorted((output / 'disparity').glob('*.npy'))]


def test_folders_patterns_and_videos_are_matched_warm_and_bit_for_bit_as_the_matcher_does(
        folder, capsys):
    bgr = [[cv2.cvtColor(getattr(pair, side), cv2.COLOR_GRAY2BGR) for pair in scene()]
           for side in ('left', 'right')]
    for name, images in (('both', [np.hstack(pair) for pair in zip(*bgr)]), *zip('ab', bgr)):
        writer = cv2.VideoWriter(f'{name}.avi', cv2.VideoWriter.fourcc(*'FFV1'), 10.0,
                                 images[0].shape[1::-1])
        if not writer.isOpened():
            pytest.skip('this OpenCV writes no video without loss')
        for image in images:
            writer.write(image)
        writer.release()
    expected = matches(scene(), [number * STEP for number in range(6)])
    for name, inputs in (('one', ['left', 'right']), ('two', ['left/*.png', 'right/*']),
                         ('three', ['both.avi']), ('four', ['a.avi', 'b.avi'])):
        found = figures(capsys, *inputs, output=name, options=['--files', 'npy'])
        assert found['calibration'] == 'nothing: disparities are without metres'
        assert found['pairs']['matched'] == 6 and found['pairs']['warm'] == 5
        for written, match in zip(maps(folder / name), expected, strict=True):
            np.testing.assert_array_equal(written, match.disparity)
    message = content(folder / 'one', '/disparity')[-1][2]
    assert (message.header.stamp.nanosec, message.f, message.t) == (5 * STEP, 0, 0)


def test_what_synthesise_writes_is_matched_with_its_cameras_and_resumed(folder, capsys):
    assert main(['synthesise', '--output', 'made', '--frames', '4', '--rows', str(ROWS),
                 '--columns', str(COLUMNS)]) == 0
    options = ['--files', 'npy', '--duration', 0.15, '--with', 'depth']
    found = figures(capsys, 'made', options=options)
    assert found['calibration'] == 'made/calib.txt' and found['pairs']['matched'] == 2
    record = json.loads((folder / 'out' / 'replay.json').read_text())
    record['duration'] = None       # as if the first run had been interrupted
    (folder / 'out' / 'replay.json').write_text(json.dumps(record))
    found = figures(capsys, 'made', options=['--files', 'npy', '--with', 'depth', '--resume'])
    assert found['pairs']['matched'] == found['pairs']['matched_again'] == 2
    whole = figures(capsys, 'made', output='whole', options=['--files', 'npy'])
    assert whole['pairs']['matched'] == 4
    assert all(map(np.array_equal, disparities(folder / 'out').values(),
                   disparities(folder / 'whole').values()))


def test_a_calibration_reaches_the_matcher_which_follows_the_camera_by_it(folder, capsys):
    for number, pair in enumerate(street()[:3]):
        write_images(folder / 'street', pair, f'left/{number}.png', f'right/{number}.png')
    found = figures(capsys, 'street', disparities=DISPARITIES, options=[
        '--files', 'npy', '--focal', STREET_CAMERA.fx, '--baseline', 0.12])
    assert found['calibration'].startswith('focal length ')
    last, without = (matches(street()[:3], [0, STEP, 2 * STEP], DISPARITIES, camera)[-1].disparity
                     for camera in (STREET_CAMERA, None))
    assert not np.array_equal(last, without, equal_nan=True)
    np.testing.assert_array_equal(maps(folder / 'out')[-1], last)


@pytest.mark.parametrize('inputs, left, right, calibration, baseline', [
    (['00'], '00/image_0', '00/image_1', '00/calib.txt', 0.5),
    (['00/image_2', '00/image_3/*.png'], '00/image_2', '00/image_3', '00/calib.txt', 0.4),
    (['day/drive/image_02/data', './day/drive/image_03/data'], 'day/drive/image_02/data',
     'day/drive/image_03/data', 'day/calib_cam_to_cam.txt', 0.4)])
def test_folders_of_kitti_get_their_own_cameras(
        folder, capsys, inputs, left, right, calibration, baseline):
    for old, new in (('left', left), ('right', right)):
        (folder / new).parent.mkdir(parents=True, exist_ok=True)
        (folder / old).rename(folder / new)
    (folder / calibration).write_text(''.join(
        f'P{"_rect_0" * ("cam" in calibration)}{number}: 200 0 60 {tx} 0 200 30 0 0 0 1 0\n'
        for number, tx in enumerate((0, -100, 20, -60))))
    found = figures(capsys, *inputs, options=[
        '--format', 'none', '--files', 'npy', '--duration', '0.05'])
    assert found['calibration'].endswith(calibration.split('/')[-1])
    stored = json.loads((folder / 'out' / 'calibration.json').read_text())
    assert stored['baseline'] == pytest.approx(baseline)
    single = [next((folder / side).iterdir()) for side in (left, right)]
    words = ['match', *map(str, single), '--calibration', str(folder / calibration), '--output',
             'one.pfm', '--depth', 'one.npy', '--disparities', '16']
    assert main(words) == 0
    shift = np.asarray(read_disparity(folder / 'one.pfm'))
    depth = np.load(folder / 'one.npy')
    valid = np.isfinite(depth)
    np.testing.assert_allclose(depth[valid] * shift[valid], 200 * baseline, rtol=1e-4)


def test_a_frame_that_one_camera_lacks_or_that_is_damaged_costs_its_pair_alone(folder, capsys):
    (folder / 'right' / 'right_2.png').unlink()
    (folder / 'left' / 'left_4.png').write_bytes(b'no image')
    found = figures(capsys, 'left', 'right')
    assert found['pairs']['matched'] == 4
    assert found['pairs']['rejected'] == {'damaged image': 1}
    assert found['messages']['unmatched'] == {'/left/image_rect': 1, '/right/image_rect': 0}
