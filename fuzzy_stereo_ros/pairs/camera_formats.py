# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the calibrations that people have: a table of formats, told apart by their content.

To add a format, add a row to FORMATS. A reader returns the two cameras of a pair as Camera, whose
K, D, R and P rectify raw images; where a file has only how the raw cameras stand to each other,
OpenCV's stereoRectify makes R and P. Lengths are metres, as all of these programs write them but
Middlebury (millimetres) and DepthAI (centimetres).
"""
from collections.abc import Callable
from dataclasses import replace
import json
import re
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.calibration import expected_size, read_calibration
from fuzzy_stereo_ros.pairs.camera_files import (
    Camera, read_camera, read_middlebury_cameras, read_yaml)
from fuzzy_stereo_ros.pairs.image_files import read_bytes
import numpy as np

MODELS = {'radtan': 'plumb_bob', 'radial-tangential': 'plumb_bob', 'none': 'plumb_bob',
          'equidistant': 'equidistant'}     # of Kalibr and EuRoC, by their names
# Names in files of cv2.FileStorage, without case, underlines and the side.
OPENCV_NAMES = {
    'k': ('k', 'm', 'cameramatrix', 'mtx', 'intrinsics', 'intrinsic', 'intrinsicmatrix'),
    'd': ('d', 'dist', 'distcoeffs', 'distcoeff', 'distortion', 'distortioncoefficients'),
    'r': ('r', 'rect', 'rectification', 'rectificationmatrix'),
    'p': ('p', 'proj', 'projection', 'projectionmatrix')}
OPENCV_SIDES = {'left': ('1', 'left', 'l'), 'right': ('2', 'right', 'r')}
ROTATIONS, TRANSLATIONS = ('r', 'rot', 'rotation'), ('t', 'trans', 'translation')
SIZES = ('imagesize', 'size', 'imgsize')
COUNTED = {4, 5, 8, 12, 14}         # coefficients of a distortion that OpenCV knows
CENTIMETRES = 100


class _Raw(NamedTuple):
    """A raw camera: K (3, 3) and D of a size, (rows, columns) or None, and ROS's name of D."""

    k: np.ndarray
    d: np.ndarray
    size: tuple | None = None
    model: str = 'plumb_bob'


class Format(NamedTuple):
    """A format: name, pattern that only it has, number of files, read(paths, contents, shape)."""

    name: str
    pattern: str
    files: tuple
    read: Callable


def read_cameras(paths, shape=None, offset=0.0):
    """
    Return the left and the right Camera of calibration files, of any of FORMATS.

    shape: (R, C) of the images; None = as the files say. offset: px, cx of the left camera minus
    that of the right one, for the ROS YAML of the right camera alone.
    Raises ValueError for a damaged file, or one of another format.
    """
    contents, form = _contents_and_format(paths)
    try:
        left, right = form.read(paths, contents, shape)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError,
            cv2.error) as error:
        names = ' and '.join(map(str, paths))
        text = ' '.join((f'it has no {error}' if isinstance(error, KeyError) else
                         str(error) or type(error).__name__).split())
        raise ValueError(text if names in text else
                         f'{names} is damaged, or no {form.name}: {text}') from None
    if is_of_one_camera(paths):
        p = left.p
        left = replace(left, p=(*p[:2], p[2] + offset, 0.0, *p[4:]))
    return left, right


def is_of_one_camera(paths):
    """Return whether files are the ROS YAML of the right camera alone; errors: `read_cameras`."""
    return len(paths) == 1 and _contents_and_format(paths)[1].read is _ros


def _contents_and_format(paths):
    contents = [read_bytes(path).decode('utf-8', 'replace') for path in paths]
    for form in FORMATS:
        if len(paths) in form.files and re.search(form.pattern, contents[0], re.MULTILINE):
            return contents, form
    raise ValueError(f"the calibration is {' and '.join(map(str, paths))}; allowed are "
                     + ', '.join(form.name for form in FORMATS))


def read_calibration_files(paths, offset=0.0, shape=None):
    """
    Return the Calibration of a rectified pair, and the (rows, columns) of its images or None.

    Arguments and errors are those of `read_cameras`; ValueError, too, without a baseline.
    """
    left, right = read_cameras(paths, shape, offset)
    try:
        calibration = read_calibration(left, right)
        if not calibration.baseline:
            raise ValueError('the baseline is 0 m, or K is missing; calibrate the two cameras as '
                             'a pair')
    except ValueError as error:
        raise ValueError(f'{paths[-1]}: {error}') from None
    return calibration, expected_size(right)


