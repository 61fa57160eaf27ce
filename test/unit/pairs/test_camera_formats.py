# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One raw rig, written as each program writes it, is rectified as the geometry says."""
import json
from pathlib import Path

import cv2
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.calibration import read_calibration
from fuzzy_stereo_ros.pairs.camera_formats import is_of_one_camera, read_cameras
from fuzzy_stereo_ros.pairs.image_files import write_image
import numpy as np
import pytest
from real_pairs import DATA
import yaml

SHAPE = 480, 640
K = [np.array([[400.0 + one, 0, 320], [0, 401, 240.0 - one], [0, 0, 1]]) for one in (0, 3)]
D = [np.array([-0.1, 0.02, 0.001, -0.002]), np.array([-0.11, 0.03, 0.0, 0.001])]
R = cv2.Rodrigues(np.array([0.01, -0.02, 0.015]))[0]        # from the left to the right camera
T = np.array([-0.12, 0.003, -0.002])
MOVED = np.vstack([np.column_stack([R, T]), [0, 0, 0, 1]])
RNG = np.random.default_rng(4)
POINTS = np.column_stack([RNG.uniform(-1, 1, 40), RNG.uniform(-0.8, 0.8, 40),
                          RNG.uniform(2, 9, 40)])       # metres, before the left camera


def storage(path, **values):
    written = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        written.write(name, value)
    written.release()
    return [path]


def opencv_one_file(folder):
    return storage(folder / 'stereo.yml', cameraMatrix1=K[0], distCoeffs1=D[0],
                   cameraMatrix2=K[1], distCoeffs2=D[1], R=R, T=T, image_size=SHAPE[::-1])


