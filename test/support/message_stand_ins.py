# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Matches, pairs and messages without ROS, for tests of what is made of them."""
from array import array
from types import SimpleNamespace

from fuzzy_stereo_ros.pairs.point_clouds import POINT_SETTINGS
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.parameters.table import NODE_PARAMETERS
import numpy as np

USUAL_POINTS = {row.name: row.default for row in NODE_PARAMETERS if row.name in POINT_SETTINGS}
LEFT = Projection(200.0, 201.0, 50.0, 40.0)


def header():
    return SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id='')


def made_match(disparity):
    disparity = np.asarray(disparity, np.float32)
    return SimpleNamespace(disparity=disparity,
                           confidence=np.where(np.isnan(disparity), 0, 0.5).astype(np.float32))


def make_pair(shape, offset=0.0, left=None):
    left = np.zeros(shape, np.uint8) if left is None else left
    return StereoPair(left, left, Calibration(200.0, 0.12, offset, LEFT),
                      12_000_000_345, 'left_optical')


def disparity_stand_in():
    return SimpleNamespace(
        header=header(), image=SimpleNamespace(header=header()),
        f=0.0, t=0.0, valid_window=SimpleNamespace(),
        min_disparity=0.0, max_disparity=0.0, delta_d=0.0)


def image_stand_in():
    return SimpleNamespace(header=header())


def camera_info_stand_in():
    region = SimpleNamespace(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    return SimpleNamespace(header=header(), roi=region, binning_x=0, binning_y=0)


def cloud_stand_in():
    return SimpleNamespace(header=header(), fields=[], point_step=0, data=array('B'))


def read_values(message):
    return np.frombuffer(message.data, '<f4').reshape(message.height, message.width)
