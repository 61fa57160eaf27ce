# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small pairs, and what the kernels and the twins see of them."""
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import SIDE
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift
from fuzzy_stereo_ros.matching.realtime.possibility import (
    CensusPicture, CensusPossibility, extra_columns, FULL_SIZE)
import numpy as np
import reference_census as twins


def small_pair(rows, columns, disparity=3, seed=0, channels=0, dtype=np.uint8):
    """
    Return a left and a right image of coarse blocks and a little noise, shifted by a disparity.

    channels: 0 for (R, C), else (R, C, channels); blocks make ties, noise makes texture.
    """
    random = np.random.default_rng([seed, rows, columns])
    top = np.iinfo(dtype).max
    size = (rows, columns) + (channels,) * (channels > 0)
    blocks = random.integers(0, top - top // 16, (rows // 3 + 1, columns // 4 + 1, *size[2:]))
    scene = blocks.repeat(3, axis=0).repeat(4, axis=1)[:rows, :columns]
    left = scene + random.integers(0, top // 16, size)
    right = np.roll(scene, -disparity, axis=1) + random.integers(0, top // 16, size)
    return left.astype(dtype), right.astype(dtype)


def seen(left, right, disparities, min_disparity=0, model=FULL_SIZE):
    """Return the possibility of a pair, as the search makes it."""
    possibility = CensusPossibility(
        *left.shape[:2], disparities, model,
        (min_disparity, min_disparity + left.shape[1] - 1),
        extra_columns(min_disparity, disparities))
    places = luminance_shift(left, right)
    possibility.left.read(left, 0, places, 0, possibility.rows)
    read_moved(possibility.right, right, min_disparity, places)
    possibility.describe(0, possibility.rows)
    return possibility


def read_moved(view, right, min_disparity, places):
    """Let the view of the target read the right image, moved, as the search does."""
    if min_disparity >= 0:
        view.read(right, min_disparity, places, 0, view.rows)
        return
    narrow = CensusPicture(*right.shape[:2], True, 0)
    narrow.read(right, 0, places, 0, view.rows)
    view.spread(narrow, -min_disparity, 0, view.rows)


def twin_costs(left, right, labels, min_disparity=0, model=FULL_SIZE):
    """Return the cost of each label of a pair as tiles have it, without priors: (R, C, labels)."""
    places = luminance_shift(left, right)
    fine = (twins.luminance(left, 0, places), twins.luminance(
        right, min_disparity, places, extra_columns(min_disparity, labels)))
    features = [(twins.census(view), twins.gradient(twins.eight_bits(view))) for view in fine]
    if not model.box:
        return twins.match_costs(*features, labels, model)
    return twins.box_costs(
        twins.match_costs(*features, labels + SIDE, model), labels, model.box, SIDE)


def padded(luminance):
    """Return luminance with the margin and the slack of a view: uint16."""
    around = np.pad(luminance, MARGIN, 'edge')
    return np.pad(around, ((0, 0), (0, SLACK)), 'edge').astype(np.uint16)


def random_map(shape, limit, seed=0, dtype=np.uint8):
    """Return random whole numbers below a limit."""
    return np.random.default_rng([seed, *shape]).integers(0, limit, shape).astype(dtype)
