# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cameras in files are as they were; a raw rig, as each program writes it, is rectified so."""
from functools import partial
import json
import re

import cv2
from fuzzed import examples
from fuzzy_stereo_ros.pairs.calibration import expected_size, read_calibration
from fuzzy_stereo_ros.pairs.camera_files import (
    Camera, read_camera, rectified_cameras, write_camera, write_middlebury_calibration)
from fuzzy_stereo_ros.pairs.camera_formats import (
    is_of_one_camera, read_cameras, UNITS)
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection
from fuzzy_stereo_ros.parameters.options import CameraOptions
from hypothesis import given, strategies as st
import numpy as np
import pytest
import yaml

SHAPE = 480, 640
K = [np.array([[400.0 + one, 0, 320], [0, 401, 240.0 - one], [0, 0, 1]]) for one in (0, 3)]
D = [np.array([-0.1, 0.02, 0.001, -0.002]), np.array([-0.11, 0.03, 0.0, 0.001])]
FISHEYE = [np.array([0.02, -0.01, 0.004, -0.001]), np.array([0.03, -0.02, 0.004, 0.0])]
R = cv2.Rodrigues(np.array([0.01, -0.02, 0.015]))[0]        # from the left to the right camera
T = np.array([-0.12, 0.003, -0.002])
MOVED = np.vstack([np.column_stack([R, T]), [0, 0, 0, 1]])
RNG = np.random.default_rng(4)
POINTS = np.column_stack([RNG.uniform(-1, 1, 40), RNG.uniform(-0.8, 0.8, 40),
                          RNG.uniform(2, 9, 40)])       # metres, before the left camera
FOUND = cv2.stereoRectify(K[0], D[0], K[1], D[1], SHAPE[::-1], R, T[:, np.newaxis],
                          flags=0, alpha=0.5)       # with an offset
MADE = dict(zip(('R1', 'R2', 'P1', 'P2', 'Q'), FOUND))


def storage(path, **values):
    written = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        written.write(name, value)
    written.release()
    return [path]


def lenses(names, d=D):
    """Return {name: value} of K and D, as cv2.calibrateCamera makes it, of both cameras."""
    return dict(zip(names.split(), (K[0], d[0][np.newaxis], K[1], d[1][np.newaxis])))


def opencv_one_file(folder, d=D, **more):
    return storage(
        folder / 'stereo.yml', R=R, T=T, image_size=SHAPE[::-1], **more,
        **lenses('cameraMatrix1 distCoeffs1 cameraMatrix2 distCoeffs2', d))


def opencv_fisheye(folder, d=FISHEYE, **more):
    """Write D in columns, as cv2.fisheye makes it."""
    return storage(folder / 'stereo.yml', K1=K[0], D1=d[0][:, np.newaxis], K2=K[1],
                   D2=d[1][:, np.newaxis], R=R, T=T, **(more or {'fisheye_model': 1}))


def opencv_two_files(folder):
    return [*storage(folder / 'intrinsics.yml', **lenses('M1 D1 M2 D2')),
            *storage(folder / 'extrinsics.yml', R=R, T=T, **MADE)]


def opencv_without_turns(folder):
    return storage(folder / 'stereo.yml', R=R, T=T, Q=MADE['Q'], **lenses('K1 D1 K2 D2'))


def opencv_json(folder):
    return storage(folder / 'stereo.json', R=R, T=T, **lenses('K_left D_left K_right D_right'))


def intrinsics(side):
    return [float(K[side][place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2))]


def kalibr(folder, d=D, lens='radtan', **changes):
    path = folder / 'camchain.yaml'
    path.write_text(yaml.safe_dump({f'cam{side}': {
        'camera_model': 'pinhole', 'intrinsics': intrinsics(side), 'distortion_model': lens,
        'distortion_coeffs': d[side].tolist(), 'resolution': [*SHAPE[::-1]],
        **({'T_cn_cnm1': MOVED.tolist()} if side else {}), **changes} for side in (0, 1)}))
    return [path]


