# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The presets of confidence_threshold: the pixels that each keeps, and how many of these are wrong.

What is kept is counted on pairs without a truth as well, which cheap cameras have taken.
"""
from bench.datasets import EUROC, EUROC_DISPARITIES, read_frames
from fuzzy_stereo_ros.evaluation.catalogue import FRAMES_IN_FOLDERS, ONE_PAIR, Scene
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np
import pandas as pd

# The confidence_threshold of config/<name>.yaml.
PRESETS = {'costmap': 0.925, 'mapping': 0.8, 'inspection': 0.5}
KEPT, WRONG = 'kept', 'wrong'
# group, name, disparities, folder, layout of its files, number of the frame
WITHOUT_TRUTH = (
    *(('oakd_nogt', name, 96, f'oakd_nogt/{name}', ONE_PAIR, '')
      for name in ('desk', 'stairs', 'toy')),
    *((EUROC, number, EUROC_DISPARITIES, EUROC, FRAMES_IN_FOLDERS, number)
      for number in ('0000', '0010', '0020')))


def heading(preset, figure=KEPT):
    """Return the heading of a column: what a preset keeps, or what is wrong of it."""
    return f'{preset} ({PRESETS[preset]:g}), {figure}'


def kept_and_wrong(confidence, wrong):
    """
    Return the percent of pixels that each preset keeps, and wrong of these, by heading.

    confidence: float (N,); wrong: bool (N,). Of no pixels no share is wrong: None.
    """
    figures = {}
    for preset, threshold in PRESETS.items():
        kept = confidence >= threshold
        figures[heading(preset)] = 100 * float(kept.mean())
        figures[heading(preset, WRONG)] = 100 * float(wrong[kept].mean()) if kept.any() else None
    return figures


def pairs_without_truth(data, only=''):
    """
    Return the available `Scene`s without a truth, and sentences about the missing ones.

    data: Path or None; only: a word that group/name must contain
    """
    scenes, missing = [], []
    for *named, disparities, folder, layout, number in WITHOUT_TRUTH:
        scene = Scene(*named, MIDDLEBURY, disparities, lambda place=(folder, layout, [number]):
                      read_frames(data / place[0], *place[1:])[0])
        if only in scene.path and data is not None and (data / folder).is_dir():
            scenes.append(scene)
        elif only in scene.path:
            missing.append(f'no folder: {scene.path}')
    return scenes, missing


def kept_of(scene, ours):
    """Return {heading: percent of the pixels that a preset keeps} of a `Scene`, and its path."""
    pair = scene.read()
    confidence = ours.matcher(scene.disparities).match(pair.left, pair.right).confidence
    return {'scene': scene.path, **{heading(preset): 100 * float(np.mean(confidence >= threshold))
                                    for preset, threshold in PRESETS.items()}}


def table_with_truth(worth):
    """Return the table of the presets; worth: a DataFrame of `kept_and_wrong`, a row a group."""
    return Table.of(
        'Presets of confidence_threshold: percent of the pixels kept, and wrong of these',
        worth[[heading(preset, figure) for preset in PRESETS for figure in (KEPT, WRONG)]],
        'Of all pixels with truth, also of those that one camera sees; profile realtime, cold.')


def table_without_truth(rows):
    """Return the table of what the presets keep; rows: of `kept_of`."""
    return Table.of(
        'Presets of confidence_threshold: percent of the pixels kept, pairs without a truth',
        pd.DataFrame(rows).set_index('scene'),
        'Of all pixels, also of those that the right camera does not see.')
