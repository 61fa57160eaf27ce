# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ablation: the matcher as it is, and with each part removed or replaced, on scenes and sequences.

Fitness is that of the matcher as it is: all chromosomes of a scene are measured alike.
"""
from fuzzy_stereo_ros.benchmarks.pictures import draw_ablation
from fuzzy_stereo_ros.benchmarks.request import (
    halved, mean_flicker, means, report_of, scored_error, Trial)
from fuzzy_stereo_ros.benchmarks.truth import correlation_table, genes_of, truth_beside_result
from fuzzy_stereo_ros.benchmarks.variants import DEFAULT, REALTIME
from fuzzy_stereo_ros.evaluation.baselines import dense, tuned_3way
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import mean, signed, Table
import numpy as np
import pandas as pd

TURNS = 3           # of which the fastest counts
NOTABLE = 0.05      # points of error by which a scene counts as better or worse


def run(request):
    """Return the `Report` of what each part of the matcher earns."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    sequences = [one for one in sequences if len(one.scored)]
    of_scenes = dict(request.each(
        scenes, 'scenes', lambda scene: (scene, on_scene(scene, request))))
    of_sequences = dict(request.each(
        sequences, 'sequences', lambda sequence: (sequence, on_sequence(sequence, request))))
    made = scene_tables({scene: trials for scene, (trials, *_) in of_scenes.items()})
    if of_sequences:
        made += sequence_tables(of_sequences)
    made.append(correlation_table(
        {scene.path: points for scene, (_, points, _) in of_scenes.items()},
        {scene.path: truth for scene, (*_, truth) in of_scenes.items()}))
    return report_of('ablation', 'Ablation', {
        'as it is': f'{request.subject}, filled; on single scenes cold',
        'baseline': '3WAY, tuned for the family, dense; its fitness is that of its map in whole '
                    'pixels',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth); after the same refinement',
        'fitness': 'of the best chromosome before refinement, by the fitness of the matcher as it '
                   'is, measured everywhere; 1 would be fully possible and smooth',
        'time': f'all variants in turns; scenes: minimum of {TURNS}; sequences: median of the '
                'frames after the first; the replaced possibility is written to compare, not to '
                'be fast: no times of it',
        'sequences': 'those of the benchmark `warm`, scored as there',
    }, made, [*skipped, *missing], {'ablation.svg': draw_ablation})


def on_scene(scene, request):
    """
    Return what the variants and a baseline reach on a scene.

    {name: `Trial`}; [(fitness, error)] of all different chromosomes that came up; the two figures
    of `truth_beside_result`.
    """
    pair = scene.read()
    matchers = _matchers(request, scene, [one for one in REALTIME if one.still])
    seen, matches = {}, {name: [] for name in matchers}

    def observe(_, population):
        seen.update({member.tobytes(): member.copy() for member in population})

    for turn in range(TURNS + 1):       # the first takes memory and looks, the others are timed
        for name, matcher in matchers.items():
            matcher.reset()
            matches[name].append(matcher.match(pair.left, pair.right,
                                               observe=None if turn else observe))
    default = matchers[DEFAULT.name]
    fitness_of = default.algorithm.fitness_of
    trials = {}
    for name, matcher in matchers.items():
        observe(None, matcher.algorithm.population.genes[:1])
        trials[name] = Trial(
            bad_percent(matches[name][-1].disparity, pair, scene.limit),
            fitness_of(matcher.algorithm.population.genes[0]),
            min(match.times['total'] for match in matches[name][1:]))
    baseline = tuned_3way(scene.family)
    disparity = dense(baseline.match(pair.left, pair.right, scene.disparities))
    trials[baseline.name] = Trial(bad_percent(disparity, pair, scene.limit),
                                  fitness_of(genes_of(disparity, default)))
    points = [(fitness_of(genes), bad_percent(genes.astype(np.float32), pair, scene.limit))
              for genes in seen.values()]
    return trials, points, truth_beside_result(scene, pair, default)