def _ros(paths, contents, shape):
    cameras = [read_camera(path) for path in paths]
    return cameras[0], cameras[-1]


def _middlebury(paths, contents, shape):
    return read_middlebury_cameras(paths[0])


def _kitti(paths, contents, shape):
    """Read P0 and P1, or else P2 and P3: calib.txt of the odometry, calib_cam_to_cam.txt."""
    found = {int(number): np.array(values.split(), float).reshape(3, 4) for number, values in
             re.findall(r'^P(?:_rect_0)?([0-3]):(.*)$', contents[0], re.MULTILINE)}
    pair = (0, 1) if 0 in found and 1 in found else (2, 3)
    size = re.search(r'^(?:S_rect_0[0-3]|size):\s*([\d.e+]+)\s+([\d.e+]+)', contents[0],
                     re.MULTILINE)
    rows, columns = (round(float(size[2])), round(float(size[1]))) if size else shape or (0, 0)
    return tuple(Camera(rows, columns, k=tuple(found[one][:, :3].ravel()),
                        p=tuple(found[one].ravel())) for one in pair)


def _opencv(paths, contents, shape):
    """
    Read what stereoCalibrate and stereoRectify return, from one file or two of FileStorage.

    Not by cv2.FileStorage, which damaged files lead to memory that is not its own.
    """
    found = {}
    for content in contents:
        plain = re.sub('!!opencv(-nd)?-matrix', '', content.replace('%YAML:', '%YAML ', 1))
        for key, value in read_yaml(plain).items():
            if isinstance(value, dict):
                shape_of_it = value.get('sizes') or (value['rows'], value['cols'])
                value = np.reshape(np.array(value['data'], float), shape_of_it)
            found[re.sub(r'[^a-z0-9]', '', str(key).lower())] = value

    def of(names):
        return next((found[name] for name in names if found.get(name) is not None), None)

    sides = {side: {letter: of([word for stem in stems for mark in marks
                                for word in (stem + mark, mark + stem)])
                    for letter, stems in OPENCV_NAMES.items()}
             for side, marks in OPENCV_SIDES.items()}
    size = of(SIZES)
    if size is None and 'imageheight' in found and 'imagewidth' in found:
        size = found['imagewidth'], found['imageheight']
    size = size if size is None else tuple(int(side) for side in np.ravel(size)[1::-1])
    raw = []
    for side, parts in sides.items():
        if parts['k'] is None:
            raise ValueError(f'it has no matrix of the {side} camera: K1, M1 or cameraMatrix1, '
                             'and those with 2, beside D1, D2, R and T')
        distortion = np.zeros(5) if parts['d'] is None else np.ravel(parts['d'])
        raw.append(_Raw(np.reshape(parts['k'], (3, 3)), distortion, size))
    rectified = [parts[letter] for parts in sides.values() for letter in 'rp']
    if all(one is not None for one in rectified):
        return tuple(_camera(one, *rectified[2 * number:2 * number + 2], size or shape)
                     for number, one in enumerate(raw))
    return _rectified(*raw, np.reshape(of(ROTATIONS), (3, 3)), of(TRANSLATIONS), shape)


def _kalibr(paths, contents, shape):
    content = read_yaml(contents[0])
    raw = [_of_yaml(content[name]) for name in ('cam0', 'cam1')]
    between = np.reshape(content['cam1']['T_cn_cnm1'], (4, 4))
    return _rectified(*raw, between[:3, :3], between[:3, 3], shape)


def _euroc(paths, contents, shape):
    both = [read_yaml(content) for content in contents]
    left, right = (np.reshape(np.array(one['T_BS']['data'], float), (4, 4)) for one in both)
    between = np.linalg.inv(right) @ left
    return _rectified(*map(_of_yaml, both), between[:3, :3], between[:3, 3], shape)


def _of_yaml(camera):
    """Return the _Raw of a camera of Kalibr or EuRoC."""
    if camera['camera_model'] != 'pinhole':
        raise ValueError(f"camera_model is {camera['camera_model']!r:.40}; allowed is pinhole")
    fx, fy, cx, cy = map(float, camera['intrinsics'])
    d = camera['distortion_coeffs' if 'distortion_coeffs' in camera else 'distortion_coefficients']
    columns, rows = map(int, camera['resolution'])
    return _Raw(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
                np.array(d, float) if len(d) else np.zeros(5), (rows, columns),
                MODELS[camera['distortion_model']])


