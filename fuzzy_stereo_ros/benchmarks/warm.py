# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Warm start: the same matcher with and without its previous frame, error and flicker, and 3WAY.

Cold means that the matcher forgets the frame before each one.
"""
from dataclasses import dataclass
from functools import partial

from fuzzy_stereo_ros.benchmarks import over_frames
from fuzzy_stereo_ros.benchmarks.pictures import as_svg, draw_warm
from fuzzy_stereo_ros.evaluation.baselines import dense, opencv_threads, tuned_3way
from fuzzy_stereo_ros.evaluation.datasets import Sequence
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.evaluation.scores import flicker
import numpy as np

RIVAL = '3WAY'
COLD, WARM = 'cold', 'warm'


@dataclass(frozen=True)
class Course:
    """
    What was found on one sequence.

    bad: {contestant: percent, mean of the scored frames}, NaN where none has a truth.
    flickers: {contestant: percent of pixels that change by more than 1 px}, the mean from the
    first scored frame on.
    """

    sequence: Sequence
    bad: dict
    flickers: dict


def run(request):
    """Return the `Report` of cold against warm on the sequences of a request."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    with opencv_threads(1):
        courses = [measure(sequence, request)
                   for sequence in request.follow(sequences, 'warm')]
        walked = [over_frames.walk(request, one) for one in request.follow(
            over_frames.walks(request, scenes), 'over frames')]
        quality = over_frames.quality_errors(dict.fromkeys(
            one.scene for one in walked))
    settings = {
        **environment('one each'),
        'ours': f'{request.subject}, filled; cold: reset before each frame',
        'rival': '3WAY, tuned for the family, dense',
        'window': 'the classic pairs through a window that pans so many pixels per frame, with '
                  'fresh noise of so many grey levels (standard deviation, alike in the three '
                  'channels); frames 2 to 5 of 0 to 5',
        'error': 'percent off by more than 1 px, of the pixels that both cameras see; KITTI: '
                 '3 px, pixels with truth that are visible (noc), frame 10 after 7, 8 and 9',
        'flicker': 'percent of pixels that change by more than 1 px, the pan taken out',
        'hard cut': 'two frames of one scene, then one of another, which counts',
        'object appears': 'the frame in which it is there for the first time and the next',
    }
    found = [*tables(courses), over_frames.table(walked, quality)]
    pictures, lacking = as_svg('warm.svg', partial(draw_warm, found))
    more, missing_too = as_svg('over_frames.svg', partial(over_frames.draw, found))
    pictures, lacking = {**pictures, **more}, [*lacking, *missing_too]
    return Report('warm', 'Warm start', settings, found, [*skipped, *missing, *lacking], pictures)


def measure(sequence, request):
    """Return the `Course` of one sequence."""
    frames = sequence.read()
    matchers = {name: request.matcher(sequence.disparities, warm_start=True)
                for name in (COLD, WARM)}
    rival = tuned_3way(sequence.family)
    maps = {name: [] for name in (RIVAL, *matchers)}
    for known in frames:
        for name, matcher in matchers.items():
            if name == COLD:
                matcher.reset()
            maps[name].append(matcher.match(known.left, known.right).disparity)
        maps[RIVAL].append(dense(rival.match(known.left, known.right, sequence.disparities)))
    first = max(1, sequence.scored.start)
    return Course(
        sequence,
        {name: _mean(bad_percent(found[number], frames[number], sequence.limit)
                     for number in sequence.scored if frames[number].truth is not None)
         for name, found in maps.items()},
        {name: _mean(flicker(found[number - 1], found[number], (0, -sequence.pan))
                     for number in range(first, len(frames)) if sequence.flickers)
         for name, found in maps.items()})


def tables(courses):
    """Return the tables of a list of `Course`s."""
    kinds = {}
    for course in courses:
        kinds.setdefault(course.sequence.kind, []).append(course)
    rows = []
    for kind, found in kinds.items():
        bad, moved = ({name: _mean(getattr(course, figure)[name] for course in found)
                       for name in (RIVAL, COLD, WARM)} for figure in ('bad', 'flickers'))
        rows.append((f'{kind} ({len(found)})', bad[RIVAL], bad[COLD], bad[WARM],
                     _ratio(bad[WARM], bad[COLD]), _worst(found)[0],
                     moved[RIVAL], moved[COLD], moved[WARM]))
    worst = sorted(((*_worst([course]), course.sequence.path) for course in courses
                    if not np.isnan(_worst([course])[0])), reverse=True)[:5]
    return [
        Table('Error and flicker, percent', (
            '', '3WAY', 'cold', 'warm', 'warm / cold', 'worst warm - cold', 'flicker, 3WAY',
            'flicker, cold', 'flicker, warm'), rows,
            '*Worst warm - cold*: on a single sequence of the line, in points.'),
        Table('The sequences where the warm start costs most', (
            '', 'cold', 'warm', 'warm - cold'),
            [(path, cold, warm, more) for more, cold, warm, path in worst]),
    ]


def _worst(courses):
    """Return the largest warm minus cold, and the two errors."""
    found = [(course.bad[WARM] - course.bad[COLD], course.bad[COLD], course.bad[WARM])
             for course in courses]
    known = [one for one in found if not np.isnan(one[0])]
    return max(known) if known else (float('nan'),) * 3


def _ratio(value, whole):
    return value / whole if whole else float('nan')


def _mean(values):
    values = list(values)
    return float(np.mean(values)) if values else float('nan')
