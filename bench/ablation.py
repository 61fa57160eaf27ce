# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ablation: the profiles as they are, and without a part of their genetic algorithm.

Of `realtime` and `fast` on pairs alone, in colour and grey, and over frames of scenes that stand
still, pans and drives; of `quality` on pairs alone.
"""
from functools import partial
from statistics import median

from bench.draws import by_draw, in_words, means_over_draws, over_draws, with_draw
from bench.request import figures_of_sequence, report_of, Subject
from bench.scoring import bad_percent
from bench.variants import AS_IT_IS, FAST, QUALITY, REALTIME
from bench.warm import walks
from fuzzy_stereo_ros.evaluation.matchers import fastest
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching.row_offsets import grey
import pandas as pd

VARIANTS = *REALTIME, *FAST, *QUALITY
NOISE = 1.5             # grey levels, of pairs alone
ALONE, ON_GREY = 'cold', 'cold, grey'
KINDS = {'still, noise 1.5': 'still', 'pan 2 px, noise 1.5': 'pan'}     # of bench.warm
DRIVES = 'KITTI drive, noise 3', 'made, drive, noise 6', 'made, pictured street, noise 3'
FRAMES = 8
INDOORS = 'middv2', 'midd2006_third'      # scenes of `quality`
SHOWN = ALONE, ON_GREY, *KINDS.values(), 'drives'
TIMES = {'time, cold': (ALONE,), 'time, over frames': SHOWN[2:]}


def run(request):
    """Return the `Report` of what each part of each profile earns."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    pairs = [scene for scene in scenes if scene.group != 'made'] or scenes
    moving = [Subject(one, KINDS[one.group.partition(', ')[2]], one.noise)
              for one in walks(scenes, request.quick, [*KINDS], FRAMES, every=2)]
    moving += [Subject(one, 'drives', one.noise) for one in sequences if one.group in DRIVES]
    indoors = [scene for scene in scenes if scene.group in INDOORS] or scenes[:1]
    alone, over_frames, slow = request.drawn(
        ([Subject(scene, ALONE, NOISE) for scene in pairs], 'pairs', on_pair),
        (moving, 'over frames', on_frames),
        ([Subject(scene, ALONE, 0) for scene in indoors], 'quality',
         partial(on_pair, profiles=('quality',))))
    found = pd.concat([alone, over_frames])
    return report_of('ablation', 'Ablation', {
        'profiles': 'filled; each variant matches the same images as the profile as it is',
        'genes of neighbours': 'without them a cell keeps to its own gene of the half-size '
                               'chromosome, mutated by one; genes further away cost 2 more a px; '
                               'without the previous best pictures are averaged all the same',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth)',
        **in_words(request.draws),
        'columns': f'cold: pairs alone, noise of {NOISE:g} grey levels; still, pan: every other '
                   f'scene of middv2 and midd2006_third over {FRAMES} frames, noise 1.5, of which '
                   f'the last one counts; drives: {"; ".join(DRIVES)}',
        'time': 'processor time of one thread, of that as it is: the median of the frames, with '
                'the variants in turns',
    }, [genetic_table(found), quality_table(slow)], [*skipped, *missing],
        figures=found, quality=slow)


def on_pair(subject, draw, profiles=('realtime', 'fast')):
    """Return dicts of a pair alone: profile, name, kind, scene, error, time."""
    scene, _, noise = subject
    known, found = scene.read(), []
    pair, = with_draw([known], noise, draw, alike=False)
    for kind, images in ((ALONE, (pair.left, pair.right)),
                         (ON_GREY, (grey(pair.left), grey(pair.right)))):
        for one in (variant for variant in VARIANTS if variant.profile in profiles):
            matcher = one.matcher(scene.disparities, warm_start=False)
            matcher.warm_up(*known.left.shape[:2])
            match, milliseconds = fastest(partial(matcher.match, *images), 1, processor=True)
            found.append({'profile': one.profile, 'name': one.name, 'kind': kind,
                          'scene': scene.path, 'time': milliseconds,
                          'error': bad_percent(match.disparity, known, scene.limit)})
    return found


def on_frames(subject, draw):
    """Return dicts as `on_pair` does, of a `ScoredSequence`; its time is the median of frames."""
    one, kind, _ = subject
    frames, found = one.drawn(draw), []
    matchers = {(variant.profile, variant.name): variant.matcher(one.disparities, warm_start=True)
                for variant in (*REALTIME, *FAST)}
    maps, times = ({which: [] for which in matchers} for _ in range(2))
    for known in frames:
        for which, matcher in matchers.items():
            match, milliseconds = fastest(partial(
                matcher.match, known.left, known.right, camera=one.camera), 1, processor=True)
            maps[which].append(match.disparity)
            times[which].append(milliseconds)
    for (profile, name), several in maps.items():
        found.append({'profile': profile, 'name': name, 'kind': kind, 'scene': one.path,
                      'time': median(times[profile, name][1:]),
                      'error': figures_of_sequence(one, frames, several)['error']})
    return found


def genetic_table(found):
    """Return the table of `realtime` and `fast`, of a DataFrame of figures."""
    errors = means_over_draws(found, ['profile', 'name', 'kind'], ['error'])['error'].unstack(
        'kind', sort=False)
    errors = errors[[kind for kind in SHOWN if kind in errors]]
    for title, kinds in TIMES.items():
        errors[title] = shares(found[found.kind.isin(kinds)])
    return Table.of('What each part earns: error in percent, and time',
                    errors.set_axis(map(': '.join, errors.index)))


def shares(found):
    """Return a Series of the times by profile and name, of that as it is."""
    times = found.pivot_table('time', ['profile', 'scene', 'kind', 'draw'], 'name', sort=False)
    times = times.div(times[AS_IT_IS], axis=0).groupby('profile', sort=False).median()
    return times.stack()


def quality_table(found):
    """Return the table of `quality`, of a DataFrame of figures."""
    table = over_draws(by_draw(found, ['name', 'kind'], 'error')).unstack('kind', sort=False)
    table['seconds'] = found.groupby('name').time.mean() / 1000
    return Table.of(f'Profile quality, {" and ".join(INDOORS)}: error in percent, and seconds a '
                    'pair', table)
