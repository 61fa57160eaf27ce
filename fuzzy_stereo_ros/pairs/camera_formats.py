# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the calibrations that people have: a table of formats, told apart by their content.

To add a format, add a row to FORMATS. A reader returns the two cameras of a pair, as Camera,
whose K, D, R and P rectify raw images; where a file has only how the raw cameras stand to each
other, OpenCV's stereoRectify makes R and P; where it has only rectified ones, R is `UNKNOWN`. P is
in the unit of the format, which `read_cameras` makes metres.
"""
from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path
import re
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.pairs.calibration import read_calibration
from fuzzy_stereo_ros.pairs.camera_files import (
    Camera, centred_calibration, EQUIDISTANT, lens_of, read_camera, read_yaml, rectified_cameras)
from fuzzy_stereo_ros.pairs.image_files import read_bytes
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, Projection
import numpy as np

UNITS = {'m': 1, 'cm': 100, 'mm': 1000}     # of lengths in files, by how many are a metre
UNKNOWN = (0.0,) * 9                        # R of cameras whose raw images nothing is known of
# Names in files of cv2.FileStorage, without case, underlines and the side.
OPENCV_NAMES = {
    'k': ('k', 'm', 'cameramatrix', 'mtx', 'intrinsics', 'intrinsic', 'intrinsicmatrix'),
    'd': ('d', 'dist', 'distcoeffs', 'distcoeff', 'distortion', 'distortioncoefficients'),
    'r': ('r', 'rect', 'rectification', 'rectificationmatrix'),
    'p': ('p', 'proj', 'projection', 'projectionmatrix')}
OPENCV_SHAPES = {'k': (3, 3), 'd': (), 'r': (3, 3), 'p': (3, 4)}    # () = as it is
OPENCV_SIDES = ('1', 'left', 'l'), ('2', 'right', 'r')
ROTATIONS, TRANSLATIONS = ('r', 'rot', 'rotation'), ('t', 'trans', 'translation')
SIZES = ('imagesize', 'size', 'imgsize')
KITTI_FOLDER = re.compile('(image_|colou?red_)0?([0-3])')
DEPTHAI_LENSES = 'perspective', 'fisheye', 'equirectangular', 'radial division'


class _Raw(NamedTuple):
    """A raw camera: K (3, 3) of a size, (rows, columns) or None, and its lens as of `lens_of`."""

    k: np.ndarray
    size: tuple | None
    model: str
    d: np.ndarray


class Format(NamedTuple):
    """A format: pattern that only it has, read(paths, texts of these, shape, images), unit."""

    name: str
    pattern: str
    files: tuple
    read: Callable
    unit: str = 'm'


def read_cameras(paths, shape=None, offset=0.0, unit=None, images=()):
    """
    Return the left and the right Camera of calibration files, of any of FORMATS.

    shape: (R, C) of the images; None = as the files say. offset: px, cx of the left camera minus
    that of the right one, for the ROS YAML of the right camera alone. unit: of UNITS, of the
    lengths; None = that of the format. images: paths of the left and the right images, whose
    folders tell which of KITTI's cameras they are of.
    Raises ValueError for a damaged file, one of another format, or a lens of another model, and
    as `read_calibration`.
    """
    contents, form = _contents_and_format(paths)
    names = ' and '.join(map(str, paths))
    try:
        left, right = (replace(camera, p=tuple(
            value / UNITS[unit or form.unit] if place % 4 == 3 else value
            for place, value in enumerate(camera.p)))
            for camera in form.read(paths, contents, shape, images))
        if len(paths) == 1 and form.read is _ros:
            p = left.p
            left = replace(left, p=(*p[:2], p[2] + offset, 0.0, *p[4:]))
        read_calibration(left, right)       # names what is wrong
    except BadPair as bad:
        raise ValueError(f'{names}: {bad}') from None
    except (ArithmeticError, LookupError, TypeError, ValueError, RecursionError,
            cv2.error) as error:
        text = ' '.join((f'it has no {error}' if isinstance(error, KeyError) else
                         str(error) or type(error).__name__).split())
        raise ValueError(text if any(str(path) in text for path in paths) else
                         f'{names} is damaged, or no {form.name}: {text}') from None
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


def _ros(paths, contents, shape, images):
    cameras = [read_camera(path) for path in paths]
    return cameras[0], cameras[-1]


def _middlebury(paths, contents, shape, images):
    found = dict(re.findall(r'^(\w+)=(.*?)\s*$', contents[0], re.MULTILINE))
    fx, _, cx, _, fy, cy = map(float, re.findall(r'[^\s;\[\]]+', found['cam0'])[:6])
    size = [int(found[name]) for name in ('height', 'width') if name in found]
    return rectified_cameras(Calibration(
        fx, float(found['baseline']), -float(found['doffs']), Projection(fx, fy, cx, cy)),
        *(size if len(size) == 2 else shape or (0, 0))).values()


def _kitti(paths, contents, shape, images):
    """Read those of P0 to P3 whose numbers the images' folders have, else P0, P1, else P2, P3."""
    found = {f'P{number}': np.array(values.split(), float).reshape(3, 4) for number, values in
             re.findall(r'^P(?:_rect_0)?([0-3]):(.*)$', contents[0], re.MULTILINE)}
    pair = [_number_of(path) for path in images]
    if None in pair or len(pair) != 2:
        pair = (0, 1) if {'P0', 'P1'} <= found.keys() else (2, 3)
    size = re.search(r'^(?:S_rect_0[0-3]|size):\s*([\d.e+]+)\s+([\d.e+]+)', contents[0],
                     re.MULTILINE)
    return _only_rectified((found[f'P{one}'] for one in pair), (
        round(float(size[2])), round(float(size[1]))) if size else shape)


