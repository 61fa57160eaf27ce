# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Real pairs with ground truth: where they are found, and windows that move over them."""
from typing import NamedTuple

import cv2
from made_scenes import noisy
import numpy as np
import pytest
from repository import ROOT

DATA = ROOT.parent / 'shared' / 'data'
MIDDLEBURY = {'tsukuba': (16, 16), 'venus': (20, 8), 'teddy': (60, 4), 'cones': (60, 4)}


class RealPair(NamedTuple):
    """Images, truth in pixels (NaN = unknown), which pixels count, and disparities to search."""

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray
    visible: np.ndarray
    disparities: int


def motorcycle():
    """Return scikit-image's pair, or skip the test where scikit-image is not installed."""
    data = pytest.importorskip('skimage.data', reason='scikit-image is not installed')
    left, right, truth = data.stereo_motorcycle()
    truth = np.where(np.isfinite(truth), truth, np.nan).astype(np.float32)
    left, right = (np.ascontiguousarray(image[..., ::-1]) for image in (left, right))
    return RealPair(left, right, truth, seen_by_both(truth), 64)


def middlebury(name):
    """Return one of the four pairs of the paper's Table I."""
    disparities, scale = MIDDLEBURY[name]
    return _of_folder(DATA / 'middv2' / name, disparities, scale, 'nonocc.png')


def third_size(name, rows, columns):
    """Return the upper left of a pair of 2006."""
    pair = _of_folder(DATA / 'midd2006_third' / name, 80, 3, 'nonocc_derived.png')
    return RealPair(*(np.ascontiguousarray(image[:rows, :columns]) for image in pair[:4]), 80)


def kitti_frames(name, numbers):
    """Return pairs of images of a sequence, and the truth of frame 10."""
    folder = DATA / 'kitti2012_seq' / name
    pairs = [tuple(read_grey(folder / f'{side}_{number:02d}.png')
                   for side in ('left', 'right')) for number in numbers]
    return pairs, _truth(folder / 'disp_noc_10.png', 256)


def seen_by_both(truth):
    """Return the pixels whose match lies inside the right image, behind nothing known."""
    columns = np.arange(truth.shape[1])
    visible = np.zeros(truth.shape, bool)
    for row, disparities in enumerate(truth):
        pointed = columns - disparities
        inside = pointed >= 0                       # false for an unknown disparity
        place = np.rint(pointed[inside]).astype(int)
        nearest = np.full(truth.shape[1] + 2, -np.inf)
        for beside in (0, 1, 2):
            np.maximum.at(nearest, place + beside, disparities[inside])
        visible[row, inside] = nearest[place + 1] <= disparities[inside] + 1
    return visible


def moving_windows(pair, rows, columns, pan, frames, noise, seed=0):
    """Yield (left, right, truth, visible) of a window that pans, with fresh noise each time."""
    random = np.random.default_rng(seed)
    for frame in range(frames):
        window = np.s_[:rows, pan * frame:pan * frame + columns]
        images = noisy([image[window] for image in pair[:2]], noise, random)
        truth = pair.truth[window]
        inside = np.arange(columns) - np.nan_to_num(truth) >= 0
        yield *images, truth, pair.visible[window] & inside


def read_grey(path):
    """Return a grey image, or skip the test where it is not here."""
    return _read(path, cv2.IMREAD_GRAYSCALE)


def _of_folder(folder, disparities, scale, mask):
    return RealPair(
        _read(folder / 'left.png', cv2.IMREAD_COLOR), _read(folder / 'right.png',
                                                            cv2.IMREAD_COLOR),
        _truth(folder / 'groundtruth.png', scale),
        _read(folder / mask, cv2.IMREAD_GRAYSCALE) == 255, disparities)


def _truth(path, scale):
    values = _read(path, cv2.IMREAD_ANYDEPTH).astype(np.float32)
    return np.where(values > 0, values / scale, np.nan).astype(np.float32)


def _read(path, how):
    if not path.exists():
        pytest.skip(f'{path} does not exist: the benchmark data is not here')
    return cv2.imread(str(path), how)
