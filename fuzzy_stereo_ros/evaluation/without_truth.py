# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measure matchers on pairs without ground truth.

Density, time, and whether the map of the left image agrees with that of the right one, which the
matcher finds in the mirrored pair; over frames flicker, of ours the confidence and the row offset.
A map that agrees with itself may still be wrong.
"""
from dataclasses import dataclass, field
from itertools import tee

import cv2
from fuzzy_stereo_ros.evaluation.ground_truth import (
    at_matches, GroundTruthPair, MIDDLEBURY, TOLERANCE)
from fuzzy_stereo_ros.evaluation.matchers import COLD, Task
from fuzzy_stereo_ros.evaluation.measuring import matched
from fuzzy_stereo_ros.evaluation.page import (
    data_uri, disparity_bar, disparity_picture, left_picture, reduced, ShownPair, View)
from fuzzy_stereo_ros.evaluation.report import mean, Table
from fuzzy_stereo_ros.evaluation.scores import flicker
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

SHOWN = 99.5        # percentile of all disparities that are seen, at the end of the colours
HEADINGS = ('', 'start', 'density [%]', 'agree with the right image [%]', 'confidence',
            'flicker [%]', 'time [ms]')
NOTE = ('*agree*: of the pixels with a disparity whose match in the right image has one, too, '
        'those that have the same one within 1 px. *flicker*: '
        'pixels that change by more than 1 px from a frame to the next one; where the camera or '
        'things move that is no error. None of these tells whether a disparity is right.')


@dataclass
class PairsWithoutTruth:
    """
    What was measured of pairs without truth.

    rows: of the table, by HEADINGS. misalignment: of the rows of the pairs, None = unknown.
    hints: sentences on what is suspicious, also of the calibration. pairs: [`ShownPair`], for the
    page.
    """

    rows: list = field(default_factory=list)
    misalignment: object = None
    hints: list = field(default_factory=list)
    pairs: list = field(default_factory=list)


def tables_of(measured):
    """Return Tables of {name: PairsWithoutTruth}: the means, and, of more than one, each."""
    means = {}
    for own in measured.values():
        for *who, figures in ((*row[:2], row[2:]) for row in own.rows):
            means.setdefault(tuple(who), []).append(figures)
    rows = [(*who, *map(mean, zip(*every))) for who, every in means.items()]
    title = 'Without ground truth'
    if len(measured) == 1:
        return [Table(title, HEADINGS, rows, NOTE)]
    return [Table(f'{title}, mean of {len(measured)} scenes', HEADINGS, rows, NOTE),
            Table('Each scene', ('', 'matcher', *HEADINGS[1:]), [
                (name, *row) for name, own in measured.items() for row in own.rows])]


def measure_without_truth(pairs, matchers, disparities, repeats=1, name=''):
    """
    Return the PairsWithoutTruth of matchers on pairs.

    pairs: a function that returns an iterator over StereoPairs of one size. matchers, disparities,
    repeats: as for `measuring.measure`. name: of all pairs; they also have numbers, unless there
    is one. Raises ValueError for a pair that cannot be matched.
    """
    first = next(pairs())
    task, shown = Task(MIDDLEBURY, disparities, first.left.shape[:2], repeats), {}
    found = PairsWithoutTruth(hints=list(first.calibration.remarks))
    for matcher in matchers:
        for start in matcher.starts:
            figures, last, maps = _figures(pairs(), matcher, start, task)
            single = len(maps) == 1
            if single and start not in matcher.starts[:1]:
                continue
            found.rows.append((matcher.name, start or COLD, *map(mean, zip(*figures))))
            shown[matcher.name] = maps
            if last.finding is not None and last.finding.sentence not in found.hints:
                found.hints.append(last.finding.sentence)
            found.misalignment = found.misalignment or last.misalignment
    seen = np.concatenate([one[np.isfinite(one)] for maps in shown.values() for one, _ in maps])
    ends = np.percentile(seen, (100 - SHOWN, SHOWN)) if seen.size else (0, 1)
    for number, pair in enumerate(pairs()):
        views, bars = [View('left image', [], [left_picture(pair)])], [disparity_bar(*ends)]
        for matcher, maps in shown.items():
            disparity, confidence = maps[number]
            uris = [disparity_picture(matcher, disparity, ends)]
            if confidence is not None:
                bars[1:] = [('confidence', 'viridis', '0', '1')]
                uris.append((f'confidence by {matcher}', data_uri(cv2.applyColorMap(
                    cv2.convertScaleAbs(confidence, alpha=255), cv2.COLORMAP_VIRIDIS))))
            views.append(View(matcher, [], uris))
        found.pairs.append(ShownPair(
            ' '.join(filter(None, (name, f'pair {number}' * (not single)))),
            f'{width_by_height(pair.left)}, {disparities} disparities', views, bars))
    return found


def _figures(pairs, matcher, start, task):
    """
    Return the figures of each pair in the order of HEADINGS, None = unknown; the last Maps; maps.

    These are (disparity, confidence or None) of each pair, reduced.
    """
    figures, shown = [], []
    straight, mirrored = tee((f'pair {number}', pair) for number, pair in enumerate(pairs))
    mirrored = ((name, GroundTruthPair(*(np.ascontiguousarray(image[:, ::-1]) for image in (
        pair.right, pair.left)), None)) for name, pair in mirrored)
    for (_, maps, before), (_, other, _) in zip(*(
            matched(frames, matcher, start, task) for frames in (straight, mirrored))):
        valid = np.isfinite(maps.raw)
        apart = np.abs(maps.raw - at_matches(maps.raw, other.raw[:, ::-1]))
        known, confidence = np.isfinite(apart), maps.confidence
        figures.append((
            100 * float(valid.mean()),
            100 * float(np.mean(apart[known] <= TOLERANCE)) if known.any() else None,
            float(confidence[valid].mean()) if confidence is not None and valid.any() else None,
            None if before is None else flicker(before.raw, maps.raw), maps.milliseconds))
        shown.append((reduced(maps.raw), None if confidence is None else reduced(confidence)))
    return figures, maps, shown