def opencv_two_files(folder):
    found = cv2.stereoRectify(K[0], D[0], K[1], D[1], SHAPE[::-1], R, T[:, np.newaxis],
                              flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
    return [*storage(folder / 'intrinsics.yml', M1=K[0], D1=D[0], M2=K[1], D2=D[1]),
            *storage(folder / 'extrinsics.yml', R=R, T=T,
                     **dict(zip(('R1', 'R2', 'P1', 'P2', 'Q'), found[:5])))]


def opencv_json(folder):
    return storage(folder / 'stereo.json', K_left=K[0], D_left=D[0], K_right=K[1], D_right=D[1],
                   R=R, T=T)


def intrinsics(side):
    return [float(K[side][place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2))]


def kalibr(folder):
    path = folder / 'camchain.yaml'
    path.write_text(yaml.safe_dump({f'cam{side}': {
        'camera_model': 'pinhole', 'intrinsics': intrinsics(side), 'distortion_model': 'radtan',
        'distortion_coeffs': D[side].tolist(), 'resolution': [*SHAPE[::-1]],
        **({'T_cn_cnm1': MOVED.tolist()} if side else {})} for side in (0, 1)}))
    return [path]


def euroc(folder):
    paths = []
    for side, on_body in enumerate((np.eye(4), np.linalg.inv(MOVED))):
        content = {'T_BS': {'cols': 4, 'rows': 4, 'data': on_body.ravel().tolist()},
                   'camera_model': 'pinhole', 'intrinsics': intrinsics(side),
                   'distortion_model': 'radial-tangential', 'resolution': SHAPE[::-1],
                   'distortion_coefficients': D[side].tolist()}
        paths.append(folder / f'sensor{side}.yaml')
        paths[-1].write_text('\n'.join(f'{name}: {json.dumps(value)}'
                                       for name, value in content.items()))
    return paths


def depthai(folder):
    """Write the left camera as it stands to the colour camera, and that one to the right."""
    to_colour = np.eye(4)
    to_colour[:3, 3] = 0.05, 0.001, 0
    rows, columns = (2 * side for side in SHAPE)        # K is of the full resolution
    cameras = []
    for socket, side, moved, to in ((1, 0, to_colour, 0), (2, 1, None, -1),
                                    (0, None, MOVED @ np.linalg.inv(to_colour), 2)):
        k = np.eye(3) if side is None else np.diag([2, 2, 1]) @ K[side]
        k[:2, 2] += 0.5 * (side is not None)
        moved = np.eye(4) if moved is None else moved
        cameras.append([socket, {
            'cameraType': 0, 'height': rows, 'width': columns, 'intrinsicMatrix': k.tolist(),
            'distortionCoeff': [*(D[side] if side is not None else []), *10 * [0.0]],
            'extrinsics': {'toCameraSocket': to, 'rotationMatrix': moved[:3, :3].tolist(),
                           'translation': dict(zip('xyz', (100 * moved[:3, 3]).tolist()))}}])
    path = folder / 'eeprom.json'
    path.write_text(json.dumps({'cameraData': cameras, 'stereoRectificationData': {
        'leftCameraSocket': 1, 'rightCameraSocket': 2}}))
    return [path]


@pytest.mark.parametrize('write', [
    opencv_one_file, opencv_two_files, opencv_json, kalibr, euroc, depthai])
def test_points_of_a_raw_rig_come_to_the_same_row_at_the_disparity_of_their_depth(
        tmp_path, write):
    cameras = read_cameras(write(tmp_path), SHAPE)
    calibration = read_calibration(*cameras)
    rectified = []
    for camera, k, d, (rotation, translation) in zip(
            cameras, K, D, ((np.eye(3), np.zeros(3)), (R, T))):
        seen, _ = cv2.projectPoints(POINTS, cv2.Rodrigues(rotation)[0], translation, k, d)
        p = np.reshape(camera.p, (3, 4))[:, :3]
        rectified.append(cv2.undistortPoints(
            seen, np.reshape(camera.k, (3, 3)), np.array(camera.d), None,
            np.reshape(camera.r, (3, 3)), p).reshape(-1, 2))
    left, right = rectified
    depth = (POINTS @ np.reshape(cameras[0].r, (3, 3)).T)[:, 2]
    assert np.abs(left[:, 1] - right[:, 1]).max() < 0.02        # undistortPoints iterates
    disparity = calibration.focal * calibration.baseline / depth + calibration.offset
    assert np.abs(left[:, 0] - right[:, 0] - disparity).max() < 0.02
    assert calibration.baseline == pytest.approx(np.linalg.norm(T))
    assert (cameras[0].height, cameras[0].width) == SHAPE and not is_of_one_camera(
        sorted(tmp_path.iterdir()))


def test_kitti_has_rectified_cameras_with_a_baseline(tmp_path):
    path = tmp_path / 'calib.txt'
    path.write_text('P2: 707.1 0 601.9 45 0 707.1 183.1 0 0 0 1 0\n'
                    'P3: 707.1 0 601.9 -334 0 707.1 183.1 0 0 0 1 0\n')
    found = read_calibration(*read_cameras([path], (370, 1226)))
    assert found.baseline == pytest.approx(379 / 707.1) and found.offset == 0
    if DATA.exists():
        drive = DATA / 'kitti2012_seq' / '000027' / 'calib.txt'
        assert read_calibration(*read_cameras([drive])).baseline == pytest.approx(0.537, abs=0.001)


def test_a_file_of_opencv_with_projections_is_not_taken_for_one_of_kitti(tmp_path):
    projections = {'P1': np.eye(3, 4) * 500, 'P2': np.eye(3, 4) * 500}
    projections['P2'][0, 3] = -50
    path = storage(tmp_path / 'rectified.yml', M1=K[0], M2=K[1], R1=np.eye(3), R2=np.eye(3),
                   **projections)
    assert read_calibration(*read_cameras(path, SHAPE)).baseline == pytest.approx(0.1)


@pytest.fixture
def wall(tmp_path, monkeypatch):
    """
    Work in a folder with left/0.png and right/0.png: raw images of a wall at 4 m.

    Return the words that rectify them, and a function that checks float32 (R, C), px: nearly all
    disparities are those of its depth.
    """
    monkeypatch.chdir(tmp_path)
    texture = cv2.resize(RNG.integers(0, 256, (120, 160), np.uint8), (640, 480),
                         interpolation=cv2.INTER_CUBIC)
    columns, rows = np.meshgrid(np.arange(640.0), np.arange(480.0))
    for side, (rotation, translation) in enumerate(((np.eye(3), np.zeros(3)), (R, T))):
        rays = cv2.undistortPoints(np.stack([columns, rows], -1).reshape(-1, 1, 2), K[side],
                                   D[side]).reshape(-1, 2)
        rays = np.column_stack([rays, np.ones(len(rays))]) @ rotation
        centre = -rotation.T @ translation
        on_wall = centre + rays * ((4 - centre[2]) / rays[:, 2])[:, np.newaxis]
        x, y = ((on_wall[:, axis] * 90 + half).reshape(480, 640).astype(np.float32)
                for axis, half in ((0, 320), (1, 240)))
        folder = tmp_path / ('left', 'right')[side]
        folder.mkdir()
        write_image(folder / '0.png', cv2.remap(
            texture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))
    (path,) = opencv_one_file(tmp_path)
    disparity = read_calibration(*read_cameras([path])).focal * np.linalg.norm(T) / 4

    def check(found):
        close = np.abs(found - disparity) < 1
        assert close.mean() > 0.75 and close[np.isfinite(found)].mean() > 0.9

    return ['--calibration', str(path), '--rectify'], check


OWN_ROWS = '--disparities', '32', '--no-align-rows'     # as rectification leaves them


def test_raw_images_of_a_pair_are_rectified_by_match(wall, capsys):
    rectified, check = wall
    words = ['match', 'left/0.png', 'right/0.png', *OWN_ROWS, '--output', 'found.npy']
    assert main([*words, *rectified]) == 0, capsys.readouterr().err
    check(np.load('found.npy'))
    assert main([*words, '--overwrite', '--rectify']) == 2
    assert '--rectify and --crop need the calibration of both' in capsys.readouterr().err


def test_raw_images_of_folders_are_rectified_by_replay(wall, capsys):
    rectified, check = wall
    words = ['replay', 'left', 'right', *OWN_ROWS, '--output', 'out', '--files', 'npy']
    assert main([*words, *rectified]) == 0, capsys.readouterr().err
    (found,) = Path('out/disparity').iterdir()
    check(np.load(found))