def euroc(folder, d=D, lens='radial-tangential'):
    paths = []
    for side, on_body in enumerate((np.eye(4), np.linalg.inv(MOVED))):
        content = {'T_BS': {'cols': 4, 'rows': 4, 'data': on_body.ravel().tolist()},
                   'camera_model': 'pinhole', 'intrinsics': intrinsics(side),
                   'distortion_model': lens, 'resolution': SHAPE[::-1],
                   'distortion_coefficients': d[side].tolist()}
        paths.append(folder / f'sensor{side}.yaml')
        paths[-1].write_text('\n'.join(f'{name}: {json.dumps(value)}'
                                       for name, value in content.items()))
    return paths


def depthai(folder, d=D, types=(0, 0)):
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
            'cameraType': types[side or 0], 'height': rows, 'width': columns,
            'intrinsicMatrix': k.tolist(),
            'distortionCoeff': [*(d[side] if side is not None else []), *10 * [0.0]],
            'extrinsics': {'toCameraSocket': to, 'rotationMatrix': moved[:3, :3].tolist(),
                           'translation': dict(zip('xyz', (100 * moved[:3, 3]).tolist()))}}])
    path = folder / 'eeprom.json'
    path.write_text(json.dumps({'cameraData': cameras, 'stereoRectificationData': {
        'leftCameraSocket': 1, 'rightCameraSocket': 2}}))
    return [path]


RAW = {'pinhole': [opencv_one_file, opencv_two_files, opencv_without_turns, opencv_json, kalibr,
                   euroc, depthai],
       'fisheye': [opencv_fisheye, partial(opencv_one_file, d=FISHEYE, distortion_model='Fisheye'),
                   partial(kalibr, d=FISHEYE, lens='equidistant'),
                   partial(euroc, d=FISHEYE, lens='equidistant'),
                   partial(depthai, d=FISHEYE, types=(1, 1)),
                   *(partial(write, d=[np.zeros(4)] * 2, **lens) for write, lens in (
                       (opencv_fisheye, {}), (kalibr, {'lens': 'equi'}),
                       (euroc, {'lens': 'equidistant'}), (depthai, {'types': (1, 1)})))]}


@pytest.mark.parametrize('lens, write', [(lens, write) for lens in RAW for write in RAW[lens]])
def test_points_of_a_raw_rig_come_to_the_same_row_at_the_disparity_of_their_depth(
        tmp_path, lens, write):
    cameras = read_cameras(write(tmp_path), SHAPE)
    calibration = read_calibration(*cameras)
    of_opencv = cv2.fisheye if lens == 'fisheye' else cv2
    d = getattr(write, 'keywords', {}).get('d', FISHEYE if lens == 'fisheye' else D)
    rectified = []
    for camera, k, one, (rotation, translation) in zip(
            cameras, K, d, ((np.eye(3), np.zeros(3)), (R, T))):
        vector = cv2.Rodrigues(rotation)[0]
        seen = (cv2.fisheye.projectPoints(POINTS[np.newaxis], vector, translation, k, one)
                if lens == 'fisheye' else
                cv2.projectPoints(POINTS, vector, translation, k, one))[0].reshape(-1, 1, 2)
        p = np.reshape(camera.p, (3, 4))[:, :3]
        assert (camera.distortion_model == 'equidistant') == (lens == 'fisheye')
        rectified.append(of_opencv.undistortPoints(
            seen, np.reshape(camera.k, (3, 3)), np.array(camera.d), None,
            np.reshape(camera.r, (3, 3)), p).reshape(-1, 2))
    left, right = rectified
    depth = (POINTS @ np.reshape(cameras[0].r, (3, 3)).T)[:, 2]
    assert np.abs(left[:, 1] - right[:, 1]).max() < 0.02        # undistortPoints iterates
    disparity = calibration.focal * calibration.baseline / depth + calibration.offset
    assert np.abs(left[:, 0] - right[:, 0] - disparity).max() < 0.02
    assert calibration.baseline == pytest.approx(np.linalg.norm(T)) and not calibration.remarks
    if lens == 'fisheye':
        assert calibration.left == (400, 400, 319.5, 239.5)     # the middle stays as large
    assert (calibration.focal == pytest.approx(MADE['P1'][0, 0])) == (
        write in (opencv_two_files, opencv_without_turns))
    assert (cameras[0].height, cameras[0].width) == SHAPE and not is_of_one_camera(
        sorted(tmp_path.iterdir()))


