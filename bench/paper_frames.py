# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The paper's algorithm over frames: each frame begins with the population of the one before.

Courses of frames begin with random maps. Beside them stands their last frame matched cold by the
profile `paper`, and what each part earns over frames.
"""
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from bench.datasets import cropped, window
from bench.scoring import bad_percent
from bench.variants import PAPER_OVER_FRAMES
from fuzzy_stereo_ros.evaluation.matchers import fastest, Ours
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching.match import Camera
import numpy as np
import pandas as pd

NOISE, PAN = 1.5, 2                 # grey levels; px a frame
STILL_FRAMES, PAN_FRAMES, BEFORE_CUT, AFTER_CUT = 24, 16, 8, 16
QUICK_FRAMES = 2
SHOWN = 1, 2, 3, 4, 5, 8, 12, 16, 24
SEEDS = 0, 1, 2
LIVE = 'paper_live'
STILL, PANS = f'still, noise {NOISE}', f'pan of {PAN} px, noise {NOISE}'
DRIVES = 'KITTI drive', 'made, drive'


class Course(NamedTuple):
    """
    Frames that a matcher sees one after the other.

    read: called with a seed, returns the `GroundTruthPair`s; skipped: frames before the one that
    is printed as the first; compared: whether the last frame is also matched cold
    """

    kind: str
    name: str
    disparities: int
    limit: float
    read: Callable
    camera: Camera | None = None
    skipped: int = 0
    compared: bool = True


def courses(pairs, sequences, quick=False):
    """Return the courses over some scenes, and the drives among some sequences."""
    def frames(number):
        return QUICK_FRAMES if quick else number

    found = [Course(kind, scene.name, scene.disparities, scene.limit, partial(
        _seen, scene, pan, frames(number)))
             for kind, pan, number in ((STILL, 0, STILL_FRAMES), (PANS, PAN, PAN_FRAMES))
             for scene in pairs]
    found += [Course(one.group, one.name, one.disparities, one.limit,
                     lambda seed, one=one: one.read(), one.camera)
              for one in sequences if one.group in DRIVES]
    if len(pairs) > 1:
        parts = pairs[-2], frames(BEFORE_CUT), pairs[-1], frames(AFTER_CUT)
        of_cut = pairs[-1].name, max(one.disparities for one in pairs[-2:]), pairs[-1].limit
        found += [Course(f'cut from {pairs[-2].name}', *of_cut, partial(_cut, *parts),
                         skipped=frames(BEFORE_CUT), compared=False),
                  Course('the same, begun there', *of_cut, lambda seed: _cut(*parts, seed)[
                      frames(BEFORE_CUT):], compared=False)]
    return found


def _seen(scene, pan, frames, seed):
    return window(scene, NOISE, pan, frames, seed)


def _cut(before, frames_before, after, frames_after, seed):
    """Return frames of one scene, then of another, cropped to the same size."""
    parts = _seen(before, 0, frames_before, seed) + _seen(after, 0, frames_after, seed)
    size = np.min([one.truth.shape for one in parts], axis=0)
    return [cropped(one, *size) for one in parts]


def follow(course, seed, profile=LIVE, changes=None, stages=None):
    """
    Match the frames of a course; return a dict of figures.

    frame N: error in percent. milliseconds: of processor time, the median of the frames.
    """
    matcher = Ours(LIVE, profile, {'seed': seed, **(changes or {})}, stages).matcher(
        course.disparities, warm_start=True)
    found, times = {}, []
    for number, known in enumerate(course.read(seed), 1 - course.skipped):
        match, milliseconds = fastest(partial(
            matcher.match, known.left, known.right, camera=course.camera), 1, processor=True)
        times.append(milliseconds)
        if number > 0 and known.truth is not None:
            found['last'] = found[f'frame {number}'] = bad_percent(
                match.disparity, known, course.limit)
    return {**found, 'milliseconds': float(np.median(times))}


def measure(request, course):
    """Return the mean figures of a course over the seeds, a dict: kind, scene and those below."""
    rows = []
    for seed in SEEDS[:1] if request.quick else SEEDS:
        row = follow(course, seed)
        if course.compared:
            last = list(course.read(seed))[-1]
            cold = Ours('cold', 'paper', {'seed': seed}).matcher(
                course.disparities, warm_start=False)
            match, row['cold ms'] = fastest(
                partial(cold.match, last.left, last.right), 1, processor=True)
            row['cold'] = bad_percent(match.disparity, last, course.limit)
        if course.kind == STILL:
            row['realtime'] = follow(course, seed, 'realtime')['last']
        rows.append(row)
    return {'kind': course.kind, 'scene': course.name,
            **pd.DataFrame(rows).mean(numeric_only=True).to_dict()}


def frames_table(measured):
    """Return the table of errors over frames of a list of figures of `measure`."""
    found = pd.DataFrame(measured)
    means = found.groupby('kind', sort=False).mean(numeric_only=True).reset_index()
    several = found.groupby('kind')['scene'].transform('nunique') > 1
    means = means[means.kind.isin(found[several].kind)].assign(scene='mean')
    found = pd.concat([found, means]).sort_values(
        'kind', key=lambda kinds: kinds.map({kind: place for place, kind in enumerate(
            found.kind.unique())}), kind='stable')
    shown = [name for name in (f'frame {number}' for number in SHOWN) if name in found]
    table = found[shown].set_axis(found.kind + ': ' + found.scene)
    for name in ('cold', 'realtime'):
        if name in found:
            table[name] = found[name].values
    if 'cold' in found:
        table['last / cold'] = (found['last'] / found['cold']).values
        table['time / cold'] = (found['milliseconds'] / found['cold ms']).values
    table['ms a frame'] = found['milliseconds'].values
    return Table.of('Over frames: error in percent', table,
                    f'Profile {LIVE}, begun with random maps; means of {len(SEEDS)} seeds. Cold: '
                    'the last frame alone by the profile paper; realtime: the last frame by that '
                    'profile, which saw all of them. Times: processor time of one thread.')


def ablate(some, variant):
    """Return the figures of a `Variant` on some courses: its name, and mean errors by kind."""
    rows = [{'kind': course.kind, **follow(course, 0, changes=variant.changes,
                                           stages=variant.stages)} for course in some]
    found = pd.DataFrame(rows).groupby('kind', sort=False).mean(numeric_only=True)
    return {'variant': variant.name,
            **{f'{kind}, {column}': found.loc[kind, column] for kind in found.index
               for column in ('frame 2', 'last') if column in found},
            'ms a frame': float(found['milliseconds'].mean())}


def ablation_table(ablated):
    """Return the table of a list of figures of `ablate`."""
    return Table.of('What each part earns over frames: mean error of the scenes, percent',
                    pd.DataFrame(ablated).set_index('variant'),
                    'Seed 0; sizes at equal work: as many patches are tried a frame.')


def tables(request, pairs):
    """Return the tables of this module; pairs: scenes."""
    found = courses(pairs, request.sequences(pairs)[0], request.quick)
    measured = request.each(found, 'paper over frames', partial(measure, request))
    some = [course for course in found if course.kind in (STILL, PANS, 'made, drive')]
    ablated = request.each(PAPER_OVER_FRAMES, 'what parts earn', partial(ablate, some))
    return [frames_table(measured), ablation_table(ablated)]
