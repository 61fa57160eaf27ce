# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes and sequences below folders, each recognised by what its folder holds."""
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.found import FoundScene, FoundSequence, with_names
from fuzzy_stereo_ros.evaluation.kitti import find_kitti
from fuzzy_stereo_ros.evaluation.middlebury import find_floating, find_grey
from fuzzy_stereo_ros.evaluation.named_files import find_frames, find_pair
from fuzzy_stereo_ros.evaluation.pair_files import NoTruth

# Sets of 2001 hold an im0 and an im1 too, beside the pair that has a truth: grey ones go first.
FINDERS = find_grey, find_floating, find_kitti, find_pair, find_frames
KNOWN = (
    'Middlebury v2 (im2.png, im6.png, disp2.png; view1.png, view5.png, disp1.png), '
    'Middlebury 2014 (im0.png, im1.png, disp0GT.pfm or disp0.pfm, calib.txt, mask0nocc.png), '
    'KITTI 2012 (folders image_0, image_1 or colored_0, colored_1, disp_occ, disp_noc), '
    'KITTI 2015 (folders image_2, image_3, disp_occ_0, disp_noc_0), '
    'left.png, right.png with groundtruth.png, .pfm, .npy or .npz or disp_occ.png, '
    'and numbered frames (left_07.png, right_07.png; left/0007.png, right/0007.png)')


class Search(NamedTuple):
    """What a search found: named scenes and sequences, and sentences about what is left out."""

    scenes: list
    sequences: list
    skipped: list


def search(folders, truth_scale=None, only=''):
    """
    Return the `Search` below some folders (paths).

    truth_scale: grey levels per pixel of 8-bit truths that nothing else tells it of.
    only: a word that names must contain.
    Raises ValueError where a folder is not there, a scene is not whole, nothing is found, or the
    scale of a truth is not known.
    """
    found, skipped = [], []
    for folder in folders:
        if not folder.is_dir():
            raise ValueError(f'there is no folder {folder}')
        below, without_truth = _below(folder, truth_scale, set())
        if not below:
            raise ValueError(without_truth[0] if without_truth else
                             f'nothing below {folder} is a scene; known are {KNOWN}')
        found += below
        skipped += without_truth
    different = {(type(each), each.place.resolve()): each for each in found}
    named = [each for each in with_names(list(different.values())) if only in each.name]
    if not named:
        raise ValueError(f"no scene is called like '{only}'; there are "
                         f'{", ".join(dict.fromkeys(_names(different.values())))}')
    scenes = [each for each in named if isinstance(each, FoundScene)]
    for scene in scenes:
        scene.files.check_scale()
    return Search(scenes,
                  [each for each in named if isinstance(each, FoundSequence)], skipped)


def _names(found):
    return [each.name for each in with_names(list(found))]


def _below(folder, truth_scale, seen):
    """Return what is found in a folder, or below it where it is no scene itself, and sentences."""
    if folder.resolve() in seen:        # a link that leads back
        return [], []
    seen.add(folder.resolve())
    try:
        for find in FINDERS:
            found = find(folder, truth_scale)
            if found:
                return found, []
    except NoTruth as without:
        return [], [str(without)]
    found, skipped = [], []
    for inner in sorted(folder.iterdir()):
        if inner.is_dir() and not inner.name.startswith('.'):
            below, without_truth = _below(inner, truth_scale, seen)
            found += below
            skipped += without_truth
    return found, skipped
