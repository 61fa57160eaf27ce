# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measure matchers on pairs without ground truth.

Density, time, and whether the map of the left image agrees with that of the right one, which the
matcher finds in the mirrored pair; over frames flicker, of ours the confidence and the row offset.
A map that agrees with itself may still be wrong.
"""
from dataclasses import dataclass, field

import cv2
from fuzzy_stereo_ros.evaluation.ground_truth import (
    at_matches, GroundTruthPair, MIDDLEBURY, TOLERANCE)
from fuzzy_stereo_ros.evaluation.matchers import COLD, Task
from fuzzy_stereo_ros.evaluation.page import data_uri, disparity_bar, reduced, ShownPair, View
from fuzzy_stereo_ros.evaluation.report import mean, Table
from fuzzy_stereo_ros.evaluation.scores import flicker
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
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
class Own:
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
    """Return the Tables of {name: Own}: of the means, and, of more than one, of each."""
    of_each = [((name, *row[:2]), row[2:]) for name, own in measured.items() for row in own.rows]
    means = {}
    for (_, *who), row in of_each:
        means.setdefault(tuple(who), []).append(row)
    rows = [(*who, *(_known([one for one in column if one is not None]) for column in zip(*every)))
            for who, every in means.items()]
    title = 'Without ground truth'
    if len(measured) == 1:
        return [Table(title, HEADINGS, rows, NOTE)]
    return [Table(f'{title}, mean of {len(measured)} scenes', HEADINGS, rows, NOTE),
            Table('Each scene', ('', 'matcher', *HEADINGS[1:]), [
                (*who, *row) for who, row in of_each])]


def measure_without_truth(pairs, matchers, disparities, repeats=1, name=''):
    """
    Return the Own of matchers on pairs.

    pairs: a function that returns an iterator over StereoPairs of one size. matchers, disparities,
    repeats: as for `measuring.measure`. name: of all pairs; they also have numbers, unless there
    is one. Raises ValueError for a pair that cannot be matched.
    """
    first = next(pairs())
    task, maps = Task(MIDDLEBURY, disparities, first.left.shape[:2], repeats), {}
    found = Own(hints=list(first.calibration.remarks))
    for matcher in matchers:
        for start in matcher.starts:
            figures, last, shown = _figures(pairs(), matcher, start, task)
            single = len(figures['time']) == 1
            if single and start not in matcher.starts[:1]:
                continue
            found.rows.append((
                matcher.name, start or COLD, *(_known(figures[name]) for name in (
                    'density', 'agree', 'confidence', 'flicker', 'time'))))
            maps[matcher.name] = shown
            if last.finding is not None and last.finding.sentence not in found.hints:
                found.hints.append(last.finding.sentence)
            found.misalignment = found.misalignment or last.misalignment
    seen = np.concatenate([one[np.isfinite(one)] for every in maps.values() for one, _ in every])
    low, high = np.percentile(seen, (100 - SHOWN, SHOWN)) if seen.size else (0, 1)
    for number, pair in enumerate(pairs()):
        views, sure = [View('left image', [], [
            ('left image', data_uri(in_eight_bits(pair.left), cv2.INTER_AREA))])], False
        for matcher, every in maps.items():
            disparity, confidence = every[number]
            uris = [(f'disparity by {matcher}', data_uri(colour_disparity(disparity, low, high)))]
            if confidence is not False:
                sure = True
                uris.append((f'confidence by {matcher}', data_uri(cv2.applyColorMap(
                    cv2.convertScaleAbs(confidence, alpha=255), cv2.COLORMAP_VIRIDIS))))
            views.append(View(matcher, [], uris))
        found.pairs.append(ShownPair(
            ' '.join(filter(None, (name, f'pair {number}' * (not single)))),
            f'{width_by_height(pair.left)}, {disparities} disparities', views,
            [disparity_bar(low, high), *[('confidence', 'viridis', '0', '1')] * sure]))
    return found


def _figures(pairs, matcher, start, task):
    """
    Return {name of a figure: a value for each pair}, the last Maps, and what is shown.

    That is [(disparity, confidence or False)] of all pairs, reduced.
    """
    match, other = (matcher.begin(task, start) for _ in range(2))
    figures, last = {name: [] for name in ('density', 'agree', 'confidence', 'flicker',
                                           'time')}, None
    shown = []
    for number, pair in enumerate(pairs):
        if pair.left.shape[:2] != task.size:
            raise ValueError(f'pair {number} has another size than the first one; evaluate pairs '
                             'of one size')
        name = f'pair {number}'
        try:
            maps = match(name, GroundTruthPair(pair.left, pair.right, None))
            mirrored = other(name, GroundTruthPair(*(
                np.ascontiguousarray(image[:, ::-1]) for image in (pair.right, pair.left)), None))
        except ValueError as error:
            raise ValueError(f'{name}, {matcher.name}: {error}') from None
        valid = np.isfinite(maps.raw)
        figures['density'].append(100 * float(valid.mean()))
        if valid.any():
            apart = np.abs(maps.raw - at_matches(maps.raw, mirrored.raw[:, ::-1]))
            known = np.isfinite(apart)
            if known.any():
                figures['agree'].append(100 * float(np.mean(apart[known] <= TOLERANCE)))
            if maps.confidence is not None:
                figures['confidence'].append(float(maps.confidence[valid].mean()))
        if last is not None:
            figures['flicker'].append(flicker(last.raw, maps.raw))
        figures['time'].append(maps.milliseconds)
        shown.append((reduced(maps.raw), maps.confidence is not None and reduced(maps.confidence)))
        last = maps
    return figures, last, shown


def _known(values):
    """Return the mean of values, None of none."""
    return mean(values) if values else None
