# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Folders whose files say what they are: left, right, groundtruth; one pair or numbered frames.

| one pair | numbered in one folder | numbered in folders | |
|---|---|---|---|
| left.png, right.png | left_07.png, right_07.png | left/0007.png, right/0007.png | |
| groundtruth.png | groundtruth_07.png | groundtruth/0007.png | or truth; also .pfm, .npy, .npz |
| disp_occ.png | disp_occ_07.png | disp_occ/0007.png | KITTI; also disp_occ_0 |
| disp_noc.png | disp_noc_07.png | disp_noc/0007.png | KITTI; also disp_noc_0 |
| nonocc.png, all.png, disc.png | nonocc_07.png | nonocc/0007.png | or visible; 255 counts |
"""
import re

from fuzzy_stereo_ros.evaluation.found import FoundScene, FoundSequence
from fuzzy_stereo_ros.evaluation.grey_scales import scale_of
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI, MIDDLEBURY, NUMBERS, WHOLE_PIXEL_TRUTH
from fuzzy_stereo_ros.evaluation.pair_files import (
    complete, first_of, masks_of, PairFiles, picture_of, PICTURES, told_disparities)

LAYOUT, FRAMES = 'left, right and groundtruth', 'numbered frames'
EVERY, VISIBLE = ('disp_occ', 'disp_occ_0'), ('disp_noc', 'disp_noc_0')     # KITTI's
TRUTHS = 'groundtruth', 'truth'
NUMBERED = re.compile(r'(.*?)(\d+)')


def find_pair(folder, truth_scale=None):
    """Return the scene of a folder with one pair, as a list; None if it has none."""
    left, right, truth = (_file_of(folder, str, kind) for kind in ('left', 'right', 'truth'))
    wanted = [folder / name for name in ('left.png', 'right.png', f'{TRUTHS[0]}.png')]
    if not complete(LAYOUT, left, right, truth, wanted):
        return None
    told = told_disparities(folder)
    scale = scale_of(folder, left, truth_scale)
    return [FoundScene(folder, LAYOUT, *(told if told[0] else scale[1:]),
                       files=_files(folder, str, scale.levels))]


def find_frames(folder, truth_scale=None):
    """
    Return the sequence of a folder, and each of its frames that has a truth; None if it is none.

    Raises ValueError where a frame has a left image and no right one.
    """
    frames = {number: _files(folder, named, truth_scale)
              for number, named in _numbered(folder).items()}
    if not frames:
        return None
    told = told_disparities(folder)
    found = [FoundScene(folder / number, FRAMES, *told, files=files)
             for number, files in frames.items() if files.truth is not None]
    if len(frames) > 1:
        found.append(FoundSequence(folder, FRAMES, *told, frames=frames))
    return found or None


def _numbered(folder):
    """
    Return {number: named} of the frames of a folder in their order.

    named(kind) is the name, without suffix, of a frame's file of a kind: left, nonocc, ...
    """
    if (folder / 'left').is_dir() and (folder / 'right').is_dir():
        return {stem: lambda kind, stem=stem: f'{kind}/{stem}'
                for stem in _in_order(path.stem for path in (folder / 'left').iterdir()
                                      if path.suffix.lower() in PICTURES)}
    numbers = _in_order(path.stem.removeprefix('left_') for path in folder.glob('left_*')
                        if path.suffix.lower() in PICTURES)
    return {number: lambda kind, number=number: f'{kind}_{number}'
            for number in numbers if number.isdecimal()}


def _in_order(stems):
    """Return the names that end with a number, in the order of their numbers."""
    found = [match for match in map(NUMBERED.fullmatch, stems) if match]
    return [match[0] for match in sorted(found, key=lambda match: (match[1], int(match[2])))]


def _file_of(folder, named, kind):
    """Return the path of the left or right image, the truth or the visible truth, or None."""
    if kind in ('left', 'right'):
        return picture_of(folder, named(kind))
    if kind == 'visible':
        return first_of(folder, (f'{named(name)}.png' for name in VISIBLE))
    return first_of(folder, [
        *(named(name) + suffix for name in TRUTHS for suffix in ('.png', *NUMBERS)),
        *(f'{named(name)}.png' for name in EVERY + VISIBLE)])


def _files(folder, named, levels):
    """Return the `PairFiles` of one pair; levels: grey levels per pixel of an 8-bit truth."""
    left, right, truth, visible = (_file_of(folder, named, kind)
                                   for kind in ('left', 'right', 'truth', 'visible'))
    if right is None:
        raise ValueError(f'{folder / named("right")}{left.suffix} is missing; {left} has no '
                         'right image')
    kitti = truth in [folder / f'{named(name)}.png' for name in EVERY + VISIBLE]
    return PairFiles(left, right, KITTI if kitti else MIDDLEBURY, truth,
                     None if kitti else levels, visible_truth=visible if kitti else None,
                     masks=masks_of(folder, named),
                     whole_pixel=folder.resolve().name.lower() in WHOLE_PIXEL_TRUTH)
