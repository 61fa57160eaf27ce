# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The balance: in each profile the error without population, crossover, mutation and previous best.

And, for the profiles that evolve for seconds, each of their parts removed or replaced.
"""
from dataclasses import dataclass

from fuzzy_stereo_ros.benchmarks.ablation_tables import signed
from fuzzy_stereo_ros.benchmarks.datasets import Scene
from fuzzy_stereo_ros.benchmarks.sequences import Sequence
from fuzzy_stereo_ros.benchmarks.variants import DEFAULT, PAPER, QUALITY, REALTIME, Trial
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np

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
        """What is shown while it runs."""
        name = (self.subject.path if isinstance(self.subject, Scene)
                else f'{self.subject.kind}, {self.subject.name}')
        return f'{self.profile}, {name}'


def run(request):
    """Return the `Report` of what each part of each profile earns."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    works = _works(scenes, [one for one in sequences if len(one.scored)], request.quick)
    with opencv_threads(1):
        found = [(work, _trials(work)) for work in request.follow(works, 'balance')]
    settings = {
        **environment('one each'),
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth); dense',
        'earns': f'how much of the error without it a part takes away; {EARNS:.0f} % earns its '
                 'place',
        'previous best': 'on the sequences of the benchmark `warm` with noise; the others on '
                         'single scenes, cold',
    }
    tables = [balance_table(found), *(
        table for profile in ('quality', 'paper')
        for table in evolution_tables(profile, found))]
    return Report('balance', 'The balance', settings, tables, [*skipped, *missing])


def _works(scenes, sequences, quick):
    """Return the `Work`s: the variants of each profile on the scenes that can tell them apart."""
    still = tuple(variant for variant in REALTIME if variant.still)
    moving = tuple(variant for variant in REALTIME if variant.part == 'previous best')
    shown = [scene for scene in scenes if scene.group == CLASSIC or scene.path in SHOWN]
    classic = [scene for scene in scenes if scene.group == CLASSIC]
    if quick or not shown:
        shown = classic = scenes[:1]
    return [*(Work('realtime', scene, still) for scene in scenes),
            *(Work('realtime', sequence, (DEFAULT, *moving)) for sequence in sequences
              if sequence.kind.startswith(NOISY)),
            *(Work('quality', scene, QUALITY) for scene in shown),
            *(Work('paper', scene, PAPER) for scene in classic)]


def _trials(work):
    """Return {name of variant: `Trial`}."""
    on = _on_scene if isinstance(work.subject, Scene) else _on_sequence
    return {variant.name: on(work, variant) for variant in work.variants}


def _matcher(work, variant):
    return StereoMatcher(MatcherConfig.from_profile(work.profile, **{
        'disparities': work.subject.disparities, 'reference': 'left', 'threads': 1, 'fill': True,
        **variant.changes}), variant.stages)


def _on_scene(work, variant):
    """Return the `Trial` of a cold match."""
    known, matcher = work.subject.read(), _matcher(work, variant)
    matcher.warm_up(*known.left.shape[:2])
    match = matcher.match(known.left, known.right)
    return Trial(bad_percent(match.disparity, known, work.subject.limit),
                 _best_fitness(matcher), match.times['total'])


def _on_sequence(work, variant):
    """Return the `Trial` of a sequence, the mean of its scored frames."""
    frames, matcher = work.subject.read(), _matcher(work, variant)
    matches, fitness = [], []
    for known in frames:
        matches.append(matcher.match(known.left, known.right))
        fitness.append(_best_fitness(matcher))
    scored = [number for number in work.subject.scored if frames[number].truth is not None]
    return Trial(
        float(np.mean([bad_percent(matches[number].disparity, frames[number], work.subject.limit)
                       for number in scored])),
        float(np.mean([fitness[number] for number in scored])),
        float(np.median([match.times['total'] for match in matches])))


def _best_fitness(matcher):
    population = matcher.algorithm.population
    return float(population.fitness[population.best])


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
    """Return the tables of errors, and of times and fitness, of a profile's variants."""
    chosen = [(work, trials) for work, trials in found if work.profile == profile]
    if not chosen:
        return []
    names = [variant.name for variant in chosen[0][0].variants]
    errors = {name: [trials[name].error for _, trials in chosen] for name in names}
    seconds, fitness = ({name: float(np.mean([figure(trials[name]) for _, trials in chosen]))
                         for name in names}
                        for figure in (lambda trial: trial.milliseconds / 1000,
                                       lambda trial: trial.fitness))
    usual = np.mean(errors[DEFAULT.name])
    return [Table(
        f'{profile}: error in percent', (
            '', *(work.subject.name for work, _ in chosen), 'mean', 'than as it is', 'seconds',
            'fitness of its best'),
        [(name, *errors[name], float(np.mean(errors[name])),
          None if name == DEFAULT.name else signed(np.mean(errors[name]) - usual), seconds[name],
          f'{fitness[name]:.4f}') for name in names],
        'Fitness compares only where the fitness itself is that of the profile as it is.')]
