# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""KITTI's data sets of 2012 and 2015 in their official structure: a folder for each kind."""
import re

from fuzzy_stereo_ros.evaluation.found import FoundScene, FoundSequence
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI
from fuzzy_stereo_ros.evaluation.pair_files import NoTruth, PairFiles

# layout: pairs of folders of images, truth of all pixels and of those that both cameras see
SETS = {
    'KITTI 2015': ([('image_2', 'image_3')], 'disp_occ_0', 'disp_noc_0'),
    'KITTI 2012': ([('image_0', 'image_1'), ('colored_0', 'colored_1')], 'disp_occ', 'disp_noc'),
}
FRAME = re.compile(r'(.+)_(\d+)\.png')


def find_kitti(folder, truth_scale=None):
    """Return the scenes and sequences of a folder with KITTI's structure; None if it has not."""
    found = []
    for layout, (image_folders, *truths) in SETS.items():
        sides = next((pair for pair in image_folders if _has_any(folder, pair)), None)
        known = [folder / name for name in truths if (folder / name).is_dir()]
        if sides is None or not known and not _has_all(folder, sides):
            continue
        if not known:
            raise NoTruth(f'{folder} has images but no ground truth: there is no {truths[0]} and '
                          f'no {truths[1]}')
        for name in sides:
            if not (folder / name).is_dir():
                raise ValueError(f'{folder / name} is missing; {layout} has '
                                 f'{", ".join((*sides, *truths))}')
        found += _scenes(folder, layout, sides, truths)
    return found or None


def _has_any(folder, names):
    return any((folder / name).is_dir() for name in names)


def _has_all(folder, names):
    return all((folder / name).is_dir() for name in names)


def _scenes(folder, layout, sides, truths):
    """Return the scene of each file of truth, and what leads up to it as a sequence."""
    found = []
    names = sorted({file.name for kind in truths for file in (folder / kind).glob('*.png')})
    for name in filter(FRAME.fullmatch, names):
        start, number = FRAME.fullmatch(name).groups()
        every, visible = ((path if path.is_file() else None)
                          for path in (folder / kind / name for kind in truths))
        files = _pair(folder, sides, name, truth=every or visible, visible_truth=visible)
        found.append(FoundScene(folder / f'{start}_{number}', layout, files=files))
        before = {
            other[2]: _pair(folder, sides, other[0])
            for other in map(FRAME.fullmatch, sorted(
                file.name for file in (folder / sides[0]).glob(f'{start}_*.png')))
            if other and other[1] == start and int(other[2]) < int(number)}
        if before:
            found.append(FoundSequence(folder / start, layout, frames={**before, number: files}))
    return found


def _pair(folder, sides, name, **truth):
    left, right = (folder / side / name for side in sides)
    for path in (left, right):
        if not path.is_file():
            raise ValueError(f'{path} is missing')
    return PairFiles(left, right, KITTI, **truth)
