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
from fuzzy_stereo_ros.evaluation.page import data_uri
from fuzzy_stereo_ros.evaluation.report import mean, Table
from fuzzy_stereo_ros.evaluation.scores import flicker
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
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
    hints: sentences on what is suspicious, also of the calibration. pictures: [(title, [(what,
    data URI)])], for the page.
    """

    rows: list = field(default_factory=list)
    misalignment: object = None
    hints: list = field(default_factory=list)
    pictures: list = field(default_factory=list)

    @property
    def table(self):
        """The Table of all matchers."""
        return Table('Without ground truth', HEADINGS, self.rows, NOTE)


def measure_without_truth(pairs, matchers, disparities, repeats=1):
    """
    Return the Own of matchers on pairs.

    pairs: a function that returns an iterator over StereoPairs of one size. matchers, disparities,
    repeats: as for `measuring.measure`. Raises ValueError for a pair that cannot be matched.
    """
    first = next(pairs())
    task, maps = Task(MIDDLEBURY, disparities, first.left.shape[:2], repeats), {}
    found = Own(hints=list(first.calibration.remarks))
    for matcher in matchers:
        for start in matcher.starts:
            figures, last = _figures(pairs(), matcher, start, task)
            single = len(figures['time']) == 1
            if single and start not in matcher.starts[:1]:
                continue
            found.rows.append((
                matcher.name, start or COLD, *(_known(figures[name]) for name in (
                    'density', 'agree', 'confidence', 'flicker', 'time'))))
            maps[matcher.name] = last
            if last.finding is not None and last.finding.sentence not in found.hints:
                found.hints.append(last.finding.sentence)
            found.misalignment = found.misalignment or last.misalignment
    seen = np.concatenate([one.raw[np.isfinite(one.raw)] for one in maps.values()])
    low, high = np.percentile(seen, (100 - SHOWN, SHOWN)) if seen.size else (0, 1)
    *_, pair = pairs()
    found.pictures.append(('left image', [
        ('left image', data_uri(in_eight_bits(pair.left), cv2.INTER_AREA))]))
    for name, one in maps.items():
        uris = [(f'disparity by {name}', data_uri(colour_disparity(one.raw, low, high)))]
        if one.confidence is not None:
            uris.append((f'confidence by {name}', data_uri(cv2.applyColorMap(
                cv2.convertScaleAbs(one.confidence, alpha=255), cv2.COLORMAP_VIRIDIS))))
        found.pictures.append((name, uris))
    return found


def _figures(pairs, matcher, start, task):
    """Return {name of a figure: a value for each pair}, and the last Maps."""
    match, other = (matcher.begin(task, start) for _ in range(2))
    figures, last = {name: [] for name in ('density', 'agree', 'confidence', 'flicker',
                                           'time')}, None
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
        last = maps
    return figures, last


def _known(values):
    """Return the mean of values, None of none."""
    return mean(values) if values else None
