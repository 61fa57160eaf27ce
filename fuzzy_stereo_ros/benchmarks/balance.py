# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The balance: in each profile the error without population, crossover, mutation and previous best.

And, for the profiles that evolve for seconds, each of their parts removed or replaced.
"""
from dataclasses import dataclass

from fuzzy_stereo_ros.benchmarks.request import report_of, scored_error, Trial
from fuzzy_stereo_ros.benchmarks.variants import DEFAULT, PAPER, QUALITY, REALTIME
from fuzzy_stereo_ros.evaluation.datasets import Scene, Sequence
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import signed, Table
import numpy as np
import pandas as pd

PARTS = 'population', 'crossover', 'mutation', 'previous best'
CLASSIC = 'middv2'
# Scenes on which an evolution of seconds is taken apart: classic, plain, textured, road.
SHOWN = ('midd2006_third/Midd1', 'midd2006_third/Flowerpots', 'midd2006_third/Rocks1',
         'kitti/kitti2012_color/000000')
NOISY = 'window, noise'     # sequences on which the previous best is taken away
EARNS = 3.0                 # percent of the mean error by which a part earns its place


@dataclass(frozen=True)
class Work:
    """A scene or a sequence on which the variants of a profile run."""

    profile: str
    subject: Scene | Sequence
    variants: tuple

    @property
    def path(self):
        """Profile and scene or sequence, as progress shows them."""
        return f'{self.profile}, {self.subject.path}'


def run(request):
    """Return the `Report` of what each part of each profile earns."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    works = _works(scenes, [one for one in sequences if len(one.scored)], request.quick)
    found = request.each(works, 'balance', lambda work: (work, _trials(work)))
    return report_of('balance', 'The balance', {
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth); dense',
        'earns': f'how much of the error without it a part takes away; {EARNS:.0f} % earns its '
                 'place',
        'previous best': 'on the sequences of the benchmark `warm` with noise; the others on '
                         'single scenes, cold',
    }, [balance_table(found), *(table for profile in ('quality', 'paper')
                                for table in evolution_tables(profile, found))],
        [*skipped, *missing])


def _works(scenes, sequences, quick):
    """Return the `Work`s: the variants of each profile on the scenes that can tell them apart."""
    single = tuple(variant for variant in REALTIME if variant.still)
    moving = tuple(variant for variant in REALTIME if variant.part == 'previous best')
    shown = [scene for scene in scenes if scene.group == CLASSIC or scene.path in SHOWN]
    classic = [scene for scene in scenes if scene.group == CLASSIC]
    if quick or not shown:
        shown = classic = scenes[:1]
    return [*(Work('realtime', scene, single) for scene in scenes),
            *(Work('realtime', sequence, (DEFAULT, *moving)) for sequence in sequences
              if sequence.kind.startswith(NOISY)),
            *(Work('quality', scene, QUALITY) for scene in shown),
            *(Work('paper', scene, PAPER) for scene in classic)]


def _trials(work):
    """Return {name of variant: `Trial`}: of a scene cold, of a sequence the error alone."""
    trials, frames = {}, work.subject.read()
    for variant in work.variants:
        matcher = Ours(variant.name, work.profile, variant.changes, variant.stages).matcher(
            work.subject.disparities)
        if isinstance(work.subject, Sequence):
            trials[variant.name] = Trial(scored_error(work.subject, frames, [
                matcher.match(pair.left, pair.right, camera=work.subject.camera).disparity
                for pair in frames]))
        else:
            matcher.warm_up(*frames.left.shape[:2])
            match = matcher.match(frames.left, frames.right)
            population = matcher.algorithm.population
            trials[variant.name] = Trial(
                bad_percent(match.disparity, frames, work.subject.limit),
                float(population.fitness[population.best]), match.times['total'])
    return trials


def balance_table(found):
    """
    Return the table of what population, crossover, mutation and previous best earn.

    found: list of (`Work`, {name of variant: `Trial`})
    """
    rows = []
    for profile, variants in (('realtime', REALTIME), ('quality', QUALITY), ('paper', PAPER)):
        for part in PARTS:
            chosen = [variant for variant in variants if variant.part == part]
            rows += [row for variant in chosen
                     if (row := _balance_row(profile, part, variant, found))]
            if not chosen:
                rows.append((profile, part, 'has none', None, None, None, None))
    return Table('What each part of each profile earns', (
        'profile', 'part', 'without it', 'scenes', 'error as it is [%]', 'error without it [%]',
        'earns [%]'), rows)


def _balance_row(profile, part, variant, found):
    """Return the row of a part, None where nothing was measured."""
    pairs = [(trials[DEFAULT.name].error, trials[variant.name].error) for work, trials in found
             if work.profile == profile and variant.name in trials and (
                 part != 'previous best' or isinstance(work.subject, Sequence))]
    if not pairs:
        return None
    with_it, without = np.mean(pairs, axis=0)
    return (profile, part, variant.name, len(pairs), float(with_it), float(without),
            signed(100 * (without - with_it) / without if without else 0.0))


def evolution_tables(profile, found):
    """Return the table of errors, times and fitness of a profile's variants, as a list."""
    chosen = [(work.subject.name, trials) for work, trials in found if work.profile == profile]
    if not chosen:
        return []

    def figures(figure):
        return pd.DataFrame({scene: {name: getattr(one, figure) for name, one in trials.items()}
                             for scene, trials in chosen})

    table = figures('error')
    table['mean'] = table.mean(axis=1)
    table['than as it is'] = [None if name == DEFAULT.name else signed(more) for name, more in (
        table['mean'] - table['mean'][DEFAULT.name]).items()]
    table['seconds'] = figures('milliseconds').mean(axis=1) / 1000
    table['fitness of its best'] = figures('fitness').mean(axis=1).map('{:.4f}'.format)
    return [Table.of(
        f'{profile}: error in percent', table,
        'Fitness compares only where the fitness itself is that of the profile as it is.')]
