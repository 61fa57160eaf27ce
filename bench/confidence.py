# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a confidence is worth: errors left, and pixels kept, where the least sure ones are dropped.

The presets of confidence_threshold are measured on pairs without a truth as well, which cheap
cameras have taken.
"""
from typing import NamedTuple

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


class Sparsification(NamedTuple):
    """
    Errors that remain while the pixels of least confidence are removed first.

    area: under the sparsification curve: the mean percentage of wrong pixels among those kept,
    over all shares kept. at_80: percentage wrong of the 80 percent most confident. at_100: of all.
    """

    area: float
    at_80: float
    at_100: float


def sparsification(wrong, sureness):
    """
    Return the `Sparsification` of pixels; pixels of equal confidence count in proportion.

    wrong: bool (N,). sureness: float (N,), a confidence: higher is surer, NaN is the lowest.
    """
    if not wrong.size:
        return Sparsification(*(float('nan'),) * 3)
    ranks = np.where(np.isnan(sureness), -np.inf, sureness)
    levels, level_of = np.unique(-ranks, return_inverse=True)
    kept = np.cumsum(np.bincount(level_of, minlength=levels.size))
    found = np.cumsum(np.bincount(level_of, weights=wrong, minlength=levels.size))
    share = np.arange(1, wrong.size + 1)
    curve = 100 * np.interp(share, np.r_[0, kept], np.r_[0, found]) / share
    return Sparsification(float(curve.mean()), float(curve[int(0.8 * wrong.size) - 1]),
                          float(curve[-1]))


def left_right_sureness(left_map, right_map):
    """
    Return minus the left-right difference of two maps: float (R, C), NaN without a match.

    left_map: float (R, C), pixels, of the left image. right_map: of the right image.
    """
    rows, columns = np.indices(left_map.shape)
    place = columns - left_map
    inside = np.isfinite(place) & (place >= -0.5) & (place < left_map.shape[1] - 0.5)
    met = np.full(left_map.shape, np.nan)
    met[inside] = right_map[rows[inside], np.rint(place[inside]).astype(np.intp)]
    return -abs(left_map - met)


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


def table_with_truth(figures):
    """Return the table of the presets; figures: a DataFrame of `kept_and_wrong`, with groups."""
    means = [means_over_draws(figures, ['group'], [heading(preset, figure)], worst)
             for preset in PRESETS for figure, worst in ((KEPT, 'min'), (WRONG, 'max'))]
    return Table.of(
        'Presets of confidence_threshold: percent of the pixels kept, and wrong of these',
        pd.concat(means, axis=1),
        'Of all pixels with truth, also of those that one camera sees; profile realtime, cold.')


def table_without_truth(rows):
    """Return the table of what the presets keep; rows: of `kept_of`."""
    return Table.of(
        'Presets of confidence_threshold: percent of the pixels kept, pairs without a truth',
        pd.DataFrame(rows).set_index('scene'),
        'Of all pixels, also of those that the right camera does not see.')
