# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cameras of a pair: YAML of camera_calibration, calib.txt of Middlebury 2014, and lenses.

What their names and coefficients mean is one rule for files and messages.
"""
from dataclasses import dataclass, field
import re
from types import SimpleNamespace

from fuzzy_stereo_ros.pairs.image_files import read_bytes, write_whole
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, Projection
import numpy as np

EQUIDISTANT = 'equidistant'
COEFFICIENTS = {'plumb_bob': (4, 5, 8, 12, 14), 'rational_polynomial': (4, 5, 8, 12, 14),
                EQUIDISTANT: (4,)}      # numbers that D may have, by distortion_model
# What else programs call these, in lower case without signs; '' leaves it open.
NAMES = {'radtan': 'plumb_bob', 'radialtangential': 'plumb_bob', 'brownconrady': 'plumb_bob',
         'equi': EQUIDISTANT, 'fisheye': EQUIDISTANT, 'kannalabrandt': EQUIDISTANT,
         'kannalabrandt4': EQUIDISTANT, 'pinhole': '', 'perspective': '', 'none': ''}
LARGEST_NUMBER = 1e9        # absolute value in K, D and P, as products must stay finite
MATRICES = {'k': ('camera_matrix', 3, 3), 'd': ('distortion_coefficients', 1, None),
            'r': ('rectification_matrix', 3, 3), 'p': ('projection_matrix', 3, 4)}
MOST_ALIASES = 16      # in a YAML text: each nested alias can double the data it expands to


@dataclass(frozen=True)
class Camera:
    """The fields of a sensor_msgs/CameraInfo, without its header."""

    height: int
    width: int
    k: tuple
    p: tuple
    r: tuple = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    d: tuple = (0.0, 0.0, 0.0, 0.0, 0.0)
    distortion_model: str = 'plumb_bob'
    binning_x: int = 0
    binning_y: int = 0
    roi: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False))


def centred_calibration(focal, baseline, offset, rows, columns):
    """Return the Calibration, px and m, whose left principal point is the image's centre."""
    return Calibration(focal, baseline, offset,
                       Projection(focal, focal, (columns - 1) / 2, (rows - 1) / 2))


def rectified_cameras(calibration, rows, columns):
    """Return {'left': Camera, 'right': Camera} of a rectified pair with a Calibration."""
    fx, fy, cx, cy = calibration.left
    focal = calibration.focal
    return {'left': _rectified(fx, fy, cx, cy, 0.0, rows, columns),
            'right': _rectified(focal, fy, cx - calibration.offset, cy,
                                -focal * calibration.baseline, rows, columns)}


def _rectified(fx, fy, cx, cy, tx, rows, columns):
    return Camera(rows, columns, k=(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0),
                  p=(fx, 0.0, cx, tx, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0))


def write_camera(path, camera, name):
    """Write a Camera as YAML, with its name; OSError if it cannot be written."""
    import yaml     # here, as few users of this module need it

    content = {'image_width': camera.width, 'image_height': camera.height, 'camera_name': name}
    for letter, (title, rows, columns) in MATRICES.items():
        numbers = list(getattr(camera, letter))
        if letter == 'd':
            content['distortion_model'] = camera.distortion_model
        content[title] = {'rows': rows, 'cols': columns or len(numbers), 'data': numbers}
    write_whole(path, yaml.safe_dump(content, sort_keys=False, width=float('inf'),
                                     default_flow_style=None).encode())


def read_camera(path):
    """Return the Camera of a YAML file; ValueError unless it is as `write_camera` writes."""
    text, matrices = read_bytes(path), {}
    try:
        content = read_yaml(text)
        for letter, (title, rows, columns) in MATRICES.items():
            matrices[letter] = tuple(map(float, content[title]['data']))
            if columns is not None and len(matrices[letter]) != rows * columns:
                raise ValueError(f'{title} has {len(matrices[letter])} numbers; needed are '
                                 f'{rows * columns}')
        shape = tuple(map(content['distortion_coefficients'].get, ('rows', 'cols')))
        names = map(content.get, ('distortion_model', 'camera_model'))
        return Camera(int(content['image_height']), int(content['image_width']), **matrices,
                      distortion_model=model_of(names, shape))
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        reason = f'it has no {error}' if isinstance(error, KeyError) else ' '.join(
            str(error).split())
        raise ValueError(f'{path} is no calibration of a camera as written by '
                         f'camera_calibration: {reason}') from None