def _number_of(path):
    """Return the number of the camera of KITTI that a path of images names, None without."""
    names = map(KITTI_FOLDER.fullmatch, reversed(Path(path).resolve().parts))
    return next((int(name[2]) + 2 * name[1].startswith('c') for name in names if name), None)


def _opencv(paths, contents, shape, images):
    """Read stereoCalibrate and stereoRectify, not by cv2.FileStorage, which is not memory safe."""
    found = {}
    for content in contents:
        plain = re.sub('!!opencv(-nd)?-matrix', '', content.replace('%YAML:', '%YAML ', 1))
        for key, value in dict(read_yaml(plain)).items():
            if isinstance(value, dict):
                shape_of_it = value.get('sizes') or (value['rows'], value['cols'])
                value = np.reshape(np.array(value['data'], float), shape_of_it)
            found[re.sub(r'[^a-z0-9]', '', str(key).lower())] = value

    def of(names, *shape):
        value = next((found[name] for name in names if found.get(name) is not None), None)
        return value if value is None else np.array(value, float).reshape(shape or np.shape(value))

    sides = [{letter: of([word for stem in stems for mark in marks
                          for word in (stem + mark, mark + stem)], *OPENCV_SHAPES[letter])
              for letter, stems in OPENCV_NAMES.items()} for marks in OPENCV_SIDES]
    size, rotation, translation = of(SIZES), of(ROTATIONS, 3, 3), of(TRANSLATIONS)
    if size is None and 'imageheight' in found and 'imagewidth' in found:
        size = found['imagewidth'], found['imageheight']
    size = size if size is None else tuple(int(side) for side in np.ravel(size)[1::-1])
    if 'q' in found and all(parts['p'] is None for parts in sides):
        *centre, focal, (_, _, per_baseline, shift) = of(['q'], 4, 4).tolist()
        left = Projection(focal[3], focal[3], *(-line[3] for line in centre))
        cameras = rectified_cameras(
            Calibration(left.fx, 1 / per_baseline, -shift / per_baseline, left), 0, 0)
        for parts, camera in zip(sides, cameras.values()):
            parts['p'] = np.reshape(camera.p, (3, 4))
    has_k, has_r, has_p = (all(parts[letter] is not None for parts in sides) for letter in 'krp')
    is_whole, is_moved = has_r and has_p, rotation is not None and translation is not None
    if has_k and (is_whole or is_moved):
        names = ['fisheye' * bool(found.get('fisheyemodel')), 'omnidir' * ('xi1' in found),
                 *(str(found.get(key, '')) for key in ('distortionmodel', 'cameramodel'))]
        raw = [_Raw(parts['k'], size, *lens_of(names, parts['d'])) for parts in sides]
        if is_whole:
            return tuple(_camera(one, parts['r'], parts['p'], size or shape)
                         for one, parts in zip(raw, sides))
        made = _rectified(*raw, rotation, translation, size or shape if has_p else shape)
        return tuple(replace(camera, p=tuple(parts['p'].ravel())) if has_p else camera
                     for camera, parts in zip(made, sides))
    if not has_p:
        raise ValueError('it has neither K1, D1, K2, D2, R and T of raw cameras, or other names '
                         'of these, nor P1 and P2, or Q, of rectified ones')
    return _only_rectified((parts['p'] for parts in sides), size or shape)


