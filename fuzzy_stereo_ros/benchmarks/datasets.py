# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scenes with ground truth: folders of the data directory, and what every machine can make.

The truth belongs to the left image; the matching pixel of the right image is x - d.
"""
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
import os
from pathlib import Path

from fuzzy_stereo_ros.evaluation.grey_scales import MIDDLEBURY_FOLDERS
from fuzzy_stereo_ros.evaluation.ground_truth import (
    KITTI, KnownPair, LIMITS, MIDDLEBURY, read_mask, read_truth, WHOLE_PIXEL_TRUTH)
from fuzzy_stereo_ros.evaluation.visibility import cross_checked, seen_by_both, warped_to_right
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_pair
from fuzzy_stereo_ros.synthetic.scenes import made_pair
import numpy as np

DATA_VARIABLE = 'FUZZY_STEREO_DATA'
USUAL_DATA = Path('../shared/data')

# folder: (suffix of the images' names, truth of all pixels, disparities)
KITTI_FOLDERS = {
    'kitti2015/000000': ('', 'disp_occ_0.png', 66),
    'kitti2012_color/000000': ('', 'disp_occ.png', 71),
    'kitti2012_seq/000027': ('_10', 'disp_occ_10.png', 96),
    'kitti2012_seq/000138': ('_10', 'disp_occ_10.png', 73),
}
MOTORCYCLE = 'midd2014/Motorcycle'
MOTORCYCLE_DISPARITIES = 64
MADE_SCENES = 4
MADE_SIZE = 240, 320, 48      # rows, columns, disparities
QUICK_SCENES, QUICK_SIZE = 2, (48, 80, 16)


@dataclass(frozen=True)
class Scene:
    """
    A scene of a group; `read()` returns its `KnownPair`.

    family: whose settings the rivals take. disparities: searched, from 0. limit: pixels, an
    error above it is bad.
    """

    group: str
    name: str
    family: str
    disparities: int
    read: Callable

    @property
    def limit(self):
        """Errors above so many pixels are bad."""
        return LIMITS[self.family]

    @property
    def path(self):
        """Group and name, as they are written in tables."""
        return f'{self.group}/{self.name}'


def data_folder(given=None):
    """
    Return the folder of benchmark data, or None where there is none.

    given: a path, which must exist; None takes the environment's FUZZY_STEREO_DATA, then
    ../shared/data. Raises ValueError where a folder that was named is not there.
    """
    named = given if given is not None else os.environ.get(DATA_VARIABLE)
    if named is None:
        return USUAL_DATA if USUAL_DATA.is_dir() else None
    if not Path(named).is_dir():
        raise ValueError(f'there is no folder {named}; give the folder that holds '
                         f'{", ".join(MIDDLEBURY_FOLDERS)} and the like')
    return Path(named)


def available_scenes(data, only='', quick=False):
    """
    Return the scenes that can be read here, and a sentence for each group that cannot.

    data: Path or None. only: scenes whose group/name contains this word. quick: small made scenes
    alone. Raises ValueError where no scene is left.
    """
    scenes, missing = [], {}
    listed = _made_scenes(QUICK_SCENES, QUICK_SIZE) if quick else (
        *_folder_scenes(data), _motorcycle(data), *_made_scenes(MADE_SCENES, MADE_SIZE))
    for scene, reason in listed:
        if only not in scene.path:
            continue
        if reason is None:
            scenes.append(scene)
        else:
            missing.setdefault(f'{reason}: {scene.group}', []).append(scene.name)
    skipped = [f'{start} ({", ".join(names)})' for start, names in missing.items()]
    if not scenes:
        raise ValueError(f"no scene here is called like '{only}'; there are groups "
                         f'{", ".join(MIDDLEBURY_FOLDERS)}, kitti, midd2014 and made'
                         + (f' ({"; ".join(skipped)})' if skipped else ''))
    return scenes, skipped


def _folder_scenes(data):
    """Return each scene that has a folder of its own, and why it cannot be read or None."""
    listed = [(group, name, MIDDLEBURY, disparities, f'{group}/{name}',
               partial(read_middlebury, scale=scale))
              for group, named in MIDDLEBURY_FOLDERS.items()
              for name, (scale, disparities) in named.items()]
    listed += [('kitti', folder, KITTI, disparities, folder,
                partial(_read_kitti, suffix=suffix, truth=truth))
               for folder, (suffix, truth, disparities) in KITTI_FOLDERS.items()]
    return [(Scene(group, name, family, disparities, partial(read, Path(data or '', folder))),
             None if _is_there(data, folder) else 'no folder')
            for group, name, family, disparities, folder, read in listed]


def _is_there(data, folder):
    return data is not None and (data / folder).is_dir()


def read_middlebury(folder, scale):
    """
    Return the `KnownPair` of a folder with left, right, groundtruth and a mask of nonocc pixels.

    scale: grey levels per pixel of disparity. Raises ValueError where a file is missing.
    """
    left, right = read_pair(folder / 'left.png', folder / 'right.png')
    official = folder / 'nonocc.png'
    mask = read_mask(official if official.exists() else folder / 'nonocc_derived.png')
    return KnownPair(left, right, read_truth(folder / 'groundtruth.png', scale), mask,
                     folder.name in WHOLE_PIXEL_TRUTH)


def read_middlebury_from_right(folder, scale):
    """
    Return the `KnownPair` of a Middlebury folder for matching from the right image.

    left and right stay as they are; truth and counts belong to the right image. Without a
    groundtruth_right the left truth is carried over, and what no left pixel meets is unknown.
    """
    known = read_middlebury(folder, scale)
    own = folder / 'groundtruth_right.png'
    truth = read_truth(own, scale) if own.exists() else warped_to_right(known.truth)
    return KnownPair(known.left, known.right, truth, cross_checked(truth, known.truth),
                     known.whole_pixel)


def _read_kitti(folder, suffix, truth):
    left, right = read_pair(folder / f'left{suffix}.png', folder / f'right{suffix}.png')
    return KnownPair(left, right, read_disparity(folder / truth))


def _motorcycle(data):
    """Return the Motorcycle pair, from its folder or from scikit-image, and why not or None."""
    scene = Scene(*MOTORCYCLE.split('/'), MIDDLEBURY, MOTORCYCLE_DISPARITIES,
                  partial(_read_motorcycle, data))
    there = _is_there(data, MOTORCYCLE) or find_spec('skimage') is not None
    return scene, None if there else 'neither folder nor scikit-image'


def _read_motorcycle(data):
    if _is_there(data, MOTORCYCLE):
        folder = data / MOTORCYCLE
        left, right = read_pair(folder / 'left.png', folder / 'right.png')
        truth = read_disparity(folder / 'groundtruth.npz')
    else:
        from skimage.data import stereo_motorcycle  # takes a second: only where it is read

        left, right, truth = stereo_motorcycle()
        left, right = (np.ascontiguousarray(image[:, :, ::-1]) for image in (left, right))
        truth = np.where(np.isfinite(truth), truth, np.nan).astype(np.float32)
    return KnownPair(left, right, truth, seen_by_both(truth))


def _made_scenes(count, size):
    return [(Scene('made', f'planes{seed}', MIDDLEBURY, size[2], partial(_read_made, seed, size)),
             None) for seed in range(1, count + 1)]


def _read_made(seed, size):
    made = made_pair(*size, seed, objects=6, noise=1.5, colour=True)
    return KnownPair(made.left, made.right, made.truth, made.visible)