def on_sequence(sequence, request):
    """Return {name of a variant: (`Trial`, flicker in percent)}: means, the time a median."""
    frames = sequence.read()
    matchers = _matchers(request, sequence, [one for one in REALTIME if one.moving])
    matches, fitness = ({name: [] for name in matchers} for _ in range(2))
    for pair in frames:
        for name, matcher in matchers.items():
            matches[name].append(matcher.match(pair.left, pair.right,
                                               camera=sequence.camera))
            fitness[name].append(matchers[DEFAULT.name].algorithm.fitness_of(
                matcher.algorithm.population.genes[0]))
    scored = [number for number in sequence.scored if frames[number].truth is not None]
    trials = {}
    for name, several in matches.items():
        maps = [match.disparity for match in several]
        trials[name] = (Trial(
            scored_error(sequence, frames, maps), mean(fitness[name][number] for number in scored),
            float(np.median([match.times['total'] for match in several[1:]]))),
            mean_flicker(sequence, maps))
    return trials


def _matchers(request, subject, variants):
    """Return {name of a variant: its `StereoMatcher`} for a scene or a sequence."""
    return {one.name: Ours(one.name, request.profile, {**request.changes, **one.changes},
                           one.stages).matcher(subject.disparities) for one in variants}


def scene_tables(found):
    """Return the tables of errors, fitness and times of {`Scene`: {name: `Trial`}}."""
    trials = pd.DataFrame([(scene.group, scene.path, name, one.error, one.fitness,
                            one.milliseconds) for scene, named in found.items()
                           for name, one in named.items()],
                          columns=['group', 'scene', 'name', 'error', 'fitness', 'milliseconds'])
    names = trials.name.unique()
    errors = means(trials, 'error', names, 'name').T
    every = trials.pivot(index='name', columns='scene', values='error').loc[names]
    more = every - every.loc[DEFAULT.name]
    errors['mean of groups'] = errors.mean(axis=1)
    errors['than as it is'] = _compared(more.mean(axis=1))
    for heading, which in (('worse on', more > NOTABLE), ('better on', more < -NOTABLE)):
        errors[heading] = which.sum(axis=1).astype(object).mask(errors.index == DEFAULT.name, None)
    made = [Table.of('Scenes: mean error of the groups in percent', errors,
                     f'*Worse on*, *better on*: scenes of {len(found)} whose error is larger or '
                     'smaller than that of the matcher as it is by more than '
                     f'{NOTABLE} points.')]
    halves = halved(trials, 'name').pivot_table('error', 'name', ['group', 'half'], sort=False)
    if len(halves):
        made.append(Table.of('Scenes: odd and even ones of each group, mean error in percent',
                             halves.set_axis(map(', '.join, halves.columns), axis=1)))
    made.append(Table.of('Scenes: mean fitness of the groups',
                         means(trials, 'fitness', names, 'name').T, digits=4))
    times = means(trials, 'milliseconds', [
        one.name for one in REALTIME if one.still and one.timed], 'name').T
    times['of that as it is'] = (times / times.loc[DEFAULT.name]).mean(axis=1)
    return [*made, Table.of('Scenes: mean time of the groups in milliseconds', times)]


def sequence_tables(found):
    """Return the tables of {`Sequence`: {name: (`Trial`, flicker)}}; a noise shares a column."""
    trials = pd.DataFrame([(sequence.kind.split(', pan')[0], sequence.path, name, one.error,
                            flickers, one.fitness, one.milliseconds)
                           for sequence, named in found.items()
                           for name, (one, flickers) in named.items()],
                          columns=['kind', 'sequence', 'name', 'error', 'flicker', 'fitness',
                                   'milliseconds'])
    counts = trials.groupby('kind', sort=False).sequence.nunique()
    names = trials.name.unique()
    errors, flickers = (trials.groupby(['name', 'kind'])[figure].mean().unstack().loc[
        names, counts.index].rename(columns=lambda kind: f'{kind} ({counts[kind]})')
        for figure in ('error', 'flicker'))
    for table in (errors, flickers):
        table['mean of kinds'] = table.mean(axis=1)
        table['than as it is'] = _compared(table['mean of kinds']
                                           - table['mean of kinds'][DEFAULT.name])
    errors['fitness'] = trials.groupby('name').fitness.mean().map('{:.4f}'.format)
    times = trials.pivot(index='name', columns='sequence', values='milliseconds')
    errors['time, of that as it is'] = (times / times.loc[DEFAULT.name]).median(axis=1)
    errors.loc[[one.name for one in REALTIME if one.moving and not one.timed],
               'time, of that as it is'] = None
    return [Table.of('Sequences: mean error in percent', errors),
            Table.of('Sequences: mean flicker in percent', flickers)]


def _compared(differences):
    """Return differences with their signs as words, None for the matcher as it is."""
    return differences.map(signed).astype(object).mask(differences.index == DEFAULT.name, None)
