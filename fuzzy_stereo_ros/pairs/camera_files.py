# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Write YAML of camera_calibration and calib.txt of Middlebury 2014; read the former."""
from dataclasses import dataclass, field
from types import SimpleNamespace

from fuzzy_stereo_ros.pairs.image_files import read_bytes, write_whole
from fuzzy_stereo_ros.pairs.lenses import model_of
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection

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
    """Return the Camera of a YAML file; ValueError if the file is not as `write_camera` writes."""
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
    """
    Write calib.txt of Middlebury 2014: in mm, and doffs is minus our offset; OSError.

    shape: (rows, columns) of the images. min_disparity, disparities: px, range of the truth.
    """
    fx, fy, cx, cy = calibration.left
    centres = {'cam0': cx, 'cam1': cx - calibration.offset}
    lines = [f'{name}=[{fx!r} 0 {centre!r}; 0 {fy!r} {cy!r}; 0 0 1]'
             for name, centre in centres.items()]
    rows, columns = shape
    lines += [f'doffs={0.0 - calibration.offset!r}', f'baseline={1000 * calibration.baseline!r}',
              f'width={columns}', f'height={rows}', f'ndisp={min_disparity + disparities}',
              'isint=0', f'vmin={min_disparity}', f'vmax={min_disparity + disparities - 1}',
              'dyavg=0', 'dymax=0']
    write_whole(path, ('\n'.join(lines) + '\n').encode())


def read_yaml(text):
    """
    Return the plain data of a YAML text, str or bytes; ValueError, in one line, if it is none.

    Each nested alias can double the data, so that more than `MOST_ALIASES` are rejected.
    """
    import yaml

    try:
        if sum(isinstance(token, yaml.AliasToken) for token in yaml.scan(text)) > MOST_ALIASES:
            raise ValueError(f'it has more than {MOST_ALIASES} aliases')
        return yaml.safe_load(text)
    except Exception as error:  # yaml raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(' '.join(str(error).split()) or type(error).__name__) from None