def ros(folder, lens, d, cols=None):
    paths = [folder / 'left.yaml', folder / 'right.yaml']
    for path, tx in zip(paths, (0, -20)):
        matrices = {'camera_matrix': np.diag([200.0, 200, 1]), 'rectification_matrix': np.eye(3),
                    'distortion_coefficients': np.reshape(d, (-1, cols or len(d) or 1)),
                    'projection_matrix': np.array([[200, 0, 160, tx], [0, 200, 120, 0],
                                                   [0, 0, 1, 0]])}
        path.write_text(yaml.safe_dump({'image_width': 320, 'image_height': 240, **lens, **{
            name: {'rows': values.shape[0], 'cols': values.shape[1],
                   'data': values.ravel().tolist()} for name, values in matrices.items()}}))
    return paths


FOUR = [0.02, -0.01, 0.004, -0.001]
UNSUPPORTED = "distortion_model is '{}'; allowed are plumb_bob, rational_polynomial, equidistant"


@pytest.mark.parametrize('write, expected', [
    (partial(ros, lens={'camera_model': 'fisheye'}, d=FOUR), 'equidistant'),
    (partial(ros, lens={'distortion_model': 'equidistant'}, d=[]), 'equidistant'),
    (partial(ros, lens={'distortion_model': 'Kannala-Brandt'}, d=FOUR, cols=1), 'equidistant'),
    (partial(ros, lens={'distortion_model': 'plumb_bob'}, d=FOUR, cols=1), 'plumb_bob'),
    (partial(ros, lens={}, d=FOUR), 'plumb_bob'),
    (partial(ros, lens={}, d=FOUR, cols=1), 'D is 4 x 1'),
    (partial(opencv_fisheye, unit='m'), 'D is 4 x 1, as cv2.fisheye makes it'),
    (partial(opencv_fisheye, d=[np.zeros(4)] * 2, fisheye_model=0), 'D is 4 x 1'),
    (partial(opencv_fisheye, distortion_model='plumb_bob'), 'plumb_bob'),
    (partial(opencv_fisheye, camera_model='fisheye'), 'equidistant'),
    (partial(opencv_fisheye, camera_model='fisheye', distortion_model='radtan'),
     UNSUPPORTED.format('equidistant and plumb_bob')),
    (partial(opencv_one_file, xi1=1.2, xi2=1.2), UNSUPPORTED.format('omnidir')),
    (partial(kalibr, lens='none', d=[np.zeros(0)] * 2), 'plumb_bob'),
    (partial(kalibr, lens='fov', d=[np.ones(1)] * 2), UNSUPPORTED.format('fov')),
    (partial(kalibr, camera_model='omni', intrinsics=[1.3, 400.0, 400.0, 320.0, 240.0]),
     UNSUPPORTED.format('omni')),
    (partial(kalibr, lens='equidistant', d=[np.ones(3)] * 2), 'D has 3 numbers; allowed for equi'),
    (partial(depthai, types=(2, 2)), UNSUPPORTED.format('equirectangular')),
    (partial(depthai, types=(0, 1)), 'the lenses are plumb_bob and equidistant; a pair needs'),
])
def test_names_and_coefficients_tell_the_lens_or_a_sentence_says_why_not(
        tmp_path, write, expected):
    paths = write(tmp_path)
    if ' ' not in expected:
        assert {camera.distortion_model for camera in read_cameras(paths, SHAPE)} == {expected}
        return
    with pytest.raises(ValueError, match=re.escape(expected)) as caught:
        read_cameras(paths, SHAPE)
    assert str(caught.value).count('\n') == 0 and str(caught.value).count(str(paths[0])) == 1


@pytest.mark.parametrize('names', [
    ('P1', 'P2'), ('Q',), ('P1', 'P2', 'Q'), ('R1', 'R2', 'P1', 'P2', 'Q')])
