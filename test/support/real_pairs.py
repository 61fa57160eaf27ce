# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Real pairs with ground truth: where they are found, and windows that move over them."""
from typing import NamedTuple

from bench.datasets import available_scenes, MIDDLEBURY_FOLDERS, read_motorcycle
import cv2
from fuzzy_stereo_ros.pairs.stereo_pair import SIDES
from fuzzy_stereo_ros.synthetic.scenes import ScenePair
from made_scenes import noisy
import numpy as np
import pytest
from repository import ROOT

DATA = ROOT.parent / 'shared' / 'data'
MIDDLEBURY = tuple(MIDDLEBURY_FOLDERS['middv2'])


class RealPair(NamedTuple):
    """Images, truth in pixels (NaN = unknown), which pixels count, and disparities to search."""

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray
    visible: np.ndarray
    disparities: int


def motorcycle():
    """Return scikit-image's pair, or skip the test where scikit-image is not installed."""
    pytest.importorskip('skimage.data', reason='scikit-image is not installed')
    return _of_bench(read_motorcycle(), 64)


def middlebury(name):
    """Return one of the four pairs of the paper's Table I."""
    return _of_folder(f'middv2/{name}')


def third_size(name, rows, columns):
    """Return the upper left of a pair of 2006."""
    pair = _of_folder(f'midd2006_third/{name}')
    return RealPair(*(np.ascontiguousarray(image[:rows, :columns]) for image in pair[:4]), 80)


def moving_windows(pair, rows, columns, pan, frames, noise, seed=0):
    """Yield a `ScenePair` for each place of a window that pans, with fresh noise each time."""
    random = np.random.default_rng(seed)
    for frame in range(frames):
        window = np.s_[:rows, pan * frame:pan * frame + columns]
        images = noisy([image[window] for image in pair[:2]], noise, random)
        truth = pair.truth[window]
        inside = np.arange(columns) - np.nan_to_num(truth) >= 0
        yield ScenePair(*images, truth, pair.visible[window] & inside)


def grey_pair(place):
    """Return two grey images below DATA, {} for left and right, or skip the test without them."""
    paths = [DATA / place.format(side) for side in SIDES]
    _needed(paths[0])
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths]


def _of_folder(path):
    _needed(DATA / path)
    (scene,), _ = available_scenes(DATA, path)
    return _of_bench(scene.read(), scene.disparities)


def _of_bench(pair, disparities):
    return RealPair(pair.left, pair.right, pair.truth, pair.counts, disparities)


def _needed(path):
    if not path.exists():
        pytest.skip(f'{path} does not exist: the benchmark data is not here')
