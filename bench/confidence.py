# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a confidence is worth: how many pixels are right, and how many a preset keeps.

The presets of confidence_threshold are measured on pairs without a truth as well, which cheap
cameras have taken.
"""
from bench.datasets import EUROC, EUROC_DISPARITIES, read_frames
from bench.draws import means_over_draws
from fuzzy_stereo_ros.evaluation.catalogue import FRAMES_IN_FOLDERS, ONE_PAIR, Scene
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np
import pandas as pd

# The confidence_threshold of config/<name>.yaml.
PRESETS = {'costmap': 0.925, 'mapping': 0.8, 'inspection': 0.5}
KEPT, WRONG = 'kept', 'wrong'
BINS = 0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1     # of confidence
CONFIDENCES = [f'{low:g} to {high:g}' for low, high in zip(BINS, BINS[1:])]
# group, name, disparities, folder, layout of its files, number of the frame
WITHOUT_TRUTH = (
    *(('oakd_nogt', name, 96, f'oakd_nogt/{name}', ONE_PAIR, '')
      for name in ('desk', 'stairs', 'toy')),
    *((EUROC, number, EUROC_DISPARITIES, EUROC, FRAMES_IN_FOLDERS, number)
      for number in ('0000', '0010', '0020')))


def reliability(wrong, confidence):
    """
    Return the numbers of all and of correct pixels in each of the BINS: int64 (2, bins).

    wrong: bool (N,); confidence: float (N,), 0 to 1. Pixels of confidence 0 are invalid and in no
    bin.
    """
    valid = confidence > 0
    place = np.digitize(confidence[valid], BINS[1:-1])
    return np.array([np.bincount(place[chosen], minlength=len(BINS) - 1)
                     for chosen in (slice(None), ~wrong[valid])])


def wrong_and_confidence(match, known, scene):
    """Return which pixels with truth, occluded ones too, are wrong, and their confidence."""
    valid = np.isfinite(known.truth)
    error = abs(known.as_scored(match.disparity) - known.truth)[valid]
    return ~(error <= scene.limit), match.confidence[valid]


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


def table_with_truth(figures, noise):
    """Return the table of the presets; figures: a DataFrame of `kept_and_wrong`, with groups."""
    means = [means_over_draws(figures, ['group'], [heading(preset, figure)], worst)
             for preset in PRESETS for figure, worst in ((KEPT, 'min'), (WRONG, 'max'))]
    return Table.of(
        f'Presets of confidence_threshold: percent of pixels kept, and wrong, noise {noise:g}',
        pd.concat(means, axis=1),
        'Of all pixels with truth, also of those that one camera sees; wrong: of those kept.')