def test_what_is_rectified_needs_no_raw_cameras_unless_it_is_to_be_rectified(tmp_path, names):
    values = {name: MADE[name] for name in names}
    if 'R1' in names:
        values.update(R=R, T=T)         # extrinsics.yml of OpenCV's sample
    (path,) = storage(tmp_path / 'rectified.yml', **values)
    found = read_calibration(*read_cameras([path], SHAPE))
    known = read_calibration(*read_cameras(opencv_two_files(tmp_path), SHAPE))
    assert (found.focal, found.baseline, found.offset, *found.left) == pytest.approx(
        (known.focal, known.baseline, known.offset, *known.left))
    options = CameraOptions((str(path),))
    assert options.cameras(SHAPE, 'a test')[0] == read_cameras([path], SHAPE)
    with pytest.raises(ValueError, match='need the calibration of both raw cameras'):
        options.cameras(SHAPE, 'a test', raw=True)
    (path,) = storage(tmp_path / 'too_few.yml', P1=MADE['P1'], K1=K[0], T=T)
    with pytest.raises(ValueError, match='neither K1, D1.* nor P1 and P2, or Q, of rectified'):
        read_cameras([path], SHAPE)


def middlebury(folder):
    (folder / 'calib.txt').write_text(f'cam0=[400 0 320; 0 400 240; 0 0 1]\ndoffs=0\n'
                                      f'baseline={1000 * np.linalg.norm(T)}\n')
    return [folder / 'calib.txt']


@pytest.mark.parametrize('write, own', [
    (opencv_one_file, 'm'), (opencv_two_files, 'm'), (kalibr, 'm'), (euroc, 'm'),
    (depthai, 'cm'), (middlebury, 'mm')])
def test_lengths_are_of_the_unit_that_is_said_or_of_the_format(tmp_path, write, own):
    paths, known = write(tmp_path), np.linalg.norm(T)
    baselines = {unit: read_calibration(*read_cameras(paths, SHAPE, unit=unit)).baseline
                 for unit in (None, *UNITS)}
    assert baselines == pytest.approx({None: known, **{
        unit: known * UNITS[own] / count for unit, count in UNITS.items()}})


@examples(40)
@given(data=st.data(), write=st.sampled_from([write for several in RAW.values()
                                              for write in several] + [middlebury]))
def test_any_word_of_a_file_may_be_another_one(tmp_path, data, write):
    paths = write(tmp_path)
    path = data.draw(st.sampled_from(paths))
    words = list(re.finditer(r'[-+.\w]+', path.read_text()))
    word = data.draw(st.sampled_from(words))
    other = data.draw(st.sampled_from(
        ['x', '-1', '0', '1e400', 'nan', '[]', '{}', 'null', '""', '[[1, 2], 3]', 'true', '']))
    path.write_text(word.string[:word.start()] + other + word.string[word.end():])
    try:
        read_cameras(paths, SHAPE)
    except ValueError as error:
        assert '\n' not in str(error) and type(error) is ValueError


# P of the cameras of KITTI's sequence 00, with the shifts between rows that real files have.
KITTI = {0: (0, 0, 0), 1: (-386.1448, 0, 0), 2: (45.38225, -0.1130887, 0.003779761),
         3: (-337.2877, 2.369057, 0.004915215)}
GREY, COLOUR = 386.1448 / 718.856, (45.38225 + 337.2877) / 718.856


def kitti(path, numbers=KITTI, name='P{}'):
    path.write_text('calib_time: 09-Jan-2012 13:57:47\n' + ''.join(
        f'{name.format(number)}: 718.856 0 607.1928 {KITTI[number][0]} 0 718.856 185.2157 '
        f'{KITTI[number][1]} 0 0 1 {KITTI[number][2]}\n' for number in numbers))
    return path


@pytest.mark.parametrize('name', ['P{}', 'P_rect_0{}'])
@pytest.mark.parametrize('left, right, baseline', [
    ('00/image_0/000000.png', '00/image_1/000000.png', GREY),
    ('training/image_2', 'training/image_3', COLOUR),
    ('training/colored_0/000000_10.png', 'training/colored_1/000000_10.png', COLOUR),
    ('drive/image_02/data/*.png', 'drive/image_03/data/*.png', COLOUR),
    ('image_3', 'image_2', 'left and right are swapped'),
    ('left', 'right', GREY), ('image_2.png', 'image_3.png', GREY), ('image_2', 'right', GREY)])