def _depthai(paths, contents, shape):
    """Read the EEPROM of an OAK camera, as `calibration.eepromToJsonFile` writes it."""
    content = json.loads(contents[0])
    cameras = dict(content['cameraData'])
    sockets = [content['stereoRectificationData'][f'{side}CameraSocket']
               for side in ('left', 'right')]

    def to_root(socket):
        """Return the (4, 4) of a camera to the last one of its chain of extrinsics."""
        whole, seen = np.eye(4), set()
        while socket in cameras and socket not in seen:
            seen.add(socket)
            extrinsics, step = cameras[socket]['extrinsics'], np.eye(4)
            socket = extrinsics['toCameraSocket']
            if socket in cameras:
                step[:3, :3] = extrinsics['rotationMatrix']
                step[:3, 3] = [extrinsics['translation'][axis] / CENTIMETRES for axis in 'xyz']
            whole = step @ whole
        return whole

    between = np.linalg.inv(to_root(sockets[1])) @ to_root(sockets[0])
    raw = []
    for socket in sockets:
        one = cameras[socket]
        fisheye = one.get('cameraType', 0) == 1
        raw.append(_Raw(np.array(one['intrinsicMatrix'], float),
                        np.array(one['distortionCoeff'][:4 if fisheye else 14], float),
                        (int(one['height']), int(one['width'])),
                        'equidistant' if fisheye else 'rational_polynomial'))
    return _rectified(*raw, between[:3, :3], between[:3, 3], shape)


def _rectified(left, right, rotation, translation, shape):
    """
    Return the two Camera of raw ones: R and P by stereoRectify, without pixels that neither sees.

    rotation (3, 3), translation, metres: from left to right camera. shape: of the images; K is
    scaled to it where it is of a larger or smaller image of the same field of view.
    """
    shape = shape or left.size
    if shape is None:
        raise ValueError('the calibration has no size of the images; it is read beside images')
    left, right = (_of_size(one, shape) for one in (left, right))
    fisheye = left.model == 'equidistant'
    arguments = (left.k, left.d, right.k, right.d, shape[::-1], np.array(rotation, float),
                 np.ravel(translation).astype(float).reshape(3, 1))
    found = (cv2.fisheye.stereoRectify(*arguments, cv2.fisheye.CALIB_ZERO_DISPARITY) if fisheye
             else cv2.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0))
    return tuple(_camera(one, found[side], found[2 + side], shape)
                 for side, one in enumerate((left, right)))


def _of_size(one, shape):
    """Return a _Raw with K of images of a shape; ValueError for another ratio of the sides."""
    if one.size in (None, shape):
        return one
    down, across = (now / before for now, before in zip(shape, one.size))
    if abs(down - across) > 0.01 * across:
        raise ValueError(f'the calibration is of {one.size[1]}x{one.size[0]} pixels, the images '
                         f'have {shape[1]}x{shape[0]}: cut out or not of the same field of view')
    k = np.diag([across, down, 1.0]) @ one.k
    k[:2, 2] += ((across - 1) / 2, (down - 1) / 2)      # the centre of the first pixel is 0
    return one._replace(k=k, size=shape)


def _camera(one, rotation, projection, shape):
    distortion = np.ravel(one.d)
    if one.model != 'equidistant' and distortion.size not in COUNTED:
        raise ValueError(f'a distortion has {distortion.size} numbers; allowed are '
                         f"{', '.join(map(str, sorted(COUNTED)))}")
    rows, columns = shape or (0, 0)
    model = 'rational_polynomial' if distortion.size > 5 else one.model
    return Camera(rows, columns, *(tuple(map(float, np.ravel(values))) for values in (
        one.k, projection, rotation, distortion)), distortion_model=model)


# From the one with the surest mark to the one with the least.
FORMATS = (
    Format('one or two YAML or JSON files of cv2.FileStorage (stereoCalibrate, stereoRectify)',
           r'\A%YAML:1\.0|opencv-(nd-)?matrix', (1, 2), _opencv),
    Format('calib.txt of Middlebury 2014', r'^cam0\s*=|^doffs\s*=', (1,), _middlebury),
    Format('calib.txt or calib_cam_to_cam.txt of KITTI', r'^P(_rect_0)?[0-3]:', (1,), _kitti),
    Format("DepthAI's EEPROM as JSON", r'"cameraData"', (1,), _depthai),
    Format('a camchain.yaml of Kalibr', r'^cam0:', (1,), _kalibr),
    Format("the two sensor.yaml of EuRoC's left and right camera", r'^T_BS:', (2,), _euroc),
    Format('the ROS YAML of the right camera, or those of the left and the right one',
           r'\b(image_width|camera_matrix|projection_matrix)"?\s*:', (1, 2), _ros))