def _only_rectified(projections, shape):
    """Return the Camera of each P, (3, 4), of a shape or None."""
    return tuple(Camera(*(shape or (0, 0)), k=tuple(p[:, :3].ravel()), p=tuple(p.ravel()),
                        r=UNKNOWN) for p in projections)


def _kalibr(paths, contents, shape, images):
    content = read_yaml(contents[0])
    raw = [_of_yaml(content[name]) for name in ('cam0', 'cam1')]
    between = np.reshape(content['cam1']['T_cn_cnm1'], (4, 4))
    return _rectified(*raw, between[:3, :3], between[:3, 3], shape)


def _euroc(paths, contents, shape, images):
    both = [read_yaml(content) for content in contents]
    left, right = (np.reshape(np.array(one['T_BS']['data'], float), (4, 4)) for one in both)
    between = np.linalg.inv(right) @ left
    return _rectified(*map(_of_yaml, both), between[:3, :3], between[:3, 3], shape)


def _of_yaml(camera):
    lens = lens_of((camera['camera_model'], camera.get('distortion_model')), camera.get(
        'distortion_coeffs', camera.get('distortion_coefficients')))
    fx, fy, cx, cy = map(float, camera['intrinsics'])
    columns, rows = map(int, camera['resolution'])
    return _Raw(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), (rows, columns), *lens)


def _depthai(paths, contents, shape, images):
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
                step[:3, 3] = [extrinsics['translation'][axis] for axis in 'xyz']
            whole = step @ whole
        return whole

    between = np.linalg.inv(to_root(sockets[1])) @ to_root(sockets[0])
    raw = []
    for socket in sockets:
        one = cameras[socket]
        lens = lens_of([DEPTHAI_LENSES[one.get('cameraType', 0)]], one['distortionCoeff'])
        raw.append(_Raw(np.array(one['intrinsicMatrix'], float),
                        (int(one['height']), int(one['width'])), *lens))
    return _rectified(*raw, between[:3, :3], between[:3, 3], shape)


def _rectified(left, right, rotation, translation, shape):
    """Return both Camera by stereoRectify, K scaled to a shape; BadPair for two kinds."""
    if (left.model == EQUIDISTANT) != (right.model == EQUIDISTANT):
        raise BadPair('calibration', f'the lenses are {left.model} and {right.model}; a pair '
                      'needs two fisheyes or none, or R1, R2, P1 and P2 of both')
    shape = shape or left.size
    if shape is None:
        raise ValueError('the calibration has no size of the images; it is read beside images')
    left, right = (_of_size(one, shape) for one in (left, right))
    moved = np.array(translation, float).reshape(3, 1)
    arguments = left.k, left.d, right.k, right.d, shape[::-1], np.array(rotation, float), moved
    if left.model == EQUIDISTANT:   # OpenCV's P shrinks the middle, until all of a wide lens fits
        turns = cv2.fisheye.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY)[:2]
        made = centred_calibration(left.k[0, 0], -(turns[1] @ moved).item(0), 0.0, *shape)
        found = *turns, *(one.p for one in rectified_cameras(made, *shape).values())
    else:
        found = cv2.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
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
    model = 'rational_polynomial' if one.d.size > 5 else one.model
    return Camera(*(shape or (0, 0)), *(tuple(map(float, np.ravel(values))) for values in (
        one.k, projection, rotation, one.d)), distortion_model=model)


# From the one with the surest mark to the one with the least.
FORMATS = (
    Format('one or two YAML or JSON files of cv2.FileStorage (stereoCalibrate, stereoRectify)',
           r'\A%YAML:1\.0|opencv-(nd-)?matrix', (1, 2), _opencv),
    Format('calib.txt of Middlebury 2014', r'^cam0\s*=|^doffs\s*=', (1,), _middlebury, 'mm'),
    Format('calib.txt or calib_cam_to_cam.txt of KITTI', r'^P(_rect_0)?[0-3]:', (1,), _kitti),
    Format("DepthAI's EEPROM as JSON", r'"cameraData"', (1,), _depthai, 'cm'),
    Format('a camchain.yaml of Kalibr', r'^cam0:', (1,), _kalibr),
    Format("the two sensor.yaml of EuRoC's left and right camera", r'^T_BS:', (2,), _euroc),
    Format('the ROS YAML of the right camera, or those of the left and the right one',
           r'\b(image_width|camera_matrix|projection_matrix)"?\s*:', (1, 2), _ros))
