# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The paper's algorithm over frames: each frame begins with the population of the one before.

Courses of frames begin with random maps. Beside them stands their last frame matched cold by the
profile `paper`, and what each part earns over frames.
"""
from functools import partial

from bench.datasets import cropped, window
from bench.draws import means_over_draws
from bench.request import Subject
from bench.scoring import bad_percent, ScoredSequence
from bench.variants import PAPER_OVER_FRAMES
from fuzzy_stereo_ros.evaluation.matchers import fastest, Ours
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np
import pandas as pd

NOISE, PAN = 1.5, 2                 # grey levels; px a frame
STILL_FRAMES, PAN_FRAMES, BEFORE_CUT, AFTER_CUT = 24, 16, 8, 16
QUICK_FRAMES = 2
SHOWN = 1, 2, 4, 8, 16, 24
LIVE = 'paper_live'
STILL, PANS = f'still, noise {NOISE}', f'pan of {PAN} px, noise {NOISE}'
DRIVES = 'KITTI drive', 'made, drive'
CUT, BEGUN = 'cut', 'the same, begun there'


def courses(pairs, sequences, quick=False):
    """Return the `ScoredSequence`s over some scenes, and the drives among some sequences."""
    def frames(number):
        return QUICK_FRAMES if quick else number

    found = [ScoredSequence(kind, scene.name, scene.family, scene.disparities, partial(
        window, scene, pan, frames(number)), noise=NOISE)
             for kind, pan, number in ((STILL, 0, STILL_FRAMES), (PANS, PAN, PAN_FRAMES))
             for scene in pairs]
    found += [one for one in sequences if one.group in DRIVES]
    if len(pairs) > 1:
        before, after = pairs[-2:]
        found += [ScoredSequence(
            kind, f'{before.name} to {after.name}', after.family,
            max(before.disparities, after.disparities), partial(
                _cut, before, frames(BEFORE_CUT), after, frames(AFTER_CUT), kind), noise=NOISE,
            scored=range(frames(BEFORE_CUT) if kind == CUT else 0, STILL_FRAMES))
            for kind in (CUT, BEGUN)]
    return found


def _cut(before, frames_before, after, frames_after, kind):
    """Return frames of one scene, then of another, cropped to the same size; or these alone."""
    parts = window(before, 0, frames_before) + window(after, 0, frames_after)
    size = np.min([one.truth.shape for one in parts], axis=0)
    return [cropped(one, *size) for one in parts[frames_before if kind == BEGUN else 0:]]


def follow(course, draw, profile=LIVE, changes=None, stages=None):
    """
    Match the frames of a course, of a draw of noise and of random maps; return a dict of figures.

    frame N: error in percent, last: of the last frame. milliseconds: of processor time, the median
    """
    matcher = Ours(LIVE, profile, {'seed': draw, **(changes or {})}, stages).matcher(
        course.disparities, warm_start=True)
    found, times = {'kind': course.group, 'scene': course.name}, []
    first = 1 - course.scored.start * (course.group == CUT)
    for number, known in enumerate(course.drawn(draw), first):
        match, milliseconds = fastest(partial(
            matcher.match, known.left, known.right, camera=course.camera), 1, processor=True)
        times.append(milliseconds)
        if number > 0 and known.truth is not None:
            found['last'] = found[f'frame {number}'] = bad_percent(
                match.disparity, known, course.limit)
    return {**found, 'milliseconds': float(np.median(times))}


def measure(subject, draw):
    """Return a list of the figures of a course, as `follow`, beside the last frame alone: cold."""
    course = subject.scene
    row = follow(course, draw)
    if course.group not in (CUT, BEGUN):
        last = course.drawn(draw)[-1]
        cold = Ours('cold', 'paper', {'seed': draw}).matcher(course.disparities, warm_start=False)
        match, alone = fastest(partial(cold.match, last.left, last.right), 1, processor=True)
        row.update({'cold': bad_percent(match.disparity, last, course.limit),
                    'time / cold': row['milliseconds'] / alone})
    if course.group == STILL:
        row['realtime'] = follow(course, draw, 'realtime')['last']
    return [row]


def frames_table(found):
    """Return the table of errors over frames of a DataFrame of figures of `measure`."""
    kinds = list(dict.fromkeys(found.kind))
    several = found.groupby('kind').scene.transform('nunique') > 1
    both = pd.concat([found, found[several].assign(scene='mean')]).sort_values(
        'kind', key=lambda those: those.map(kinds.index), kind='stable')
    table = means_over_draws(both, ['kind', 'scene'])
    table['last / cold'] = table['last'] / table['cold']
    shown = [*(f'frame {number}' for number in SHOWN), 'cold', 'realtime', 'last / cold',
             'time / cold']
    return Table.of('Over frames: error in percent',
                    table[[name for name in shown if name in table]].set_axis(
                        map(': '.join, table.index)),
                    f'Profile {LIVE}, begun with random maps, of each draw others. Cold: the last '
                    'frame alone by the profile paper; realtime: the last frame by that profile, '
                    'which saw all of them. Time: processor time of one thread.')


def ablate(subject, draw):
    """Return a list of the figures of the variant of PAPER_OVER_FRAMES that a subject names."""
    variant, = (one for one in PAPER_OVER_FRAMES if one.name == subject.condition)
    return [{'variant': variant.name, **follow(
        subject.scene, draw, changes=variant.changes, stages=variant.stages)}]


def ablation_table(found):
    """Return the table of a DataFrame of figures of `ablate`."""
    table = means_over_draws(found, ['variant', 'kind'], ['frame 2', 'last']).unstack(
        'kind', sort=False).swaplevel(axis=1)[list(dict.fromkeys(found.kind))]
    return Table.of('What each part earns over frames: mean error of the scenes, percent',
                    table.set_axis(map(', '.join, table.columns), axis=1),
                    'Sizes at equal work: as many patches are tried a frame.')


def tables(request, pairs):
    """Return the tables of this module; pairs: scenes."""
    found = courses(pairs, request.sequences(pairs)[0], request.quick)
    # Also without noise, draws differ: in the random maps.
    measured, ablated = request.drawn(
        ([Subject(one, LIVE, True) for one in found], 'paper over frames', measure),
        ([Subject(one, variant.name, True) for variant in PAPER_OVER_FRAMES for one in found
          if one.group in (STILL, PANS, 'made, drive')], 'what parts earn', ablate))
    return [frames_table(measured), ablation_table(ablated)]
