# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of a small made rig, and empty ones for results: stand-ins for ROS's own."""
from types import SimpleNamespace

from fuzzy_stereo_ros.pairs.result_messages import POINT_SETTINGS
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, Calibration, Projection, StereoPair
from fuzzy_stereo_ros.parameters.table import NODE_PARAMETERS
import numpy as np
import pytest

USUAL_POINTS = {row.name: row.default for row in NODE_PARAMETERS if row.name in POINT_SETTINGS}
LEFT = Projection(200.0, 201.0, 50.0, 40.0)     # of `make_pair`


def header(stamp=(12, 345), frame_id='left_optical'):
    """Return a header of a stamp (s, ns)."""
    return SimpleNamespace(
        stamp=SimpleNamespace(sec=stamp[0], nanosec=stamp[1]), frame_id=frame_id)


def changed(message, changes):
    message.__dict__.update(changes)
    return message


def image(pixels, pixel_encoding, padding=0, big_endian=False, as_data=bytes, **changes):
    """Return an image message of an array (R, C) or (R, C, channels), rows padded with 170."""
    rows, columns = pixels.shape[:2]
    stored = pixels.astype(pixels.dtype.newbyteorder('>' if big_endian else '<'))
    lines = np.frombuffer(stored.tobytes(), np.uint8).reshape(rows, -1)
    lines = np.pad(lines, ((0, 0), (0, padding)), constant_values=170)
    return changed(SimpleNamespace(
        header=header(), height=rows, width=columns, encoding=pixel_encoding,
        is_bigendian=int(big_endian), step=lines.shape[1], data=as_data(lines.tobytes())), changes)


def compressed(content, form='jpeg'):
    """Return a compressed image message of a file's bytes."""
    return SimpleNamespace(header=header(), format=form, data=bytes(content))


def info(tx=0.0, cx=50.0, **changes):
    """Return a CameraInfo of a camera of 100x80, fx 200."""
    return changed(SimpleNamespace(
        header=header(), height=80, width=100, binning_x=0, binning_y=0,
        distortion_model='plumb_bob', d=[0.0] * 5, k=[200.0, 0, cx, 0, 200.0, 40.0, 0, 0, 1],
        r=[1.0, 0, 0, 0, 1, 0, 0, 0, 1],
        p=[200.0, 0, cx, tx, 0, 200.0, 40.0, 0, 0, 0, 1, 0], roi=region()), changes)


def region(x_offset=0, y_offset=0, height=0, width=0):
    return SimpleNamespace(x_offset=x_offset, y_offset=y_offset, height=height, width=width)


def projection(**places):
    """Return P of `info` with elements changed: p3=-20 sets P[3]."""
    values = info().p
    for place, value in places.items():
        values[int(place[1:])] = value
    return values


def noise(rows, columns, channels=1, dtype=np.uint8, seed=0):
    """Return an image of random pixels, (R, C) or (R, C, channels)."""
    shape = (rows, columns, channels) if channels > 1 else (rows, columns)
    return np.random.default_rng(seed).integers(
        0, np.iinfo(dtype).max, shape, dtype, endpoint=True)


def rejection_of(function, *arguments):
    """Return the BadPair that a call raises."""
    with pytest.raises(BadPair) as rejection:
        function(*arguments)
    return rejection.value


# ---- what results are made of, and put into ----


def made_match(disparity):
    """Return a match of disparities (R, C) that is half sure of what is valid."""
    disparity = np.asarray(disparity, np.float32)
    return SimpleNamespace(disparity=disparity,
                           confidence=np.where(np.isnan(disparity), 0, 0.5).astype(np.float32))


def make_pair(shape, offset=0.0, left=None):
    """Return a StereoPair whose images are both the left one."""
    left = np.zeros(shape, np.uint8) if left is None else left
    return StereoPair(left, left, Calibration(200.0, 0.12, offset, LEFT),
                      12_000_000_345, 'left_optical')


def empty_message(**fields):
    """Return a message with an empty header and the fields that are not just set."""
    return SimpleNamespace(header=header((0, 0), ''), **fields)


def empty_disparity():
    return empty_message(image=empty_message(), valid_window=SimpleNamespace())


def values_of(message):
    """Return the float32 (R, C) of an image of 32FC1."""
    return np.frombuffer(message.data, '<f4').reshape(message.height, message.width)


def field_of(message, name, dtype='<f4'):
    """Return a field of a PointCloud2, (R, C)."""
    (field,) = [field for field in message.fields if field.name == name]
    return np.ndarray((message.height, message.width), dtype, message.data, field.offset,
                      (message.row_step, message.point_step))


def shows(message, disparity, first=15):
    """Return whether a DisparityImage has a disparity nearly everywhere, from a column on."""
    return np.mean(np.abs(values_of(message.image)[:, first:] - disparity) < 0.5) > 0.95