def write_middlebury_calibration(path, calibration, shape, min_disparity, disparities):
    """Write calib.txt of Middlebury 2014: in mm, doffs is minus our offset; shape: (R, C)."""
    fx, fy, cx, cy = calibration.left
    centres = {'cam0': cx, 'cam1': cx - calibration.offset}
    lines = [f'{name}=[{fx!r} 0 {centre!r}; 0 {fy!r} {cy!r}; 0 0 1]'
             for name, centre in centres.items()]
    rows, columns = shape
    lines += [f'doffs={0.0 - calibration.offset!r}', f'baseline={1000 * calibration.baseline!r}',
              f'width={columns}', f'height={rows}',
              f'ndisp={max(min_disparity + disparities, 1)}',
              'isint=0', f'vmin={min_disparity}', f'vmax={min_disparity + disparities - 1}',
              'dyavg=0', 'dymax=0']
    write_whole(path, ('\n'.join(lines) + '\n').encode())


def read_yaml(text):
    """Return the data of a YAML text; ValueError, in one line, if it is none."""
    import yaml

    try:
        if sum(isinstance(token, yaml.AliasToken) for token in yaml.scan(text)) > MOST_ALIASES:
            raise ValueError(f'it has more than {MOST_ALIASES} aliases')
        return yaml.safe_load(text)
    except Exception as error:  # yaml raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(' '.join(str(error).split()) or type(error).__name__) from None


def model_of(names, shape=None):
    """
    Return the distortion_model of ROS for what a program calls a camera and its lens.

    names: texts, None or ''. shape: of D, where its file tells it; BadPair where 4 x 1 may be of
    two models. Names unknown or of two models are returned: `coefficients_of` rejects them.
    """
    found = {NAMES.get(re.sub('[^a-z0-9]', '', str(name).lower()), str(name))
             for name in names if name} - {''}
    if not found and shape == (4, 1):
        raise BadPair('calibration', 'D is 4 x 1, as cv2.fisheye makes it, but is not said to be '
                      'of a fisheye: add the line "distortion_model: fisheye" to the file, or '
                      '"distortion_model: plumb_bob"')
    return ' and '.join(sorted(found - COEFFICIENTS.keys() or found)) or 'plumb_bob'


def coefficients_of(model, d):
    """
    Return D for OpenCV: float64 (N,), without zeros beyond the fourth.

    No coefficients are four zeros, which of a fisheye are no pinhole's: angle and radius are
    proportional. Raises BadPair for another model, or D of another size or of no usable numbers.
    """
    if model not in COEFFICIENTS:
        raise BadPair('calibration', f'distortion_model is {model!r:.60}; allowed are '
                      f"{', '.join(COEFFICIENTS)}; for others, which are not supported, rectify "
                      'elsewhere, and set rectify and crop to false')
    d, allowed = np.ravel(np.array(d, float)), COEFFICIENTS[model]
    if not d[4:].any():
        d = d[:4] if d.size else np.zeros(4)
    if d.size not in allowed or not are_usable(d):
        raise BadPair('calibration', f'D has {d.size} numbers; allowed for {model} are '
                      f"{', '.join(map(str, allowed))} finite ones, none above "
                      f'{LARGEST_NUMBER:g}')
    return d


def lens_of(names, d):
    """Return `model_of` names and `coefficients_of` D, an array of any shape or None."""
    d = () if d is None else d
    model = model_of(names, np.shape(d))
    return model, coefficients_of(model, d)


def are_usable(values):
    """Return whether all numbers are finite and at most `LARGEST_NUMBER`."""
    return bool(np.all(np.abs(values) <= LARGEST_NUMBER))