def test_the_folders_of_kitti_tell_the_cameras(tmp_path, name, left, right, baseline):
    path = kitti(tmp_path / 'calib.txt', name=name)
    beside = {'shape': (376, 1241), 'images': (tmp_path / left, tmp_path / right)}
    if isinstance(baseline, str):
        with pytest.raises(ValueError, match=f'calib.txt: the baseline is .*: {baseline}'):
            read_cameras([path], **beside)
    else:
        found = read_calibration(*read_cameras([path], **beside))
        assert found.baseline == pytest.approx(baseline) and not found.remarks


def test_two_cameras_of_kitti_alone_are_the_pair_and_others_are_missed(tmp_path):
    path = kitti(tmp_path / 'calib.txt', (2, 3))
    assert read_calibration(*read_cameras([path])).baseline == pytest.approx(COLOUR)
    with pytest.raises(ValueError, match='calib.txt .*of KITTI: it has no .P0'):
        read_cameras([path], images=('image_0', 'image_1'))


# ---- cameras in files come back as they were ----


numbers = st.floats(-1e4, 1e4)
calibrations = st.builds(
    lambda fx, fy, baseline, offset, cx, cy: Calibration(
        fx, baseline, offset, Projection(fx, fy, cx, cy)),
    st.floats(1, 1e4), st.floats(1, 1e4), st.floats(0.01, 10), numbers, numbers, numbers)


@examples(20)
@given(k=st.tuples(*[numbers] * 9), p=st.tuples(*[numbers] * 12), r=st.tuples(*[numbers] * 9),
       d=st.lists(numbers, max_size=14).map(tuple), rows=st.integers(1, 9999),
       model=st.sampled_from(['plumb_bob', 'rational_polynomial', 'equidistant']))
def test_a_camera_comes_back_from_its_file_to_the_last_bit(tmp_path, k, p, r, d, rows, model):
    camera = Camera(rows, 640, k, p, r, d, model)
    write_camera(tmp_path / 'left.yaml', camera, 'made/left')
    assert read_camera(tmp_path / 'left.yaml') == camera


@examples(20)
@given(known=calibrations)
def test_a_rig_comes_back_from_yaml_and_from_calib_txt(tmp_path, known):
    for side, camera in rectified_cameras(known, 48, 64).items():
        write_camera(tmp_path / f'{side}.yaml', camera, side)
    paths = [tmp_path / 'left.yaml', tmp_path / 'right.yaml']
    for lowest, number, least in ((-32, 32, 1), (-3, 20, 17)):      # at least one is searched
        write_middlebury_calibration(tmp_path / 'calib.txt', known, (48, 64), lowest, number)
        assert f'\nndisp={least}\n' in (tmp_path / 'calib.txt').read_text()
    for cameras in (read_cameras(paths), read_cameras(paths[1:], offset=known.offset),
                    read_cameras([tmp_path / 'calib.txt'])):
        found = read_calibration(*cameras)
        assert (found.focal, found.baseline) == pytest.approx(
            (known.focal, known.baseline), rel=1e-12)
        assert (found.offset, *found.left) == pytest.approx(
            (known.offset, *known.left), rel=1e-12, abs=1e-10)
        assert expected_size(cameras[1]) == (48, 64)


def test_the_calibration_of_middlebury_2014_is_in_metres_and_of_our_sign(tmp_path):
    """At doffs of 131 px what has no disparity is no further than f B / doffs."""
    (tmp_path / 'calib.txt').write_text(
        'cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\n'
        'cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\ndoffs=131.111\n'
        'baseline=193.001\nwidth=2964\nheight=1988\nndisp=280\nisint=0\nvmin=31\nvmax=257\n')
    cameras = read_cameras([tmp_path / 'calib.txt'])
    found = read_calibration(*cameras)
    assert found.baseline == pytest.approx(0.193001)
    assert (found.focal, found.offset) == (3997.684, pytest.approx(-131.111))
    assert found.left == (3997.684, 3997.684, 1176.728, 1011.728)
    assert expected_size(cameras[1]) == (1988, 2964)


def test_files_that_no_format_takes_together_are_rejected(tmp_path):
    write_camera(tmp_path / 'one.yaml', Camera(4, 4, 9 * (1.0,), 12 * (1.0,)), 'one')
    with pytest.raises(ValueError, match='one.yaml and .*one.yaml and .*one.yaml; allowed'):
        read_cameras(3 * [tmp_path / 'one.yaml'])
